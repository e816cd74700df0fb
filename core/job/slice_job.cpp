// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/job/slice_job.h"

#include <algorithm>

namespace ccslice {

VoxelRegion region_of(const SliceJob& job) { return job.region.value_or(whole_region(job.grid)); }

bool shows_cell_regions(const SliceJob& job) {
  return std::ranges::any_of(job.planes,
                             [](const PlaneSpec& plane) { return plane.content == PlaneContent::kCellRegions; });
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
