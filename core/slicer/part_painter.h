// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// One part in the layers of a job, as if it were alone: contours -> occupancy -> channels -> halftone [Luu19, Fig. 1].
// The samples depend on the part, its job and the layer's absolute index only. Rows far from a region are left out of
// the work.

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/contour/contour.h"
#include "core/contour/region_loops.h"
#include "core/field/contone.h"
#include "core/job/copies.h"
#include "core/job/placed_part.h"
#include "core/job/slice_job.h"
#include "core/output/plane.h"
#include "core/printing/halftone.h"
#include "core/raster/layer_window.h"
#include "core/raster/region_runs.h"
#include "core/raster/voxel_runs.h"

namespace ccslice {

/// The contours of a part in a layer, and what is inside them.
struct PartShape {
  Contours contours;  // Only if the job delivers them.
  std::vector<VoxelRun> spans;
  std::vector<RegionRun> regions;        // Only if the job needs them.
  std::vector<RegionLoop> region_loops;  // Only if the job delivers them.
  LayerStats stats;                      // Of the contours.
};

/// A part in a layer. Valid until its painter finds another layer, but materials only until the next part of it.
struct PaintedPart {
  const PartShape* shape = nullptr;
  LayerWindow window;                    // What the planes and materials hold: all voxels inside of the job's region.
  std::span<const ContonePlane> planes;  // shown_channels() of the job.
  // Only if the job shows materials:
  IndexImage materials;
  const HalftonePlan* halftone = nullptr;  // What they are made by,
  std::span<const ContonePlane> mixed;     // and what of: mixed_channels() of the job.
  LayerStats stats;
};

/// One thread's worker on a group of copies. Holds scratch memory of one layer, and of what paints a slab of them.
class PartPainter {
 public:
  /// What all workers on a group read.
  struct Shared;

  /// `groups`: of the job, which share room for what they keep. `tiles_fit`: do_tiles_fit() of the job, if that is
  /// known; else it is found out. `before`: of a group before, if this one has copies of the same part. REQUIRES:
  /// validate_job(*part.solid, part.job) passes for each part of the group. Throws Error{kCancelled}.
  static std::shared_ptr<const Shared> share(const PlacedParts& parts, const CopyGroup& group, std::size_t groups,
                                             const CancellationToken& cancel, std::optional<bool> tiles_fit,
                                             const Shared* before);

  explicit PartPainter(std::shared_ptr<const Shared> shared);
  ~PartPainter();
  PartPainter(PartPainter&&) noexcept;
  PartPainter& operator=(PartPainter&&) noexcept;

  /// Finds the contours of a layer. REQUIRES: layer is one of the job's region. Throws Error{kCancelled} within about
  /// 10 ms of a cancel, kInternal.
  void find(std::uint32_t layer, const CancellationToken& cancel);
  /// The window of a copy. REQUIRES: find().
  LayerWindow window(const VoxelShift& shift) const;
  /// The copy has voxels in the layer, and none of them is in the job's region or beside it. REQUIRES: find().
  bool is_outside(const VoxelShift& shift) const;
  /// Evaluates the channels of the layer that was found. Throws as find().
  void paint(const CancellationToken& cancel);
  /// A copy of what is painted, with materials of its own. REQUIRES: paint(). Throws Error{kCancelled},
  /// kFractionsOutOfRange.
  PaintedPart copy(const VoxelShift& shift, const CancellationToken& cancel);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace ccslice
