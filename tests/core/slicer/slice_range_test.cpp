// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

// What is delivered, and in which order: same_bytes_test.cpp.

#include "core/slicer/slice_range.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include "core/base/error.h"

namespace ccslice {
namespace {

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
  job.region = VoxelRegion{0, 0, 4, {1, 1, 3}};
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
