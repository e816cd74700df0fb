// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The shape of a block: how large, how thick and how bent (interpolation/samples/block_nodes.h).
//
// Whoever puts flat triangles for its faces misplaces them by the faces' bulge. That matters as far as the bulge is
// large beside the block's thickness, or beside a voxel.

#pragma once

#include <cstddef>

#include "core/base/types.h"
#include "core/interpolation/pieces/face_quarters.h"
#include "core/interpolation/samples/block_nodes.h"

namespace ccslice {

struct BlockShape {
  Box3 box;              // The samples' box.
  Mat3 axes;             // The block's, through its middle, voxels. axes.col(a) leads from end to end.
  Mat3 inverse_axes;     // Voxels -> shares of the block's axes, to first order about its middle.
  double voxels = 0;     // In it, about.
  bool flat = false;     // No volume about its middle: inverse_axes isn't finite.
  std::size_t step = 1;  // Flat triangles between every step-th node stand for its faces: as large as bulges allow.
  // By axis: how far the triangles' sides along it miss the arc, as a share of the thickness across them.
  Vec3 bulge = Vec3::Zero();
  // How far the triangles miss the faces, each across itself, as a share of the thickness along the block's axis there:
  // arcs along both axes of a face and its twist together.
  double miss = 0;
  unsigned axes_of_miss = 0;  // Axes that have a notable part in it, of the face that is missed by most.

  /// Bit a: the bulge along axis a, or the miss of a face along it, is notable: halve the block along it.
  unsigned bent_axes() const;

  /// Columns.
  double thickness_along_x() const;
};

/// Voxels -> shares of the block's thickness across quadrilaterals of a face (interpolation/pieces/block_faces.h), a
/// lane each: 0 along the quadrilateral, 1 along the middle of the block's `axis`. In a block that tapers, or is fanned
/// out, faces aren't parallel to what its middle shows, and what nodes are off along a face counts across its middle.
/// Where a quadrilateral is turned over that way, as in a fold, the middle's.
LanePoints across_quads(const BlockShape& shape, std::size_t axis, const LanePoints& lower, const LanePoints& along_s,
                        const LanePoints& along_t, const LanePoints& upper);

/// `points`: in voxels, so that the centre of voxel (column, row, layer) is at those numbers.
BlockShape shape_of(const BlockPoints& points);

}  // namespace ccslice
