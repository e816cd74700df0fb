// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/job/slice_job.h"

#include <algorithm>
#include <string>

#include "core/base/error.h"

namespace ccslice {

VoxelBox region_of(const SliceJob& job) { return job.region.value_or(whole_region(job.grid)); }

bool shows_cell_regions(const SliceJob& job) {
  return std::ranges::any_of(job.planes,
                             [](const PlaneSpec& plane) { return plane.content == PlaneContent::kCellRegions; });
}

bool leaves_voxels_empty(const SliceJob& job) { return job.printing && leaves_voxels_empty(*job.printing); }

void validate_layer_range(const SliceJob& job, std::uint32_t first, std::uint32_t count) {
  if (count == 0) throw Error(ErrorCode::kLayerRangeEmpty, "layer_count: 0; ask for at least one layer", "layer_count");
  const VoxelBox region = region_of(job);
  const bool starts_within = first >= region.first_layer && first < region.end_layer();
  if (starts_within && std::uint64_t{first} + count <= region.end_layer()) return;
  throw Error(ErrorCode::kLayerRangeOutOfBounds,
              "first_layer, layer_count: layers " + std::to_string(first) + " to " +
                  std::to_string(std::uint64_t{first} + count - 1) + " are beyond the " +
                  (job.region ? "region's, " : "grid's, ") + std::to_string(region.first_layer) + " to " +
                  std::to_string(region.end_layer() - 1),
              starts_within ? "layer_count" : "first_layer");
}

std::vector<std::pair<std::uint32_t, std::uint32_t>> slabs_of_range(std::uint32_t first, std::uint32_t count) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> slabs;
  while (count > 0) {
    const std::uint32_t size = std::min(count, kSlabLayers - first % kSlabLayers);
    slabs.emplace_back(first, size);
    first += size;
    count -= size;
  }
  return slabs;
}

}  // namespace ccslice
