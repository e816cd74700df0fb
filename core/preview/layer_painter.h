// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Pictures of a job's layers, voxel by voxel as slicing makes them: a pixel is a voxel, y goes upwards.

#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "core/base/cancellation.h"
#include "core/job/slice_job.h"
#include "core/limit/limit_solid.h"
#include "core/preview/preview_job.h"
#include "core/printing/halftone.h"
#include "core/slicer/layer_slicer.h"

namespace ccslice {

/// The job with the planes that its pictures are made of, and the contours if they are asked for or drawn.
SliceJob layer_preview_job(SliceJob job, const PreviewColours& show, bool contours);

/// One thread. Layers of one slab share its work, whatever their order.
class LayerPainter {
 public:
  /// `job`: as layer_preview_job() makes it. REQUIRES: validate_job() and validate_colours() pass; at most
  /// kMaxPreviewPixels voxels of the region each way. Throws Error{kCancelled}.
  LayerPainter(std::shared_ptr<const LimitSolid> solid, SliceJob job, PreviewColours show,
               const CancellationToken& cancel);

  /// REQUIRES: a layer of the job's region. Throws what LayerSlicer::slice() throws.
  PreviewPicture paint(std::uint32_t layer, const CancellationToken& cancel);

 private:
  SliceJob job_;
  PreviewColours show_;
  std::optional<HalftonePlan> plan_;  // Of kMix.
  LayerSlicer slicer_;
};

}  // namespace ccslice
