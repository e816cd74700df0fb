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

#include <cstddef>
#include <vector>

#include "core/limit/vertex_walk.h"
#include "core/prepare/line_folds.h"

namespace ccslice {

/// One solid, one thread.
class VertexFolds {
 public:
  static constexpr int kLevels = 20;  // Below the ring that is given.

  explicit VertexFolds(LineFolds& lines) : lines_(lines) {}

  /// A sharp edge leads to the vertex.
  bool has_sharp_edge(const CornerOperator& corner) const;
  /// `walk`: at a vertex cell or at the sub-cell at its vertex, kPositionDimension doubles a point. The determinant
  /// found is by the parameters of that (sub-)cell.
  FoldFinding examine(VertexWalk walk);

 private:
  FoldFinding examine_child(VertexWalk& walk, std::size_t number);

  LineFolds& lines_;
  std::vector<double> child_;
};

}  // namespace ccslice
