// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What slicing a job takes of memory, told before a slicer is made: samples and codecs, which follow from the job, the
// contours, crossings and spans of its fullest layer, and the pieces, runs and tiles of its fullest slab, which follow
// from where the solid's faces and cells are.
//
// The first are exact. How finely contours and materials have to be cut is known only when it is done: a few cells and
// faces are cut to tell it (slicer/cut_estimates.h). For the samples this is above what is held
// (tests/core/slicer/slicer_memory_test.cpp): 1.3 to 2.3 times for whole jobs, and where it is little up to 32 MiB
// more. It is no bound, and leaves out what a layer takes that has to be painted whole for a region's voxels.

#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/base/cancellation.h"
#include "core/job/placed_part.h"
#include "core/job/slice_job.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

struct SlicerMemory {
  std::uint64_t shared_bytes = 0;  // Of all slicers of the job together.
  std::uint64_t slicer_bytes = 0;  // Of each.
  std::uint64_t crossings = 0;     // Of rows with the boundary, in the fullest layer: finding them takes time, too.
  // By part: what a LayerSlicer would have to find out, too, if it interpolates.
  std::vector<std::optional<bool>> tiles_fit = {};
};

/// At most, with the layer that is being made, and without the solids. Takes about a microsecond for every face and
/// cell of each part. REQUIRES: PlacedParts. Throws Error{kCancelled}.
SlicerMemory slicer_memory(const PlacedParts& parts, const CancellationToken& cancel = {});
/// The same of a job of one part. REQUIRES: validate_job(*solid, job) passes.
SlicerMemory slicer_memory(const std::shared_ptr<const LimitSolid>& solid, const SliceJob& job,
                           const CancellationToken& cancel = {});

}  // namespace ccslice
