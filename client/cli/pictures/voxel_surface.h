// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The surface of a block's voxels, for parts that have no other one: those that something is cut out of.
//
// Surface nets [Gibson98]: between eight voxels of which some are inside lies one vertex, and round each pair of
// neighbours of which one is inside lie the four vertices of a square. Vertices move towards the mean of their
// neighbours, but stay between their eight voxels, so that steps of voxels become slopes.
//
// [Gibson98] S. F. F. Gibson, *Constrained elastic surface nets*, MICCAI 1998.

#pragma once

#include "client/cli/pictures/voxel_block.h"
#include "client/surface.h"

namespace ccslice::cli {

/// Closed, counter-clockwise from outside, in mm. Without channels. No triangles if no voxel is inside.
client::Surface voxel_surface(const VoxelBlock& block);

}  // namespace ccslice::cli
