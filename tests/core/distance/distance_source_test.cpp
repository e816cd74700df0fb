// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/distance/distance_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "tests/core/distance/random_triangles.h"
#include "tests/support/cell_regions.h"

namespace ccslice {
namespace {

using testing::HasSubstr;

constexpr double kReachMm = 3;

std::shared_ptr<const LimitSolid> prepared(const ControlMesh& mesh) { return prepare_solid(mesh); }

DistanceSource source_of(const std::shared_ptr<const LimitSolid>& solid, const Mat3& placed = Mat3::Identity(),
                         SurfaceKind surface = SurfaceKind::kBoundary, double reach_mm = kReachMm) {
  return {{"depth", 0, reach_mm}, solid, placed, surface, reach_mm};
}

float value_at(const DistanceSource& source, const Vec3& mesh) {
  const SourceRow row{Vec3::Zero(), Vec3::Zero(), mesh, Vec3::Zero(), 0, 1};
  float value = -1;
  source.sample_row(row, {}, {&value, 1});
  return value;
}

double depth_in_box(const Vec3& point, const Vec3& size) {
  return std::min({point.minCoeff(), (size - point).minCoeff(), kReachMm});
}

TEST(DistanceSource, IsTheDepthInABoxHoweverItIsPlaced) {
  const auto solid = prepared(find_sample_model("box")->make());
  const Vec3 size = solid->summary().bounding_box.sizes();
  ASSERT_LT(solid->summary().bounding_box.min().norm(), 1e-9);
  Mat3 longer = Mat3::Identity();
  longer(0, 0) = 1.5;
  const Mat3 turned = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  std::mt19937 random(4);
  const DistanceSource as_it_is = source_of(solid), twice = source_of(solid, 2 * Mat3::Identity()),
                       stretched = source_of(solid, longer), tipped = source_of(solid, turned);
  for (int k = 0; k < 300; ++k) {
    const Vec3 point = random_point(random, 0, 1).cwiseProduct(size);
    EXPECT_NEAR(value_at(as_it_is, point), depth_in_box(point, size), 1e-5);
    EXPECT_NEAR(value_at(twice, point), depth_in_box(2 * point, 2 * size), 2e-5);
    EXPECT_NEAR(value_at(stretched, point), depth_in_box(longer * point, longer * size), 2e-5);
    EXPECT_NEAR(value_at(tipped, point), depth_in_box(point, size), 2e-5);
  }
}

/// The ring's boundary is smooth, and the triangles are within 2 um of it.
TEST(DistanceSource, IsWithinItsTolerancesOfASmoothSurface) {
  const auto solid = prepared(find_sample_model("ring")->make());
  const DistanceSource fine = source_of(solid, Mat3::Identity(), SurfaceKind::kBoundary, 0.2),
                       coarse = source_of(solid, Mat3::Identity(), SurfaceKind::kBoundary, 0.5);
  const Box3 box = solid->summary().bounding_box;
  std::mt19937 random(5);
  std::size_t near = 0;
  for (int k = 0; k < 4000; ++k) {
    const Vec3 point = box.min() + random_point(random, 0, 1).cwiseProduct(box.sizes());
    const double a = value_at(fine, point), b = value_at(coarse, point);
    if (a >= 0.2) continue;
    ++near;
    EXPECT_NEAR(a, b, 0.002 + 0.005);
  }
  EXPECT_GT(near, 100u);
}

TEST(DistanceSource, KeepsToItsRangeAndToBounds) {
  const auto solid = prepared(find_sample_model("box")->make());
  const DistanceSource narrow({"depth", 0.5, 1}, solid, Mat3::Identity(), SurfaceKind::kBoundary, kReachMm);
  EXPECT_EQ(narrow.range().name, "depth");
  EXPECT_FLOAT_EQ(value_at(narrow, Vec3(5, 5, 0.2)), 0.5);
  EXPECT_FLOAT_EQ(value_at(narrow, Vec3(5, 5, 0.7)), 0.7f);
  EXPECT_FLOAT_EQ(value_at(narrow, Vec3(5, 5, 2)), 1);
  const DistanceSource depth = source_of(solid);
  const std::vector<float> bounds = {0.5f};
  SourceRow row{Vec3::Zero(), Vec3::Zero(), Vec3(0.01, 8, 4), Vec3(0.02, 0, 0), 10, 900};
  row.bounds = bounds;
  std::vector<float> values(row.count);
  depth.sample_row(row, {}, values);
  for (std::uint32_t k = 0; k < row.count; ++k) {
    const double x = row.mesh(k).x();
    EXPECT_EQ(values[k] < 0.5f, x < 0.5) << x;
  }
}

TEST(DistanceSource, ExpectsSomeMemory) {
  for (const char* name : {"box", "ring", "bracket"}) {
    const auto solid = prepared(find_sample_model(name)->make());
    const DistanceSource source = source_of(solid, Mat3::Identity(), SurfaceKind::kBoundary, 0.5);
    EXPECT_GT(source.memory_bytes(), 1000) << name;
    EXPECT_LT(source.memory_bytes(), 300e6) << name;
  }
}

TEST(DistanceSource, IsFromWhereCellRegionsMeetToo) {
  const ControlMesh box = find_sample_model("box")->make();
  const auto solid = prepared(oracle::with_regions(box, 2, [](const Vec3& middle) { return middle.x() > 12 ? 1 : 0; }));
  const DistanceSource source = source_of(solid, Mat3::Identity(), SurfaceKind::kInterfaces, 0.75);
  const Vec3 middle = solid->summary().bounding_box.center();
  EXPECT_NEAR(value_at(source, middle), 0, 1e-6);
  EXPECT_NEAR(value_at(source, middle + Vec3(0.25, 0, 0)), 0.25, 1e-4);
  EXPECT_NEAR(value_at(source, middle - Vec3(0.5, 0, 0)), 0.5, 1e-4);
}

TEST(DistanceSource, NeedsASurface) {
  const auto solid = prepared(find_sample_model("box")->make());
  try {
    source_of(solid, Mat3::Identity(), SurfaceKind::kInterfaces);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kFieldInvalid);
    EXPECT_THAT(error.what(), HasSubstr("no cell regions that meet"));
  }
}

}  // namespace
}  // namespace ccslice
