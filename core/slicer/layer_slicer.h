// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A layer from first to last: contours -> occupancy -> materials -> halftone -> encoded planes [Luu19, Fig. 1]. A layer
// depends on the job and its absolute index only, so any split of a range over threads, calls or replicas gives the
// same bytes. A region is a crop of the whole, to the bit; rows far from it are left out of the work.

#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/cancellation.h"
#include "core/contour/contour.h"
#include "core/limit/limit_solid.h"
#include "core/material/printing.h"
#include "core/output/arrange.h"
#include "core/output/plane.h"
#include "core/slicer/grid.h"
#include "core/slicer/region.h"

namespace ccslice {

/// Layers worked on together start at multiples of this absolute index.
inline constexpr std::uint32_t kSlabLayers = 16;

/// Nothing goes on from row to row past multiples of this absolute index, so that a region's rows can do without most
/// others.
inline constexpr std::uint32_t kRowsTogether = 64;

struct SliceJob {
  Placement placement = Placement::Identity();
  Grid grid;
  std::optional<VoxelRegion> region;  // What is delivered. DEFAULT: all of the grid.
  PictureOrder order;                 // Of the pictures. Indices, contours and counts stay those of the grid.
  std::vector<PlaneSpec> planes;
  std::optional<Printing> printing;  // REQUIRED by planes of materials.
  bool contours = false;             // Deliver the polylines too.
  double contour_tolerance_mm = 1e-3;
  std::optional<double> material_tolerance;  // Share of the plane's value range. 0: every voxel is inverted. DEFAULT:
                                             // 1/1024 for 8-bit planes and materials, 1/65536 for
                                             // others.
};

/// The job's region, or all of its grid.
VoxelRegion region_of(const SliceJob& job);

/// Of the region.
struct LayerStats {
  std::uint64_t voxels_inside = 0;
  std::uint64_t voxels_coherent = 0;      // Inverted from a neighbour's parameter.
  std::uint64_t voxels_full = 0;          // Inverted by the whole candidate search.
  std::uint64_t voxels_interpolated = 0;  // By polynomials, within the tolerance.
  std::uint64_t voxels_repainted = 0;     // Inverted because a voxel beside them was beyond its tolerance; also counted
                                          // as coherent, full or unresolved.
  std::uint64_t voxels_unresolved = 0;    // Inside the contours, not reached: took the nearest solved parameter.
  double max_residual_mm = 0;             // Over all inverted voxels, unresolved ones excluded, world mm. Includes
                                          // voxels that were inverted for those of the region.
  std::uint64_t contour_loops = 0;
  std::uint64_t contour_points = 0;
  std::uint64_t contour_leaves_unresolved = 0;
  std::vector<std::uint64_t> material_voxels;  // Of material 1, 2, ...; empty if no plane shows materials.
};

struct Layer {
  std::uint32_t index = 0;
  double z_mm = 0;
  LayerStats stats;
  std::vector<EncodedPlane> planes;  // In the order of SliceJob::planes.
  Contours contours;                 // Empty unless asked for. xy are world x and y. Of a region: all loops whose
                                     // bounding boxes meet it, as they are.
};

/// Checks a job against its solid and the limits. Throws what validate_placement(), validate_pitch() and
/// validate_extent(), validate_region() and validate_printing() throw, and Error{kNothingRequested, kTooManyPlanes,
/// kChannelUnknown, kValueRangeInvalid, kValueRangeUnexpected, kEnumValueUnknown, kEncodingUnsupported,
/// kToleranceInvalid, kLayerBytesTooLarge}. Fields are named as in a SliceRangeRequest.
void validate_job(const LimitSolid& solid, const SliceJob& job, const SliceLimits& limits = {});
void validate_job(const SolidSummary& summary, const SliceJob& job, const SliceLimits& limits = {});

/// One thread's worker. Holds scratch memory of one layer, and of what paints a slab of them.
class LayerSlicer {
 public:
  /// REQUIRES: validate_job(*solid, job) passes. Throws Error{kCancelled}.
  LayerSlicer(std::shared_ptr<const LimitSolid> solid, SliceJob job, const CancellationToken& cancel = {});
  ~LayerSlicer();
  LayerSlicer(LayerSlicer&&) noexcept;
  LayerSlicer& operator=(LayerSlicer&&) noexcept;

  /// A worker on the same job for another thread: shares what never changes (the solid, the index of its faces by
  /// height). Safe to call while this one slices.
  LayerSlicer twin() const;

  /// REQUIRES: layer is one of the region. Throws Error{kCancelled} within about 10 ms of a cancel, kInternal,
  /// kFractionsOutOfRange.
  Layer slice(std::uint32_t layer, const CancellationToken& cancel);

 private:
  struct Shared;
  struct State;
  explicit LayerSlicer(std::shared_ptr<const Shared> shared);
  std::unique_ptr<State> state_;
};

/// Layers [first, first + count) as (first, count) of slabs, cut at multiples of kSlabLayers.
/// REQUIRES: first + count fits 32 bits.
std::vector<std::pair<std::uint32_t, std::uint32_t>> slabs_of_range(std::uint32_t first, std::uint32_t count);

}  // namespace ccslice
