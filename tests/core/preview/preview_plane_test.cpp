// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/preview/preview_plane.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/base/error.h"

namespace ccslice {
namespace {

PreviewPlane oblique_plane() {
  PreviewPlane plane;
  plane.middle_mm = Vec3(3, -2, 5);
  plane.across = Vec3(2, 1, 2) / 3;
  plane.up = Vec3(-2, 2, 1) / 3;
  plane.across_mm = 0.2;
  plane.up_mm = 0.3;
  plane.columns = 60;
  plane.rows = 41;
  return plane;
}

/// The world's place of a pixel's middle, by the plane's own words.
Vec3 pixel_place(const PreviewPlane& plane, double column, double row_from_bottom) {
  return plane.middle_mm + (column + 0.5 - 0.5 * plane.columns) * plane.across_mm * plane.across +
         (row_from_bottom + 0.5 - 0.5 * plane.rows) * plane.up_mm * plane.up;
}

void expect_refusal(const PreviewPlane& plane, ErrorCode code, const char* field) {
  try {
    validate_plane(plane);
    ADD_FAILURE() << "taken: " << field;
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code) << field;
    EXPECT_THAT(error.what(), testing::HasSubstr(field));
    EXPECT_EQ(error.field(), field);
  }
}

TEST(PreviewPlane, IsALayerOfThePartLaidUnderIt) {
  const PreviewPlane plane = oblique_plane();
  validate_plane(plane);
  const Grid grid = grid_of(plane);
  EXPECT_EQ(grid.extent.layers, 1u);
  const LayerLattice lattice = grid.lattice();
  const Placement back(frame_of(plane));
  for (const auto& [column, row] : {std::pair{0u, 0u}, {59u, 0u}, {0u, 40u}, {17u, 23u}}) {
    const Vec3 world = back * lattice.centre(column, row, grid.layer_z_mm(0));
    EXPECT_LT((world - pixel_place(plane, column, row)).norm(), 1e-12);
  }
  // What the placement takes to a pixel's place, the laid one takes to the voxel's.
  Placement placement = Placement::Identity();
  placement.translate(Vec3(1, 2, 3)).rotate(Eigen::AngleAxisd(0.4, Vec3::UnitY())).scale(1.5);
  const Vec3 mesh = placement.inverse(Eigen::Affine) * pixel_place(plane, 11, 7);
  EXPECT_LT((under_plane(plane, placement) * mesh - lattice.centre(11, 7, grid.layer_z_mm(0))).norm(), 1e-12);
}

TEST(PreviewPlane, FrameIsARotationForSlightlyCrookedAxes) {
  PreviewPlane plane = oblique_plane();
  plane.up += 9e-7 * plane.across;
  plane.across *= 1 + 9e-7;
  validate_plane(plane);
  const Mat3 frame = frame_of(plane);
  EXPECT_LT((frame.transpose() * frame - Mat3::Identity()).norm(), 1e-14);
  EXPECT_NEAR(frame.determinant(), 1, 1e-14);
}

TEST(PreviewPlane, CoarserPixelsCoverTheSamePictureFromItsUpperLeftCorner) {
  const PreviewPlane plane = oblique_plane(), coarse = coarser(plane, 8);
  EXPECT_EQ(coarse.columns, 8u);
  EXPECT_EQ(coarse.rows, 6u);
  EXPECT_DOUBLE_EQ(coarse.across_mm, 1.6);
  const Vec3 corner = pixel_place(plane, -0.5, plane.rows - 0.5);
  EXPECT_LT((pixel_place(coarse, -0.5, coarse.rows - 0.5) - corner).norm(), 1e-12);
}

TEST(PreviewPlane, RefusesWhatIsNone) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto changed = [](auto&& change) {
    PreviewPlane plane = oblique_plane();
    change(plane);
    return plane;
  };
  expect_refusal(changed([](auto& p) { p.columns = 0; }), ErrorCode::kPictureTooLarge, "width");
  expect_refusal(changed([](auto& p) { p.rows = 1'000'000; }), ErrorCode::kPictureTooLarge, "height");
  expect_refusal(changed([&](auto& p) { p.middle_mm.y() = nan; }), ErrorCode::kPlaneInvalid, "plane.free.middle_mm");
  expect_refusal(changed([](auto& p) { p.middle_mm.x() = 1e9; }), ErrorCode::kPlaneInvalid, "plane.free.middle_mm");
  expect_refusal(changed([](auto& p) { p.across *= 1e-300; }), ErrorCode::kPlaneInvalid, "plane.free.across");
  expect_refusal(changed([&](auto& p) { p.across.z() = nan; }), ErrorCode::kPlaneInvalid, "plane.free.across");
  expect_refusal(changed([](auto& p) { p.up *= 2; }), ErrorCode::kPlaneInvalid, "plane.free.up");
  expect_refusal(changed([](auto& p) { p.up = p.across; }), ErrorCode::kPlaneInvalid, "plane.free.up");
  EXPECT_THROW(validate_plane(changed([](auto& p) { p.up_mm = -1; })), Error);
  EXPECT_THROW(validate_plane(changed([&](auto& p) { p.across_mm = nan; })), Error);
}

}  // namespace
}  // namespace ccslice
