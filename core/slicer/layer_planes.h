// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The planes of a job's layers: the samples of its channels while a layer is worked on, and the pictures made of them.
//
// Halftoning reads channels of its own, as floats, that no picture shows.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "core/field/contone.h"
#include "core/job/slice_job.h"
#include "core/limit/limit_solid.h"
#include "core/output/arrange.h"
#include "core/output/encode.h"
#include "core/raster/occupancy.h"
#include "core/raster/region_runs.h"
#include "core/raster/voxel_runs.h"

namespace ccslice {

/// Some plane shows printable materials.
bool shows_materials(const SliceJob& job);

/// The planes of one channel each that the job's pictures are made of, in the order of the pictures.
std::vector<PlaneSpec> shown_channels(const SliceJob& job);

/// The planes that halftoning reads: the channels of the material map, in its order, as floats.
std::vector<PlaneSpec> mixed_channels(const SliceJob& job);

/// One thread. Memory is kept from layer to layer.
class LayerPlanes {
 public:
  /// REQUIRES: both outlive this.
  LayerPlanes(const SliceJob& job, const SolidSummary& solid);

  /// The planes of shown_channels(), then those of mixed_channels().
  std::span<ContonePlane> channels() { return contone_; }
  std::span<const ContonePlane> mixed() const { return std::span(contone_).subspan(shown_); }

  /// All samples as outside. Throws Error{kCancelled}.
  void clear(const LayerWindow& window, const CancellationToken& cancel);

  /// The job's pictures, in its order. `spans`: voxels inside, as rasterize() yields them; `materials`: the halftoned
  /// window, if the job shows materials; `regions`: find_regions() of the spans, if it shows cell regions. Throws
  /// Error{kCancelled}.
  std::vector<EncodedPlane> encode(std::span<const VoxelRun> spans, IndexImage materials,
                                   std::span<const RegionRun> regions, const Arrangement& arrangement,
                                   const CancellationToken& cancel);

 private:
  std::vector<std::string> channel_names(const PlaneSpec& plane) const;
  SampleImage arranged_samples(std::span<const ContonePlane> planes, const Arrangement& arrangement,
                               const CancellationToken& cancel);

  const SliceJob& job_;
  const std::vector<ChannelRange>& channels_;
  std::vector<ContonePlane> contone_;
  std::size_t shown_ = 0;
  std::vector<std::uint32_t> region_palette_;
  PlaneEncoder encoder_;
  // Scratch memory:
  std::vector<std::uint8_t> interleaved_, arranged_, indices_, region_numbers_, ordered_regions_;
  BitImage bits_;
};

}  // namespace ccslice
