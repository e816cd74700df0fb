// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/oracle/hostile/hostile_meshed.h"

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "core/mesh_import/mid_nodes.h"
#include "tests/oracle/hostile/hostile_random.h"
#include "tests/oracle/hostile/hostile_text.h"

namespace ccslice::oracle {
namespace {

constexpr std::uint64_t kMeshedStream = 15;
constexpr double kShareAsMeshed = 1.0 / 3, kShareCurved = 0.4;

/// Draws nodes near the middles of edges, quadrilaterals and hexahedra.
class NodeMaker {
 public:
  NodeMaker(HostileRandom& random, const HostileMesh& mesh)
      : random_(random), mesh_(mesh), list_(mesh.mesh.channel_count()) {
    curved_ = random.between(0.1, 1);
    of_faces_ = random.chance(0.5) ? random.between(0, 1) : 0;
    bulge_ = random.log_between(1e-3, 0.15);
    rough_ = random.chance(0.5) ? random.log_between(1e-3, 1) : 0;
  }

  MidNodes make() {
    const ControlMesh& mesh = mesh_.mesh;
    std::size_t begin = 0;
    for (std::uint32_t cell = 0; cell < mesh.cell_count(); ++cell) {
      const CellKind kind = mesh.cell_kinds[cell];
      const auto corners = std::span(mesh.cell_vertices).subspan(begin, static_cast<std::size_t>(corner_count(kind)));
      begin += corners.size();
      for (const auto& [a, b] : mid_edges(kind)) {
        const std::array<std::uint32_t, 2> edge = {corners[a], corners[b]};
        if (draw(curved_, edge)) list_.add_edge(edge, {place_, values_});
      }
      for (const auto& [a, b, c, d] : mid_faces(kind)) {
        const std::array<std::uint32_t, 4> face = {corners[a], corners[b], corners[c], corners[d]};
        if (draw(of_faces_, face)) list_.add_face(face, {place_, values_});
      }
      if (kind == CellKind::kHex && draw(of_faces_, corners)) list_.add_cell(cell, {place_, values_});
    }
    return list_.finish().nodes;
  }

  std::string description() const {
    return " curved " + number(curved_) + " by " + number(bulge_) + (of_faces_ > 0 ? " with nodes of faces" : "");
  }

 private:
  /// Perhaps a node near the middle of these vertices: its place, and its values.
  bool draw(double share, std::span<const std::uint32_t> vertices) {
    if (!random_.chance(share)) return false;
    const ControlMesh& mesh = mesh_.mesh;
    const std::size_t channels = mesh.channel_count();
    Vec3 middle = Vec3::Zero();
    Box3 box;
    for (const std::uint32_t v : vertices) {
      middle += mesh.positions[v] / static_cast<double>(vertices.size());
      box.extend(mesh.positions[v]);
    }
    middle += bulge_ * box.sizes().maxCoeff() * random_.in_cube(1);
    values_.assign(channels, 0);
    for (std::size_t c = 0; c < channels; ++c) {
      double mean = 0, least = mesh.channel_values[vertices[0] * channels + c], most = least;
      for (const std::uint32_t v : vertices) {
        const double value = mesh.channel_values[v * channels + c];
        mean += value / static_cast<double>(vertices.size());
        least = std::min(least, value), most = std::max(most, value);
      }
      mean += rough_ * (most - least) * random_.between(-1, 1);
      values_[c] = static_cast<float>(mesh_.linear[c] ? (*mesh_.linear[c])(middle) : mean);
    }
    place_ = middle;
    return true;
  }

  HostileRandom& random_;
  const HostileMesh& mesh_;
  MidNodeList list_;
  Vec3 place_ = Vec3::Zero();
  std::vector<float> values_;
  double curved_, of_faces_, bulge_, rough_;
};

}  // namespace

void take_some_as_meshed(std::uint64_t seed, HostileMesh& mesh) {
  HostileRandom random(seed, kMeshedStream);
  if (!random.chance(kShareAsMeshed)) return;
  mesh.mesh.as_meshed = true;
  mesh.mesh.sharp_edges.clear();
  mesh.mesh.sharp_vertices.clear();
  mesh.mesh.interpolating = false;
  mesh.mesh.missed_vertices.clear();
  mesh.description += ", as meshed";
  if (!random.chance(kShareCurved)) return;
  NodeMaker maker(random, mesh);
  mesh.mesh.mid_nodes = maker.make();
  mesh.description += maker.description();
}

}  // namespace ccslice::oracle
