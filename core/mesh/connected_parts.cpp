// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/connected_parts.h"

#include <algorithm>
#include <span>

#include "core/mesh/disjoint_sets.h"
#include "core/mesh/point_clusters.h"

namespace ccslice {
namespace {

/// Vertices that cells hold together.
DisjointSets parts_of(const ControlMesh& mesh) {
  DisjointSets parts(mesh.vertex_count());
  std::size_t begin = 0;
  for (const CellKind kind : mesh.cell_kinds) {
    const auto count = static_cast<std::size_t>(corner_count(kind));
    for (std::size_t i = 1; i < count; ++i) {
      parts.unite(mesh.cell_vertices[begin], mesh.cell_vertices[begin + i]);
    }
    begin += count;
  }
  return parts;
}

/// By first vertex: how many cells.
std::vector<std::uint32_t> cells_of_parts(const ControlMesh& mesh, DisjointSets& parts) {
  std::vector<std::uint32_t> cells(mesh.vertex_count(), 0);
  std::size_t begin = 0;
  for (const CellKind kind : mesh.cell_kinds) {
    ++cells[parts.first_of(mesh.cell_vertices[begin])];
    begin += static_cast<std::size_t>(corner_count(kind));
  }
  return cells;
}

}  // namespace

ConnectedParts count_parts(const ControlMesh& mesh) {
  DisjointSets parts = parts_of(mesh);
  const std::vector<std::uint32_t> cells = cells_of_parts(mesh, parts);
  const auto count = [&](auto holds) { return static_cast<std::size_t>(std::ranges::count_if(cells, holds)); };
  return {count([](std::uint32_t c) { return c > 0; }), count([](std::uint32_t c) { return c == 1; })};
}

NearParts find_near_parts(const ControlMesh& mesh, double most_mm) {
  DisjointSets parts = parts_of(mesh);
  NearParts near;
  for (const PointCluster& cluster : find_point_clusters(mesh.positions, most_mm)) {
    const std::uint32_t first = cluster.points.front();
    for (const std::uint32_t point : cluster.points) {
      if (parts.same(first, point)) continue;
      parts.unite(first, point);
      near.apart_mm = std::max(near.apart_mm, cluster.length);
    }
  }
  const std::vector<std::uint32_t> cells = cells_of_parts(mesh, parts);
  near.count = static_cast<std::size_t>(std::ranges::count_if(cells, [](std::uint32_t c) { return c > 0; }));
  return near;
}

}  // namespace ccslice
