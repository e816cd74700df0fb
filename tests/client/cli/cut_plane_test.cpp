// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/options/cut_plane.h"

#include <gtest/gtest.h>

#include <cmath>

#include "client/cli/base/text_values.h"

namespace ccslice::cli {
namespace {

v1::Box3 box(const Vec3& low, const Vec3& high) {
  v1::Box3 result;
  result.mutable_min_mm()->set_x(low.x());
  result.mutable_min_mm()->set_y(low.y());
  result.mutable_min_mm()->set_z(low.z());
  result.mutable_max_mm()->set_x(high.x());
  result.mutable_max_mm()->set_y(high.y());
  result.mutable_max_mm()->set_z(high.z());
  return result;
}

Vec3 of(const v1::Vector3& v) { return {v.x(), v.y(), v.z()}; }

TEST(CutPlane, AxesHaveTheViewsThatDrawingsHave) {
  const CutPlane z = parse_cut_plane("z=12.5");
  EXPECT_EQ(z.across, Vec3::UnitX());
  EXPECT_EQ(z.up, Vec3::UnitY());
  EXPECT_DOUBLE_EQ(height_of(z), 12.5);
  const CutPlane x = parse_cut_plane("x=-3");
  EXPECT_EQ(x.across, Vec3::UnitY());
  EXPECT_EQ(x.up, Vec3::UnitZ());
  const CutPlane y = parse_cut_plane("y=4");
  EXPECT_EQ(y.across, Vec3::UnitX());
  EXPECT_EQ(y.up, Vec3::UnitZ());
  EXPECT_EQ(y.point.y(), 4);
}

TEST(CutPlane, TakesAPointAndANormalOfAnyLength) {
  const CutPlane plane = parse_cut_plane("1,2,3:0,3e200,4e200");
  EXPECT_LT((plane.normal - Vec3(0, 0.6, 0.8)).norm(), 1e-15);
  EXPECT_NEAR(plane.up.dot(plane.normal), 0, 1e-15);
  EXPECT_LT((plane.across.cross(plane.up) - plane.normal).norm(), 1e-15);
  EXPECT_GT(plane.up.z(), 0);
}

TEST(CutPlane, RefusesWhatIsNone) {
  for (const char* text : {"", "z", "z=", "w=3", "z=nan", "1,2,3", "1,2,3:0,0,0", "1,2:0,0,1", "1,2,3:0,0,1:4"}) {
    EXPECT_THROW(parse_cut_plane(text), UsageError) << text;
  }
}

TEST(CutPlane, AFrameHoldsTheBox) {
  const v1::Box3 part = box(Vec3(-1, 2, 3), Vec3(5, 4, 13));
  for (const char* text : {"z=5", "x=1", "y=3", "0,0,8:1,2,-3"}) {
    const CutPlane plane = parse_cut_plane(text);
    const FramedCut framed = frame_cut(plane, part, 100);
    EXPECT_EQ(std::max(framed.width, framed.height), 100u) << text;
    const Vec3 middle = of(framed.plane.middle_mm());
    EXPECT_NEAR(middle.dot(plane.normal), height_of(plane), 1e-12) << text;
    const double pixel = framed.plane.across_mm_per_pixel();
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3 at(corner & 1 ? 5 : -1, corner & 2 ? 4 : 2, corner & 4 ? 13 : 3);
      EXPECT_LE(std::abs((at - middle).dot(plane.across)), 0.5 * framed.width * pixel) << text;
      EXPECT_LE(std::abs((at - middle).dot(plane.up)), 0.5 * framed.height * pixel) << text;
    }
  }
}

TEST(CutPlane, MovesAlongItsNormal) {
  const v1::Box3 part = box(Vec3(0, 0, 10), Vec3(1, 1, 20));
  EXPECT_DOUBLE_EQ(height_of(moved_to(parse_cut_plane("z=0"), part, 0.25)), 12.5);
  const CutPlane moved = moved_to(parse_cut_plane("y=7"), part, 0.25);
  EXPECT_DOUBLE_EQ(moved.point.y(), 0.75) << "along -y, as it is seen";
}

}  // namespace
}  // namespace ccslice::cli
