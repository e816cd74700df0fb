// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/inversion/thin_features.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/error.h"
#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"

namespace ccslice {
namespace {

ThinFeatures thin_features(const ControlMesh& mesh, const SmallestFeature& smallest,
                           const Placement& placement = Placement::Identity()) {
  return find_thin_features(*prepare_solid(mesh), placement, smallest);
}

/// A box with sharp edges, so its limit is the box itself.
ControlMesh plate(double x, double y, double z) { return make_box({Vec3(x, y, z), 4, 4, 1}); }

SmallestFeature of_mm(double mm) { return {.mm = mm, .voxels_mm = Vec3::Zero()}; }

TEST(ThinFeatures, AreFoundInAPlateThatIsThinner) {
  const ThinFeatures found = thin_features(plate(20, 10, 0.45), of_mm(0.5));
  ASSERT_FALSE(found.places.empty());
  EXPECT_GT(found.places.size(), found.samples / 2) << "nearly all of its two sides";
  for (const ThinPlace& place : found.places) {
    EXPECT_NEAR(place.thickness_mm, 0.45, 1e-3);
    EXPECT_EQ(place.least_mm, 0.5);
    EXPECT_NEAR(std::abs(place.position.z() - 0.225), 0.225, 1e-9) << "its narrow sides aren't thin";
    EXPECT_LT(place.control_cell, 16u);
  }
}

TEST(ThinFeatures, AreNoneInPartsThatAreThicker) {
  EXPECT_TRUE(thin_features(plate(20, 10, 0.5), of_mm(0.5)).places.empty()) << "as thick is not thinner";
  EXPECT_TRUE(thin_features(make_box(), of_mm(7.9)).places.empty());
  const ThinFeatures ring = thin_features(make_ring(), of_mm(10));
  EXPECT_TRUE(ring.places.empty());
  EXPECT_GT(ring.samples, 1000u);
}

TEST(ThinFeatures, OfARingAreThoseOfItsWall) {
  // Smooth across: its walls are (83.53 - 54.47) / 2 = 14.53 mm apart.
  const ThinFeatures found = thin_features(make_ring(), of_mm(14.8));
  ASSERT_FALSE(found.places.empty());
  for (const ThinPlace& place : found.places) {
    EXPECT_NEAR(place.thickness_mm, 14.53, 0.1);
    const double radius = place.position.head<2>().norm();
    EXPECT_GT(std::min(std::abs(radius - 41.765), std::abs(radius - 27.235)), -1e-9);
    EXPECT_LT(std::min(std::abs(radius - 41.765), std::abs(radius - 27.235)), 0.1);
  }
}

TEST(ThinFeatures, ArePlacedWithThePart) {
  Placement placement = Placement::Identity();
  placement.linear() = Eigen::Vector3d(-2, 2, 3).asDiagonal();
  placement.translation() = Vec3(100, 0, 50);
  const ThinFeatures found = thin_features(plate(20, 10, 0.3), of_mm(1), placement);
  ASSERT_FALSE(found.places.empty());
  EXPECT_NEAR(found.places.front().thickness_mm, 0.9, 2e-3);
  EXPECT_GE(found.places.front().position.z(), 50 - 1e-9);
  EXPECT_LE(found.places.front().position.x(), 100 + 1e-9);
  EXPECT_TRUE(thin_features(plate(20, 10, 0.3), of_mm(0.85), placement).places.empty());
}

TEST(ThinFeatures, CountVoxelsAlongTheNormal) {
  const SmallestFeature two_voxels{.mm = 0, .voxels_mm = Vec3(0.2, 0.4, 0.06)};
  EXPECT_TRUE(thin_features(plate(20, 10, 0.1), two_voxels).places.empty()) << "three layers";
  const ThinFeatures low = thin_features(plate(20, 10, 0.05), two_voxels);
  ASSERT_FALSE(low.places.empty());
  EXPECT_NEAR(low.places.front().least_mm, 0.06, 1e-12);
  const ThinFeatures upright = thin_features(make_box({Vec3(20, 0.3, 10), 4, 1, 4}), two_voxels);
  ASSERT_FALSE(upright.places.empty());
  EXPECT_NEAR(upright.places.front().least_mm, 0.4, 1e-12);
}

TEST(ThinFeatures, ArentTheFlanksOfABluntWedge) {
  // A box sheared into a prism with edges of 60 degrees, which is thick everywhere but beside them.
  Placement shear = Placement::Identity();
  shear.linear()(0, 2) = 1 / std::tan(std::numbers::pi / 3);
  EXPECT_TRUE(thin_features(make_box(), of_mm(1), shear).places.empty());
}

TEST(ThinFeatures, ArentLookedForWhereNothingIsTooThin) {
  EXPECT_EQ(thin_features(plate(20, 10, 1e-3), {}).samples, 0u);
}

TEST(ThinFeatures, StopWhenCancelled) {
  const CancellationToken cancel = CancellationToken::make();
  cancel.cancel();
  EXPECT_THROW(find_thin_features(*prepare_solid(make_box()), Placement::Identity(), of_mm(1), cancel), Error);
}

}  // namespace
}  // namespace ccslice
