// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A contact sheet: up to two dozen layers of a job, evenly spread, scaled down side by side, each with its number and
// its height in mm, laid out as the layers' own pictures. Where the job shows materials, they are halftoned at the
// sheet's own scale, in their own colours. Otherwise its first channel, if it has one, colours the material from low
// (dark blue) to high (yellow), or else its cell regions do. A legend below says what the colours are.
//
// The layers are sliced once more at the same heights, no finer than the sheet shows them: that takes a moment, and
// works for whatever encodings the job has.

#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "client/cli/pictures/picture.h"
#include "client/cli/pictures/voxel_block.h"
#include "client/cli/session/session.h"

namespace ccslice::cli {

/// Layers first, first + stride, ...
struct SpreadLayers {
  std::uint32_t first = 0, stride = 1, count = 1;
};

/// Up to 24 of `count` layers, as many left out below as above them (one more above at most). REQUIRES: count > 0.
SpreadLayers spread_layers(std::uint32_t first, std::uint32_t count);

/// Places and sizes in dots.
struct SheetLayout {
  int columns = 1;
  int tile_width = 1, tile_height = 1;
};

/// As large as `count` tiles of this shape can be on a sheet of about 1200 x 900. REQUIRES: count > 0, sizes > 0.
SheetLayout lay_out_sheet(int count, double width_mm, double height_mm);

struct SheetCaption {
  std::string number, height;
};

/// REQUIRES: block.size > 0, a caption for each of the block's layers.
Picture draw_contact_sheet(const VoxelBlock& block, const std::vector<SheetCaption>& captions,
                           const SheetLayout& layout);

/// The sheet of a job that was sliced. `header` is the one that its layers came with. Throws ClientError.
Picture contact_sheet(Session& session, const v1::SliceRangeRequest& job, const v1::SliceHeader& header);

}  // namespace ccslice::cli
