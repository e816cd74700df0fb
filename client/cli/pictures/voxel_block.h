// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Layers of voxels to draw pictures from: sliced once more for the picture, as coarse as it needs them.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "ccslice/v1/slice.pb.h"
#include "client/cli/pictures/legend.h"
#include "client/cli/pictures/picture.h"
#include "client/cli/session/session.h"

namespace ccslice::cli {

/// x fastest, then y, then z.
struct VoxelBlock {
  std::array<int, 3> size{};
  std::vector<std::uint8_t> inside;  // 1 or 0.
  std::vector<std::uint8_t> value;   // A channel from 0 to 255; or the number of one of legend.entries, from 1.
  Legend legend = {};                // What the values are. Empty: nothing, the block shows the occupancy alone.
  Vec3 origin_mm = Vec3::Zero();     // The lower corner of the grid's first voxel.
  Vec3 pitch_mm = Vec3::Ones();

  std::size_t index(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(size[1]) + static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(size[0]) +
           static_cast<std::size_t>(x);
  }

  /// REQUIRES: inside[voxel] is 1.
  Colour colour(std::size_t voxel) const {
    if (legend.range) return material_colour(value[voxel] / 255.0);
    const std::size_t entry = value[voxel] - 1u;  // A number that the legend doesn't have comes from a server at fault.
    return entry < legend.entries.size() ? legend.entries[entry].colour : kPlainMaterial;
  }
};

/// Some material leaves voxels empty, so that the part's surface isn't that of its voxels.
bool leaves_empty(const v1::Printing& printing);

/// Asks for the planes that a block is made of: the occupancy and, unless `channel` is empty, that channel.
void ask_for_block(v1::SliceJob& job, const std::string& channel);

/// Asks for the planes that a block of printed materials is made of: the occupancy and the materials.
void ask_for_material_block(v1::SliceJob& job, const v1::Printing& printing);

/// Asks for the planes that a block of cell regions is made of: the occupancy and the regions.
void ask_for_region_block(v1::SliceJob& job);

/// Has the block sliced. `what` names this in the progress bar. REQUIRES: one of the functions above has asked for
/// the planes. Throws ClientError.
VoxelBlock slice_block(Session& session, const v1::SliceRangeRequest& request, const std::string& what);

}  // namespace ccslice::cli
