// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Folds towards an irregular vertex where a sharp edge ends or bends.
//
// Along a sharp line det J depends on the level, linearly (line_folds.h), and so it does towards the vertex, where the
// boundary on either side of the edge is independent as well: even an edge that is convex all along, or regular, may
// fold beside its end. So one level doesn't show what all others are like. The levels are looked at one after the
// other, down to where they are smaller than anything that a voxel shows: the lines' sub-cells by proof along each
// line, the regular ones in their middle. What the levels hold is taken less the vertex and doubled at every level, so
// that nothing cancels.

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/limit/line_folds.h"

namespace ccslice {

/// One solid, one thread.
class VertexFolds {
 public:
  static constexpr int kLevels = 20;  // Below the ring that is given.

  VertexFolds(const LimitSolid::Data& data, LineFolds& lines) : data_(data), lines_(lines) {}

  /// A sharp edge leads to the vertex of this operator.
  bool has_sharp_edge(std::uint32_t op) const;
  /// `ring`: the points of a vertex cell or of the sub-cell at its vertex, kPositionDimension doubles each. The
  /// determinant found is by the parameters of that (sub-)cell.
  FoldFinding examine(std::uint32_t op, std::span<const double> ring);

 private:
  FoldFinding examine_child(const VertexOperator& now, std::size_t child);

  const LimitSolid::Data& data_;
  LineFolds& lines_;
  std::vector<double> ring_, next_;
};

}  // namespace ccslice
