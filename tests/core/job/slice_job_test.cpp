// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/job/slice_job.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <utility>
#include <vector>

namespace ccslice {
namespace {

TEST(SlabsOfRange, StartAtMultiplesOfTheSlabHeight) {
  using Slabs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;
  EXPECT_EQ(slabs_of_range(0, 0), Slabs{});
  EXPECT_EQ(slabs_of_range(0, 16), (Slabs{{0, 16}}));
  EXPECT_EQ(slabs_of_range(0, 17), (Slabs{{0, 16}, {16, 1}}));
  EXPECT_EQ(slabs_of_range(5, 2), (Slabs{{5, 2}}));
  EXPECT_EQ(slabs_of_range(5, 40), (Slabs{{5, 11}, {16, 16}, {32, 13}}));
}

TEST(RegionOf, IsTheWholeGridUnlessTheJobHasOne) {
  SliceJob job;
  job.grid.extent = {30, 20, 10};
  EXPECT_EQ(region_of(job).window(), (LayerWindow{0, 0, 30, 20}));
  EXPECT_EQ(region_of(job).end_layer(), 10u);
  job.region = VoxelRegion{3, 2, 1, {5, 6, 7}};
  EXPECT_EQ(region_of(job).window(), (LayerWindow{3, 2, 5, 6}));
  EXPECT_EQ(region_of(job).first_layer, 1u);
  EXPECT_EQ(region_of(job).end_layer(), 8u);
}

}  // namespace
}  // namespace ccslice
