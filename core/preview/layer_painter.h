// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Pictures of a job's layers, voxel by voxel as slicing makes them: a pixel is a voxel, y goes upwards. Mixes are those
// that halftoning chooses from.

#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "core/base/cancellation.h"
#include "core/job/placed_part.h"
#include "core/job/slice_job.h"
#include "core/preview/pixel_colours.h"
#include "core/preview/preview_job.h"
#include "core/slicer/layer_slicer.h"

namespace ccslice {

/// The job with the planes that its pictures are made of, and the contours if they are asked for or drawn.
SliceJob layer_preview_job(SliceJob job, const PreviewColours& show, bool contours);

/// One thread. Layers of one slab share its work, whatever their order.
class LayerPainter {
 public:
  /// `parts`: with jobs as layer_preview_job() makes them, whose printing is what is shown, not that of `show`.
  /// `tiles_fit`: as LayerSlicer takes it. REQUIRES: PlacedParts; validate_colours() passes; at most kMaxPreviewPixels
  /// voxels of the region each way. Throws Error{kCancelled}.
  LayerPainter(const PlacedParts& parts, PreviewColours show, const CancellationToken& cancel,
               std::span<const std::optional<bool>> tiles_fit = {});

  /// REQUIRES: a layer of the job's region. Throws what LayerSlicer::slice() throws.
  PreviewPicture paint(std::uint32_t layer, const CancellationToken& cancel);

 private:
  void mix(PreviewPicture& picture, const CancellationToken& cancel) const;

  SliceJob job_;  // The first part's: all are alike in what this reads.
  PreviewColours show_;
  LayerSlicer slicer_;
};

}  // namespace ccslice
