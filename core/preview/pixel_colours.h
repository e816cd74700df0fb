// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// From the values at a plane's pixels to their colours.

#pragma once

#include <span>

#include "core/base/cancellation.h"
#include "core/output/plane.h"
#include "core/preview/preview_job.h"
#include "core/printing/halftone.h"
#include "core/raster/voxel_runs.h"

namespace ccslice {

/// Sets the pixels, counts and range of a picture whose size is set. `values`: kFloat32, row 0 lowest, one image a
/// channel: of kChannel that one, of kMix those that `mixture` reads, in its order. `spans`: what is inside. Throws
/// Error{kCancelled}.
void colour_pixels(const PreviewColours& show, const Mixture* mixture, std::span<const SampleImage> values,
                   std::span<const VoxelRun> spans, PreviewPicture& picture, const CancellationToken& cancel);

/// The same of kHalftone in the plane of the picture, mixed by the plan's first map: each pixel by the threshold of the
/// voxel of `grid` that it lies in.
void halftone_pixels(const PreviewPlane& plane, const Grid& grid, const HalftonePlan& plan,
                     std::span<const SampleImage> values, std::span<const VoxelRun> spans, PreviewPicture& picture,
                     const CancellationToken& cancel);

/// The same of a halftoned layer: numbers of materials, row 0 lowest, 0 outside.
void material_pixels(std::span<const std::uint8_t> numbers, const Printing& printing, PreviewPicture& picture);

}  // namespace ccslice
