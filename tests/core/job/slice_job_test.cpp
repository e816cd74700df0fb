// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/job/slice_job.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"

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
  job.region = VoxelBox{3, 2, 1, {5, 6, 7}};
  EXPECT_EQ(region_of(job).window(), (LayerWindow{3, 2, 5, 6}));
  EXPECT_EQ(region_of(job).first_layer, 1u);
  EXPECT_EQ(region_of(job).end_layer(), 8u);
}

TEST(ValidateLayerRange, KeepsWithinTheGrid) {
  SliceJob job;
  job.grid.extent = {1, 1, 10};
  const auto code = [&](std::uint32_t first, std::uint32_t count) {
    try {
      validate_layer_range(job, first, count);
    } catch (const Error& error) {
      return error.code();
    }
    return ErrorCode{0};
  };
  EXPECT_EQ(code(0, 10), ErrorCode{0});
  EXPECT_EQ(code(9, 1), ErrorCode{0});
  EXPECT_EQ(code(3, 0), ErrorCode::kLayerRangeEmpty);
  EXPECT_EQ(code(10, 1), ErrorCode::kLayerRangeOutOfBounds);
  EXPECT_EQ(code(5, 6), ErrorCode::kLayerRangeOutOfBounds);
  EXPECT_EQ(code(4'294'967'295u, 4'294'967'295u), ErrorCode::kLayerRangeOutOfBounds);
}

TEST(ValidateLayerRange, KeepsWithinTheRegion) {
  SliceJob job;
  job.grid.extent = {1, 1, 10};
  job.region = VoxelBox{0, 0, 4, {1, 1, 3}};
  const auto field = [&](std::uint32_t first, std::uint32_t count) -> std::string {
    try {
      validate_layer_range(job, first, count);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kLayerRangeOutOfBounds);
      EXPECT_NE(std::string(error.what()).find("the region's, 4 to 6"), std::string::npos) << error.what();
      return error.field();
    }
    return "";
  };
  EXPECT_EQ(field(4, 3), "");
  EXPECT_EQ(field(6, 1), "");
  EXPECT_EQ(field(0, 1), "first_layer");
  EXPECT_EQ(field(7, 1), "first_layer");
  EXPECT_EQ(field(5, 3), "layer_count");
}

}  // namespace
}  // namespace ccslice
