// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Which cells are limit-ready, and of which class.
//
// An edge is REGULAR if it is inside with 4 cells, smooth on the boundary with 2, or sharp with 1; otherwise it is
// irregular.
//
// A vertex is
//   regular    if it has no irregular edge and isn't tagged (a corner with one cell and three sharp edges may be): a
//              tensor product of B-splines and phantom layers reproduces its rule;
//   on a line  if its irregular edges form one straight line through it (two opposite EEs of valence n, or two opposite
//              boundary edges with the same number of cells and the same sharpness), or one such line that ends on a
//              face there;
//   mixed      if it touches a cell that isn't a hexahedron;
//   irregular  otherwise.
//
// In a complex that is as meshed every hexahedron is regular, and every other cell must be refined.
//
// Else a cell without mixed vertices is regular (all vertices regular), a line cell (one irregular edge, both ends on a
// line) or a vertex cell (one irregular vertex, and every irregular edge of the cell starts there). Anything else must
// be refined.

#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/mesh/cell_complex.h"
#include "core/subdivision/cell_class.h"

namespace ccslice {

struct Classification {
  CellClass cell_class = CellClass::kRegular;
  std::uint8_t anchor = 0;  // kLine: the local edge (axis * 4 + i); kVertex: the corner's bits.
};

/// Classifies cells of one complex; remembers what it found out about vertices. REQUIRES: the complex outlives it.
class Classifier {
 public:
  explicit Classifier(const CellComplex& complex)
      : complex_(complex), vertex_state_(complex.vertex_count(), State::kUnknown) {}

  /// Nothing if the cell isn't limit-ready. REQUIRES: the cell's vertices are complete.
  [[nodiscard]] std::optional<Classification> classify(CellId cell);
  /// REQUIRES: one of the edge's vertices is complete.
  bool irregular(EdgeId edge) const;

 private:
  enum class State : std::uint8_t { kUnknown, kRegular, kOnLine, kIrregular, kMixed };

  State state(VertexId vertex);
  State find_state(VertexId vertex) const;
  bool line_passes(VertexId vertex, EdgeId edge_a, EdgeId edge_b) const;
  bool line_ends(VertexId vertex, EdgeId edge) const;

  const CellComplex& complex_;
  std::vector<State> vertex_state_;
};

}  // namespace ccslice
