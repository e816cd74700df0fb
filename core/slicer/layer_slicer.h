// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A layer from first to last: each part is painted (slicer/part_painter.h), and all are composed and encoded
// (slicer/layer_composer.h). A layer depends on the job and its absolute index only, so any split of a range over
// threads, calls or replicas gives the same bytes. A region is a crop of the whole, to the bit.

#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "core/base/cancellation.h"
#include "core/job/placed_part.h"
#include "core/job/slice_job.h"
#include "core/limit/limit_solid.h"
#include "core/slicer/part_painter.h"

namespace ccslice {

/// One thread's worker. From its first layer on it holds scratch memory of one layer, and of what paints a slab.
class LayerSlicer {
 public:
  /// `tiles_fit`: SlicerMemory::tiles_fit of the parts, or nothing. REQUIRES: PlacedParts. Throws Error{kCancelled}.
  explicit LayerSlicer(PlacedParts parts, const CancellationToken& cancel = {},
                       std::span<const std::optional<bool>> tiles_fit = {});
  /// The same, for a job of one part. REQUIRES: validate_job(*solid, job) passes.
  LayerSlicer(std::shared_ptr<const LimitSolid> solid, SliceJob job, const CancellationToken& cancel = {},
              std::span<const std::optional<bool>> tiles_fit = {});
  ~LayerSlicer();
  LayerSlicer(LayerSlicer&&) noexcept;
  LayerSlicer& operator=(LayerSlicer&&) noexcept;

  /// A worker on the same job for another thread: shares what never changes (the solid, the index of its faces by
  /// height). Safe to call while this one slices.
  LayerSlicer twin() const;

  /// REQUIRES: layer is one of the region. Throws Error{kCancelled} within about 10 ms of a cancel, kInternal,
  /// kFractionsOutOfRange.
  Layer slice(std::uint32_t layer, const CancellationToken& cancel);
  /// The parts of the layer that was sliced last, as if each were alone, but without their materials: of two that hold
  /// a voxel the earlier one here has it. Valid until another layer is sliced.
  std::span<const PaintedPart> painted() const;

 private:
  struct Shared;
  struct State;
  explicit LayerSlicer(std::shared_ptr<const Shared> shared);
  std::shared_ptr<const Shared> shared_;
  std::unique_ptr<State> state_;  // From the first layer on.
};

}  // namespace ccslice
