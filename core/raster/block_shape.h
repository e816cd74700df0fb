// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The shape of a block: how large, how thick and how bent (base/block_nodes.h).
//
// Whoever puts flat triangles for its faces misplaces them by the faces' bulge. That matters as far as the bulge is
// large beside the block's thickness, or beside a voxel.

#pragma once

#include "core/base/block_nodes.h"
#include "core/base/types.h"

namespace ccslice {

struct BlockShape {
  Box3 box;                // Of the nodes.
  Mat3 inverse_axes;       // Voxels -> shares of the block's axes, to first order about its middle.
  double voxels = 0;       // In it, about.
  bool flat = false;       // No volume about its middle: inverse_axes isn't finite.
  unsigned bent_axes = 0;  // Bit a: chords between neighbouring nodes along axis a miss the arc by a notable share of
                           // the thickness across them: halve the block along it.

  /// How far the block may be extended along x: a small share of its thickness. Columns.
  double reach() const;
};

/// `points`: in voxels, so that the centre of voxel (column, row, layer) is at those numbers.
BlockShape shape_of(const BlockPoints& points);

}  // namespace ccslice
