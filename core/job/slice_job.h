// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What a client wants sliced, and the layers that come of it. The grid is cut into slabs of layers and blocks of rows
// at fixed absolute indices, so that a layer is the same whatever it is asked for with.

#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/types.h"
#include "core/channel/channel_source.h"
#include "core/contour/contour.h"
#include "core/contour/region_loops.h"
#include "core/job/grid.h"
#include "core/job/region.h"
#include "core/output/arrange.h"
#include "core/output/plane.h"
#include "core/printing/printing.h"

namespace ccslice {

/// Layers worked on together start at multiples of this absolute index.
inline constexpr std::uint32_t kSlabLayers = 16;

/// Nothing goes on from row to row past multiples of this absolute index, so that a region's rows can do without most
/// others.
inline constexpr std::uint32_t kRowsTogether = 64;

struct SliceJob {
  Placement placement = Placement::Identity();
  Grid grid;
  std::optional<VoxelBox> region;  // What is delivered. DEFAULT: all of the grid.
  PictureOrder order;              // For pictures only: indices, contours and counts stay those of the grid.
  ChannelSources sources;          // Of channels besides the solid's own.
  std::optional<std::string> cut;  // A channel: voxels inside where it is above 1/2 are background.
  std::vector<PlaneSpec> planes;
  std::optional<Printing> printing;      // REQUIRED by planes of materials.
  bool contours = false;                 // Deliver the polylines too.
  bool contours_by_cell_region = false;  // Instead of the solid's, those of each cell region by itself.
  double contour_tolerance_mm = 1e-3;
  std::optional<double> channel_tolerance;  // Share of the plane's value range. 0: every voxel is inverted. DEFAULT:
                                            // 1/1024 for 8-bit planes and materials, 1/65536 for
                                            // others.
  bool prove_channels = false;              // Interpolate only where the error is proved to be within that tolerance.
  bool refuses_overlaps = false;            // Of several parts: a voxel in more than one of them is an error.
  bool snap_copies =
      false;  // Copies whole voxels apart have the voxels and channel values of the first (job/copies.h).
};

/// The job's region, or all of its grid.
VoxelBox region_of(const SliceJob& job);

/// Some plane shows cell regions.
bool shows_cell_regions(const SliceJob& job);
/// Some material of the printing leaves voxels empty.
bool leaves_voxels_empty(const SliceJob& job);

/// The voxels that a part and its copies have, without those that other parts have.
struct PartVoxels {
  std::uint64_t voxels = 0;
  std::vector<std::uint64_t> material_voxels;  // As LayerStats::material_voxels.
};

/// Voxels that two placed parts hold.
struct PartOverlap {
  std::uint32_t owner = 0;    // The placed part that has them,
  std::uint32_t covered = 0;  // and the one that lacks them.
  std::uint64_t voxels = 0;
  Vec3 place_mm = Vec3::Zero();  // The centre of one of them.
};

/// The most pairs that a layer names.
inline constexpr std::size_t kMostOverlaps = 256;

/// Counts of the region's voxels. Where parts overlap, those of channels and maps count a voxel once for each part.
struct LayerStats {
  std::uint64_t voxels_inside = 0;        // Without those that are left empty (PrintMaterial).
  std::uint64_t voxels_cut = 0;           // Of the solid, that SliceJob::cut leaves out.
  std::uint64_t voxels_covered = 0;       // Of parts, that belong to another part: once for each.
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
  std::uint64_t voxels_off_map = 0;            // Values that their material map doesn't cover: it clamped them.
  std::uint64_t voxels_scaled_up = 0;          // Direct fractions of less than 1 in all, and none takes the rest.
  double least_fraction_sum = 0;               // Of these voxels; 0 if there are none.
  std::vector<std::uint64_t> material_voxels;  // Voxels of material 1, 2, ...; empty if none are chosen.
  std::vector<PartVoxels> parts;               // Of several placed parts: by part, copies together.
  std::vector<PartOverlap> overlaps;           // As they are met, kMostOverlaps at most.
};

struct Layer {
  std::uint32_t index = 0;
  double z_mm = 0;
  LayerStats stats;
  std::vector<EncodedPlane> planes;      // In the order of SliceJob::planes.
  Contours contours;                     // Empty unless asked for. xy are world x and y. Of a region: all loops whose
                                         // bounding boxes meet it, as they are.
  std::vector<RegionLoop> region_loops;  // Likewise, of cell regions.
};

/// Throws Error{kLayerRangeEmpty, kLayerRangeOutOfBounds} unless [first, first + count) holds layers of the job's
/// region only.
void validate_layer_range(const SliceJob& job, std::uint32_t first, std::uint32_t count);

/// Layers [first, first + count) as (first, count) of slabs, cut at multiples of kSlabLayers.
/// REQUIRES: first + count fits 32 bits.
std::vector<std::pair<std::uint32_t, std::uint32_t>> slabs_of_range(std::uint32_t first, std::uint32_t count);

}  // namespace ccslice
