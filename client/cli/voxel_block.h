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
#include "client/cli/picture.h"
#include "client/cli/session.h"

namespace ccslice::cli {

/// x fastest, then y, then z.
struct VoxelBlock {
  std::array<int, 3> size{};
  std::vector<std::uint8_t> inside;  // 1 or 0.
  std::vector<std::uint8_t> value;   // A channel from 0 to 255; all 0: no channel. Or the number of a material, from 1.
  std::vector<Colour> palette = {};  // The materials' colours; empty if the block shows a channel.

  std::size_t index(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(size[1]) + static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(size[0]) +
           static_cast<std::size_t>(x);
  }
};

/// Asks for the planes that a block is made of: the occupancy and, unless `channel` is empty, that channel.
void ask_for_block(v1::SliceRangeRequest& request, const std::string& channel);

/// Asks for the planes that a block of printed materials is made of: the occupancy and the materials.
void ask_for_material_block(v1::SliceRangeRequest& request, const v1::Printing& printing);

/// Has the block sliced. `what` names this in the progress bar. REQUIRES: one of the two functions above has asked for
/// the planes. Throws ClientError.
VoxelBlock slice_block(Session& session, const v1::SliceRangeRequest& request, const std::string& what);

}  // namespace ccslice::cli
