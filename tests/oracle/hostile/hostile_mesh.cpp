// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/oracle/hostile/hostile_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "tests/oracle/hostile/hostile_channels.h"
#include "tests/oracle/hostile/hostile_random.h"
#include "tests/oracle/hostile/hostile_shapes.h"
#include "tests/oracle/hostile/hostile_text.h"
#include "tests/support/brute_force.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::oracle {
namespace {

constexpr double kCellMm = 10;
constexpr std::size_t kMostCellsSharpenedAnywhere = 150;  // Sharp edges of many cells fold, which takes long to invert.

Box3 box_of(const ControlMesh& mesh) {
  Box3 box;
  for (const Vec3& p : mesh.positions) box.extend(p);
  return box;
}

/// Along x into an arc in the xz plane, of so many degrees.
void bend(ControlMesh& mesh, double degrees) {
  const Box3 box = box_of(mesh);
  const double length = box.sizes().x(), radius = length / (degrees * std::numbers::pi / 180);
  for (Vec3& p : mesh.positions) {
    const double angle = (p.x() - box.min().x()) / radius, r = radius - (p.z() - box.center().z());
    p = Vec3(r * std::sin(angle), p.y(), radius - r * std::cos(angle));
  }
}

/// Round the x axis through the middle.
void twist(ControlMesh& mesh, double degrees) {
  const Box3 box = box_of(mesh);
  const Vec3 middle = box.center();
  for (Vec3& p : mesh.positions) {
    const double angle = degrees * std::numbers::pi / 180 * (p.x() - middle.x()) / box.sizes().x();
    p = middle + Eigen::AngleAxisd(angle, Vec3::UnitX()) * (p - middle);
  }
}

void deform(HostileRandom& random, HostileShape& shape, std::string& description) {
  if (random.chance(0.6)) {
    const double share = random.log_between(0.001, 0.25);
    jitter(shape.mesh, share * kCellMm, static_cast<std::uint32_t>(random.bits()));
    description += " jitter " + number(share);
  }
  if (shape.bends && random.chance(0.4)) {
    const double degrees = random.between(5, 150);
    bend(shape.mesh, degrees);
    description += " bend " + number(degrees);
  }
  if (shape.bends && random.chance(0.35)) {
    const double degrees = random.between(5, 180);
    twist(shape.mesh, degrees);
    description += " twist " + number(degrees);
  }
  if (random.chance(0.35)) {
    const Vec3 stretch(random.log_between(0.2, 5), random.log_between(0.2, 5), random.log_between(0.2, 5));
    for (Vec3& p : shape.mesh.positions) p = p.cwiseProduct(stretch);
    description += " stretch " + number(stretch.x()) + "," + number(stretch.y()) + "," + number(stretch.z());
  }
}

/// Boundary edges with one cell, or any of them at random; and some of their ends as corners.
void sharpen_some(HostileRandom& random, ControlMesh& mesh, std::string& description) {
  constexpr std::array weights = {0.45, 0.2, 0.35};  // None, convex ones, any.
  const std::size_t kind = random.weighted(weights);
  const double share = kind == 2 ? random.unit() : 1, corners = random.chance(0.25) ? random.between(0, 0.3) : 0;
  if (!mesh.sharp_edges.empty() || (kind == 0 && corners == 0)) return;
  if (kind == 2 && mesh.cell_count() > kMostCellsSharpenedAnywhere) return;
  const BruteMesh brute = to_brute_mesh(mesh);
  const BruteTopology topology = build_topology(brute.cells, brute.vertex_count());
  std::vector<bool> tagged(mesh.vertex_count());
  for (const std::uint32_t v : mesh.sharp_vertices) tagged[v] = true;
  for (std::uint32_t e = 0; e < topology.edges.size(); ++e) {
    if (!topology.edge_on_boundary(e)) continue;
    const bool convex = topology.edge_cells[e].size() == 1;
    if (kind > 0 && (kind == 2 || convex) && random.chance(share)) mesh.sharp_edges.push_back(topology.edges[e]);
    const std::uint32_t v = topology.edges[e][0];
    if (tagged[v] || !random.chance(corners / 3)) continue;
    tagged[v] = true;
    mesh.sharp_vertices.push_back(v);
  }
  description += " sharp " + std::to_string(mesh.sharp_edges.size()) + "+" + std::to_string(mesh.sharp_vertices.size());
}

/// To any size, anywhere.
void put_somewhere(HostileRandom& random, ControlMesh& mesh, std::string& description) {
  const Box3 box = box_of(mesh);
  const double size_mm = random.chance(0.5) ? random.log_between(5, 100) : random.log_between(0.01, 1000);
  Vec3 offset = Vec3::Zero();
  if (random.chance(0.3)) offset = random.log_between(1, 1e4) * random.in_cube(1);
  for (Vec3& p : mesh.positions) p = size_mm / box.sizes().maxCoeff() * (p - box.center()) + offset;
  description += " size " + number(size_mm) + " mm";
  if (!offset.isZero()) description += " at " + number(offset.cwiseAbs().maxCoeff()) + " mm";
}

HostileShape shape_of_file(HostileRandom& random, std::span<const NamedMesh> files) {
  const NamedMesh& file = files[static_cast<std::size_t>(random.pick(0, static_cast<int>(files.size()) - 1))];
  return {file.mesh, "file " + file.name, false, file.mesh.cell_count() <= 12};
}

}  // namespace

HostileMesh make_hostile_mesh(std::uint64_t seed, std::span<const NamedMesh> files) {
  HostileRandom random(seed, 1);
  HostileShape shape = files.empty() ? make_hostile_shape(random) : shape_of_file(random, files);
  std::string description = shape.name;
  if (shape.coarse && random.chance(0.12)) {
    shape.mesh = refined_mesh(shape.mesh);
    description += " refined";
  }
  if (files.empty()) deform(random, shape, description);
  sharpen_some(random, shape.mesh, description);
  put_somewhere(random, shape.mesh, description);
  shape.mesh.allow_folds = random.chance(0.15);
  if (shape.mesh.allow_folds) description += " allow folds";
  description += ", " + std::to_string(shape.mesh.cell_count()) + " cells, channels";
  HostileRandom material_random(seed, 2);
  HostileChannels channels = add_hostile_channels(material_random, shape.mesh);
  return {std::move(shape.mesh), description + channels.description, std::move(channels.linear)};
}

}  // namespace ccslice::oracle
