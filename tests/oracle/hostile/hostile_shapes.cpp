// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/oracle/hostile/hostile_shapes.h"

#include <array>
#include <numbers>

#include "core/models/models.h"
#include "tests/support/random_meshes.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::oracle {
namespace {

constexpr double kShapeCellMm = 10;

std::string sizes(int nx, int ny, int nz) {
  return std::to_string(nx) + "x" + std::to_string(ny) + "x" + std::to_string(nz);
}

HostileShape box(const std::string& name, int nx, int ny, int nz) {
  return {box_mesh(nx, ny, nz, kShapeCellMm), name + " " + sizes(nx, ny, nz), true, nx * ny * nz <= 16};
}

HostileShape bar(HostileRandom& random) { return box("bar", random.pick(2, 8), random.pick(1, 3), random.pick(1, 3)); }
HostileShape plate(HostileRandom& random) { return box("plate", random.pick(2, 7), random.pick(2, 7), 1); }
HostileShape strut(HostileRandom& random) { return box("strut", random.pick(3, 20), 1, 1); }

HostileShape ring(HostileRandom& random) {
  RingShape shape;
  shape.cells_round = 4 * random.pick(1, 5);
  shape.cells_across = random.pick(1, 2);
  shape.cells_high = random.pick(1, 3);
  shape.outer_diameter_mm = 8.0 * shape.cells_round / 3;
  shape.inner_diameter_mm = shape.outer_diameter_mm * random.between(0.2, 0.8);
  shape.height_mm = kShapeCellMm * shape.cells_high;
  ControlMesh mesh = make_ring(shape);
  mesh.sharp_edges.clear();
  mesh.sharp_vertices.clear();
  return {std::move(mesh), "ring " + sizes(shape.cells_round, shape.cells_across, shape.cells_high), false, false};
}

HostileShape fan(HostileRandom& random) {
  const bool open = random.chance(0.5);
  const int sectors = random.pick(open ? 1 : 3, 12), split = random.pick(1, 2), layers = random.pick(1, 3);
  const double degrees = open ? random.between(25.0 * sectors, std::min(110.0 * sectors, 340.0)) : 360;
  return {fan_mesh(sectors, split, layers, degrees),
          (open ? "open fan " : "closed fan ") + sizes(sectors, split, layers), false, sectors * split * layers <= 12};
}

HostileShape catalogue(HostileRandom& random) {
  const std::vector<TinyMesh>& meshes = tiny_meshes();
  const TinyMesh& tiny = meshes[static_cast<std::size_t>(random.pick(0, static_cast<int>(meshes.size()) - 1))];
  return {tiny.mesh, "tiny " + tiny.name, false, tiny.mesh.cell_count() <= 12};
}

HostileShape scattered(HostileRandom& random) {
  constexpr std::array kinds = {RandomKind::kPolycube, RandomKind::kHexStar, RandomKind::kTetStar,
                                RandomKind::kTerrain};
  constexpr std::array names = {"polycube", "hex star", "tet star", "terrain"};
  const std::size_t kind = static_cast<std::size_t>(random.pick(0, 3));
  const auto seed = static_cast<std::uint32_t>(random.bits());
  ControlMesh mesh = random_mesh(kinds[kind], seed);
  const bool coarse = mesh.cell_count() <= 12;
  return {std::move(mesh), std::string(names[kind]) + " " + std::to_string(seed), kind == 0, coarse};
}

/// A cube of n^3 cells mapped onto a ball: of each cube shell a sphere's, so edges and corners of the cube go flat.
HostileShape ball(HostileRandom& random) {
  const int n = random.chance(0.6) ? random.pick(2, 5) : random.pick(6, 12);
  HostileShape shape{box_mesh(n, n, n, 2.0 / n), "ball " + sizes(n, n, n), false, n <= 2};
  const double round = random.between(0.5, 1);  // 1: a ball, all the way.
  for (Vec3& p : shape.mesh.positions) {
    p -= Vec3::Ones();
    const Vec3 s = p.cwiseProduct(p);
    const Vec3 on_ball(p.x() * std::sqrt(1 - s.y() / 2 - s.z() / 2 + s.y() * s.z() / 3),
                       p.y() * std::sqrt(1 - s.z() / 2 - s.x() / 2 + s.z() * s.x() / 3),
                       p.z() * std::sqrt(1 - s.x() / 2 - s.y() / 2 + s.x() * s.y() / 3));
    p = n * kShapeCellMm / 2 * ((1 - round) * p + round * on_ball);
  }
  return shape;
}

HostileShape sample(HostileRandom& random) {
  const auto samples = sample_models();
  const SampleModel& model = samples[static_cast<std::size_t>(random.pick(0, static_cast<int>(samples.size()) - 1))];
  return {model.make(), "sample " + std::string(model.name), false, false};
}

}  // namespace

HostileShape make_hostile_shape(HostileRandom& random) {
  using Maker = HostileShape (*)(HostileRandom&);
  constexpr std::array<Maker, 9> makers = {bar, plate, strut, ring, fan, catalogue, scattered, ball, sample};
  constexpr std::array weights = {10.0, 9.0, 12.0, 7.0, 12.0, 14.0, 20.0, 12.0, 4.0};
  return makers[random.weighted(weights)](random);
}

}  // namespace ccslice::oracle
