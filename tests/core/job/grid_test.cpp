// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/job/grid.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <string>

#include "core/base/error.h"

namespace ccslice {
namespace {

using testing::HasSubstr;

constexpr double kEndless = std::numeric_limits<double>::infinity();
constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

Box3 box(double x, double y, double z) { return Box3(Vec3::Zero(), Vec3(x, y, z)); }

GridRequest request(double dx, double dy, double dz) {
  GridRequest result;
  result.pitch = {dx, dy, dz};
  return result;
}

Error error_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "nothing thrown";
  return Error(ErrorCode::kInternal, "nothing thrown");
}

TEST(PlanGrid, GivesTheRingOfTable2ItsBitmaps) {
  const Grid grid = plan_grid(box(83.53, 83.53, 17.28), request(0.0423, 0.0846, 0.03));
  EXPECT_EQ(grid.extent.columns, 1975u);
  EXPECT_EQ(grid.extent.rows, 987u);
  EXPECT_EQ(grid.extent.layers, 576u);
}

TEST(PlanGrid, CountsTheCentresInsideTheBox) {
  EXPECT_EQ(plan_grid(box(1, 1, 1), request(0.5, 0.25, 1)).extent.columns, 2u);
  EXPECT_EQ(plan_grid(box(1, 1, 1), request(0.4, 1, 1)).extent.columns, 3u);    // 0.2, 0.6, 1.0: on the face.
  EXPECT_EQ(plan_grid(box(1, 1, 1), request(0.401, 1, 1)).extent.columns, 2u);  // 0.2005, 0.6015.
  EXPECT_EQ(plan_grid(box(1, 1, 1), request(0.399, 1, 1)).extent.columns, 3u);
}

TEST(PlanGrid, LosesNoVoxelToRounding) {
  for (int n = 1; n <= 2000; ++n) {
    for (const double pitch : {0.1, 0.03, 0.0423, 0.014, 1.0 / 3}) {
      // The last centre lies on the upper face but for rounding, whichever way the box is computed.
      ASSERT_EQ(plan_grid(box((n - 0.5) * pitch, 1, 1), request(pitch, 1, 1)).extent.columns, static_cast<unsigned>(n));
      ASSERT_EQ(plan_grid(box(n * pitch - 0.5 * pitch, 1, 1), request(pitch, 1, 1)).extent.columns,
                static_cast<unsigned>(n));
      ASSERT_EQ(plan_grid(box(n * pitch, 1, 1), request(pitch, 1, 1)).extent.columns, static_cast<unsigned>(n));
    }
  }
}

TEST(PlanGrid, GivesAPartThinnerThanAVoxelOneVoxel) {
  const Grid grid = plan_grid(box(0.01, 0, 5), request(0.1, 0.1, 1));
  EXPECT_EQ(grid.extent.columns, 1u);
  EXPECT_EQ(grid.extent.rows, 1u);
  EXPECT_EQ(grid.extent.layers, 5u);
}

TEST(PlanGrid, IsAnchoredAtTheBoxUnlessTold) {
  const Box3 part(Vec3(-3, 2, 7), Vec3(1, 4, 9));
  GridRequest asked = request(1, 1, 0.5);
  EXPECT_EQ(plan_grid(part, asked).origin_mm, part.min());
  EXPECT_EQ(plan_grid(part, asked).layer_z_mm(0), 7.25);
  asked.origin_mm = Vec3(-4, 0, 0);
  const Grid grid = plan_grid(part, asked);
  EXPECT_EQ(grid.origin_mm, Vec3(-4, 0, 0));
  EXPECT_EQ(grid.extent.columns, 5u);
  EXPECT_EQ(grid.extent.rows, 4u);
  EXPECT_EQ(grid.extent.layers, 18u);
  EXPECT_TRUE(grid.part_box.isApprox(part));
}

TEST(PlanGrid, KeepsAnExplicitExtent) {
  GridRequest asked = request(1, 1, 1);
  asked.extent = GridExtent{5, 6, 7};
  const Grid grid = plan_grid(box(100, 100, 100), asked);
  EXPECT_EQ(grid.extent.columns, 5u);
  EXPECT_EQ(grid.extent.rows, 6u);
  EXPECT_EQ(grid.extent.layers, 7u);
}

TEST(PlanGrid, RefusesPitchesThatAreNoLengths) {
  for (const double bad : {0.0, -0.1, kEndless, -kEndless, kNoNumber}) {
    const Error error = error_of([&] { plan_grid(box(1, 1, 1), request(1, bad, 1)); });
    EXPECT_EQ(error.code(), ErrorCode::kPitchInvalid);
    EXPECT_EQ(error.field(), "grid.pitch.y_mm");
    EXPECT_THAT(error.what(), HasSubstr("600 dpi is 0.0423 mm"));
  }
  const Error zero = error_of([&] { plan_grid(box(1, 1, 1), request(0, 1, 1)); });
  EXPECT_STREQ(zero.what(), "grid.pitch.x_mm: 0 or missing; give a positive length, 600 dpi is 0.0423 mm");
}

TEST(PlanGrid, RefusesPitchesBeyondTheLimits) {
  const Error small = error_of([&] { plan_grid(box(1, 1, 1), request(1, 1, 1e-5)); });
  EXPECT_EQ(small.code(), ErrorCode::kPitchOutOfRange);
  EXPECT_STREQ(small.what(), "grid.pitch.z_mm: 1e-05 mm is below the smallest pitch, 0.0001 mm");
  const Error large = error_of([&] { plan_grid(box(1, 1, 1), request(2000, 1, 1)); });
  EXPECT_STREQ(large.what(), "grid.pitch.x_mm: 2000 mm is above the largest pitch, 1000 mm");
}

TEST(PlanGrid, RefusesGridsBeyondTheLimits) {
  const Error columns = error_of([&] { plan_grid(box(1000, 1, 1), request(0.01, 1, 1)); });
  EXPECT_EQ(columns.code(), ErrorCode::kGridTooLarge);
  EXPECT_EQ(columns.field(), "grid.extent.columns");
  EXPECT_STREQ(columns.what(),
               "grid.extent.columns: 100000 is more than the limit of 65536; use a grid.pitch.x_mm of at least "
               "0.01527, or give the extent");
  EXPECT_NO_THROW(plan_grid(box(1000, 1, 1), request(0.01527, 1, 1)));
  const Error layers = error_of([&] { plan_grid(box(1, 1, 1e6), request(1, 1, 1e-4)); });
  EXPECT_EQ(layers.code(), ErrorCode::kGridTooManyLayers);
  EXPECT_EQ(layers.field(), "grid.extent.layers");
  const Error voxels = error_of([&] { plan_grid(box(1000, 1000, 1), request(0.02, 0.02, 1)); });
  EXPECT_EQ(voxels.code(), ErrorCode::kGridLayerTooLarge);
  EXPECT_THAT(voxels.what(), HasSubstr("50000 x 50000 = 2500000000 voxels a layer"));
}

TEST(PlanGrid, RefusesExtentsOfNothing) {
  GridRequest asked = request(1, 1, 1);
  asked.extent = GridExtent{5, 0, 7};
  const Error error = error_of([&] { plan_grid(box(1, 1, 1), asked); });
  EXPECT_EQ(error.code(), ErrorCode::kGridExtentZero);
  EXPECT_EQ(error.field(), "grid.extent.rows");
  asked.extent = GridExtent{5, 4'000'000'000u, 7};
  EXPECT_EQ(error_of([&] { plan_grid(box(1, 1, 1), asked); }).code(), ErrorCode::kGridTooLarge);
}

TEST(PlanGrid, RefusesPlacesOutOfReach) {
  GridRequest asked = request(1, 1, 1);
  asked.origin_mm = Vec3(0, kNoNumber, 0);
  EXPECT_EQ(error_of([&] { plan_grid(box(1, 1, 1), asked); }).code(), ErrorCode::kGridOriginNonFinite);
  asked.origin_mm = Vec3(0, -1e12, 0);
  const Error far_grid = error_of([&] { plan_grid(box(1, 1, 1), asked); });
  EXPECT_EQ(far_grid.code(), ErrorCode::kGridOriginOutOfRange);
  EXPECT_EQ(far_grid.field(), "grid.origin_mm.y");
  const Box3 far_box(Vec3::Constant(1e200), Vec3::Constant(1e200));
  EXPECT_EQ(error_of([&] { plan_grid(far_box, request(1, 1, 1)); }).field(), "placement");
}

}  // namespace
}  // namespace ccslice
