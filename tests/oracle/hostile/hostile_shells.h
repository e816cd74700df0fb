// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Pieces paint up to the flat triangles that stand for their faces. Where these are outside of a face, what lies there
// is another cell's, or another piece's (interpolation/pieces/block_shell.h). A piece's own runs end at the triangles,
// so these are searched for where its polynomials are off most: the solid is inverted at each place. What is painted
// beyond them, in gaps that were closed, isn't looked at here.

#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/interpolation/pieces/cell_fitter.h"
#include "core/inversion/point_inverter.h"
#include "tests/oracle/hostile/hostile_evaluated.h"
#include "tests/oracle/hostile/hostile_finding.h"
#include "tests/oracle/hostile/hostile_truth.h"

namespace ccslice::oracle {

class ShellSearch {
 public:
  ShellSearch(const Evaluated& evaluated, HostileFinding& finding);

  /// The triangles of all six sides. Not of pieces that are hardly larger than voxels may lie off the solid: so many
  /// cells come near to a place there that each takes milliseconds.
  void search(LimitCellId cell, const CellPiece& piece);

 private:
  void search(LimitCellId cell, const CellPiece& piece, std::size_t side);
  double find_error(LimitCellId cell, const CellPiece& piece, const Vec3& voxel);
  double true_error(const CellPiece& piece, const Vec3& voxel);
  double error(const CellPiece& piece, const Vec3& voxel, std::span<const double> values,
               std::span<const double> slack) const;

  const Evaluated& evaluated_;
  HostileFinding& finding_;
  Placement mesh_of_voxel_;
  PointInverter inverter_;
  TruthFinder truths_;
  std::vector<double> values_, no_slack_;
  bool outside_ = false;  // Some place of the side at hand is painted and not in the piece's cell.
};

}  // namespace ccslice::oracle
