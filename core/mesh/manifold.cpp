// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/manifold.h"

#include "core/base/contains.h"

namespace ccslice {

template <typename Through>
std::size_t ManifoldTest::reachable(std::span<const CellId> cells, Through through) {
  seen_.assign(1, cells.front());
  for (std::size_t i = 0; i < seen_.size(); ++i) {
    cells_across(complex_, seen_[i], through, [&](CellId next) {
      if (!contains(seen_, next)) seen_.push_back(next);
    });
  }
  return seen_.size();
}

bool ManifoldTest::holds_at(EdgeId edge) {
  const auto faces = complex_.edge_faces(edge);
  const auto boundary = std::ranges::count_if(faces, [&](FaceId f) { return complex_.face_on_boundary(f); });
  if (boundary != 0 && boundary != 2) return false;
  const auto cells = complex_.edge_cells(edge);
  return reachable(cells, [&](FaceId f) { return contains(faces, f); }) == cells.size();
}

bool ManifoldTest::holds_at(VertexId vertex) {
  const auto cells = complex_.vertex_cells(vertex);
  const auto faces = complex_.vertex_faces(vertex);
  const auto through = [&](FaceId f) { return contains(complex_.face_vertices(f), vertex); };
  if (reachable(cells, through) != cells.size()) return false;
  const auto euler = static_cast<std::ptrdiff_t>(complex_.vertex_edges(vertex).size()) -
                     static_cast<std::ptrdiff_t>(faces.size()) + static_cast<std::ptrdiff_t>(cells.size());
  return euler == (complex_.vertex_on_boundary(vertex) ? 1 : 2);
}

}  // namespace ccslice
