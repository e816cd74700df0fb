// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// How finely a job cuts a solid's cells and boundary faces, told by cutting a few of them.
//
// A cell is followed down its tree of nodes to a child that chance picks each time, which stands for all children
// [Knuth 1975, Estimating the efficiency of backtrack programs]: the product of the numbers of children on the way is
// how many such leaves there are, without bias. A face is halved for a few planes, as a layer would halve it.

#pragma once

#include <memory>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include "core/base/cancellation.h"
#include "core/contour/contour_leaves.h"
#include "core/interpolation/pieces/block_raster.h"
#include "core/interpolation/pieces/cell_fitter.h"
#include "core/interpolation/samples/interpolation_spec.h"
#include "core/job/slice_job.h"
#include "core/limit/boundary_surface.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

/// One thread.
class CutCells {
 public:
  CutCells(const std::shared_ptr<const LimitSolid>& solid, const InterpolationSpec& spec);

  struct Cut {
    double leaves = 0;  // Pieces and holes of a cell, on average.
    double runs = 0;    // Of pieces, for each row and layer of a cell's box.
  };
  /// `cells`: with their boxes in voxels. Throws Error{kCancelled}.
  Cut cut(std::span<const std::pair<LimitCellId, Box3>> cells, const CancellationToken& cancel);

 private:
  void descend(LimitCellId cell, const Box3& box, double& leaves, double& runs);
  /// The runs of a piece in the grid, told by some of its layers.
  double runs_of(const CellPiece& piece);

  const Grid grid_;
  CellFitter fitter_;
  BlockRaster raster_;
  std::vector<BlockRun> scanned_;
  std::minstd_rand chance_;
};

/// One thread.
class CutFaces {
 public:
  /// REQUIRES: the solid and the job outlive this.
  CutFaces(const LimitSolid& solid, const SliceJob& job);

  struct Cut {
    double nodes = 0;    // That halving a face for all planes makes, on average,
    double visited = 0;  // and that a plane through the face's hull visits.
    double points = 0;   // Of contours, where such a plane meets the face.
    double rows = 0;     // That contours cross there, for each row of its hull's box.
  };
  /// Throws Error{kCancelled}.
  Cut cut(std::span<const BoundaryFaceId> faces, const CancellationToken& cancel);

 private:
  bool is_crossed(const ContourLeaf& leaf) const;

  const SliceJob& job_;
  const BoundarySurface surface_;
  LeafCriteria criteria_;
  ContourLeaves leaves_;
  std::minstd_rand chance_;
};

}  // namespace ccslice
