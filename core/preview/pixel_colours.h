// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// From the values at a plane's pixels to their colours.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/output/plane.h"
#include "core/preview/preview_job.h"
#include "core/printing/halftone.h"
#include "core/raster/region_runs.h"
#include "core/raster/voxel_runs.h"

namespace ccslice {

/// Pixels that the mixture of this number mixes, of HalftonePlan::mixtures().
struct MixedRun : VoxelRun {
  std::size_t mixture;
};
/// Pixels of cell regions, each mixed as its region is.
std::vector<MixedRun> mixed_runs(const HalftonePlan& plan, std::span<const RegionRun> runs);

/// The same for pictures of a mix, which is no error and chooses without thresholds: their mask may take seconds to
/// make.
Printing mixed_only(Printing printing);

/// Sets the pixels, counts and range of a picture of kOccupancy or kChannel, whose size is set. `values`: the channel
/// as kFloat32, row 0 lowest. `spans`: what is inside.
void colour_pixels(const PreviewColours& show, std::span<const SampleImage> values, std::span<const VoxelRun> spans,
                   PreviewPicture& picture);

/// What a picture's mixed pixels are made of.
struct MixedPixels {
  const HalftonePlan* plan;
  std::vector<SampleImage> values;  // An image for each of channels_of(plan->printing()).
  std::vector<MixedRun> runs;
};

/// The same of kMix. Where parts share pixels, the last one has them. Throws Error{kCancelled}.
void mix_pixels(std::span<const MixedPixels> parts, PreviewPicture& picture, const CancellationToken& cancel);

/// The same of kHalftone in the plane of the picture: each pixel by the threshold of the voxel of `grid` that it lies
/// in. Throws Error{kCancelled}.
void halftone_pixels(const PreviewPlane& plane, const Grid& grid, const HalftonePlan& plan,
                     std::span<const SampleImage> values, std::span<const MixedRun> runs, PreviewPicture& picture,
                     const CancellationToken& cancel);

/// The same of a halftoned layer: numbers of materials, row 0 lowest, 0 outside.
void material_pixels(std::span<const std::uint8_t> numbers, const Printing& printing, PreviewPicture& picture);

}  // namespace ccslice
