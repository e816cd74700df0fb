// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/job/validate_placement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "tests/core/mesh/expect_error.h"

namespace ccslice {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Placement scaling(double x, double y, double z) {
  Placement placement = Placement::Identity();
  placement.scale(Vec3(x, y, z));
  return placement;
}

Placement translation(double x, double y, double z) {
  Placement placement = Placement::Identity();
  placement.translation() = Vec3(x, y, z);
  return placement;
}

TEST(ValidatePlacement, TakesRotationsScalesShearsAndMirrors) {
  EXPECT_NO_THROW(validate_placement(Placement::Identity()));
  Placement placement = Placement::Identity();
  placement.rotate(Eigen::AngleAxisd(1, Vec3(1, 2, 3).normalized()));
  placement.scale(Vec3(1, -25.4, 0.001));
  placement.translation() = Vec3(1e4, 0, -5);
  EXPECT_NO_THROW(validate_placement(placement));
  EXPECT_NO_THROW(validate_placement(scaling(1e-5, 1e-5, 1e-5)));
  EXPECT_NO_THROW(validate_placement(scaling(9e5, 9e5, 9e5)));
  EXPECT_NO_THROW(validate_placement(translation(1e7, -1e7, 0)));
}

TEST(ValidatePlacement, RefusesSingularOnes) {
  expect_error([] { validate_placement(scaling(1, 1, 0)); }, ErrorCode::kPlacementSingular,
               "placement.matrix: singular (smallest scale 0, largest 1)");
  expect_error([] { validate_placement(scaling(0, 0, 0)); }, ErrorCode::kPlacementSingular, "singular");
  expect_error([] { validate_placement(scaling(1e5, 1, 1e-5)); }, ErrorCode::kPlacementSingular, "singular");
}

TEST(ValidatePlacement, RefusesNonFiniteOnesNamingTheEntry) {
  for (const double bad : {kNan, kInfinity, -kInfinity}) {
    Placement placement = Placement::Identity();
    placement.linear()(1, 2) = bad;
    expect_error([&] { validate_placement(placement); }, ErrorCode::kPlacementNonFinite, "placement.matrix[6]");
    expect_error([&] { validate_placement(translation(bad, 0, 0)); }, ErrorCode::kPlacementNonFinite,
                 "placement.matrix[3]");
  }
}

TEST(ValidatePlacement, RefusesScalesAndTranslationsBeyondTheBounds) {
  for (const double scale : {1e-200, 5e-324, 1e-7, 2e6, 1e200, 1e300, 1e308}) {
    expect_error([&] { validate_placement(scaling(scale, scale, scale)); }, ErrorCode::kPlacementOutOfRange,
                 "scales run from 1e-06 to 1000000");
  }
  expect_error([] { validate_placement(translation(0, 1e308, 0)); }, ErrorCode::kPlacementOutOfRange,
               "placement.matrix[7]: a translation of 1e+308 mm");
  expect_error([] { validate_placement(translation(0, 0, -1.0000000000001e7)); }, ErrorCode::kPlacementOutOfRange,
               "-10000000.000001 mm, the limit is 10000000 mm");
}

TEST(ValidatePlacement, RefusesPartsThatItPutsTooFar) {
  const Box3 box(Vec3::Constant(-1000), Vec3::Constant(1000));
  EXPECT_NO_THROW(validate_placement(scaling(1000, 1000, 1000), box));
  expect_error([&] { validate_placement(scaling(1e5, 1e5, 1e5), box); }, ErrorCode::kPlacementOutOfRange,
               "placement: puts the part 100000000 mm");
  expect_error([&] { validate_placement(translation(1e7, 0, 0), box); }, ErrorCode::kPlacementOutOfRange,
               "10001000 mm");
}

}  // namespace
}  // namespace ccslice
