// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/job/copies.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "tests/support/channel_functions.h"

namespace ccslice {
namespace {

using testing::ElementsAre;

constexpr VoxelPitch kPitch = {0.5, 0.25, 1};

/// A box of 4 x 2 x 2 mm with a corner at the origin, on a grid of 40 x 40 voxels, 20 x 10 mm.
class CopiesTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { solid_ = prepare_solid(make_box({Vec3(4, 2, 2), 1, 1, 1})); }
  static void TearDownTestSuite() { solid_.reset(); }

  static PlacedParts copies_at(const std::vector<Vec3>& places) {
    PlacedParts parts;
    for (const Vec3& place : places) {
      PlacedPart& part = parts.emplace_back();
      part.solid = solid_;
      part.is_copy = parts.size() > 1;
      part.job.placement = Placement(Eigen::Translation3d(place));
      part.job.grid.pitch = kPitch;
      part.job.grid.extent = {40, 40, 20};
      part.job.snap_copies = true;
    }
    return parts;
  }

  static Vec3 place_of(const PlacedPart& part) { return part.job.placement.translation(); }
  /// The parts of each group.
  static std::vector<std::vector<std::uint32_t>> grouped(const PlacedParts& parts) {
    std::vector<std::vector<std::uint32_t>> groups;
    for (const CopyGroup& group : copy_groups(parts)) {
      std::vector<std::uint32_t>& of_group = groups.emplace_back();
      for (const CopyGroup::Copy& copy : group.copies) of_group.push_back(copy.part);
    }
    return groups;
  }

  static std::shared_ptr<const LimitSolid> solid_;
};

std::shared_ptr<const LimitSolid> CopiesTest::solid_;

TEST_F(CopiesTest, AreMovedToWholeVoxelsFromTheFirst) {
  PlacedParts parts = copies_at({Vec3(0.1, 0.2, 0.3), Vec3(5.2, 3.3, 0.3), Vec3(0.1, 4.2, 2.8)});
  const SnappedCopies snapped = snap_copies(parts, kPitch);
  EXPECT_EQ(snapped.copies, 2u);
  EXPECT_TRUE(place_of(parts[0]).isApprox(Vec3(0.1, 0.2, 0.3)));
  EXPECT_TRUE(place_of(parts[1]).isApprox(Vec3(5.1, 3.2, 0.3)));
  EXPECT_TRUE(place_of(parts[2]).isApprox(Vec3(0.1, 4.2, 3.3)));
  EXPECT_TRUE(snapped.most_mm.isApprox(Vec3(0.1, 0.1, 0.5), 1e-9));
}

TEST_F(CopiesTest, AreMovedByHalfAVoxelAtMost) {
  std::vector<Vec3> places;
  for (int i = 0; i < 100; ++i) places.push_back(Vec3(0.037, 0.053, 0.071) * i);
  PlacedParts parts = copies_at(places);
  const SnappedCopies snapped = snap_copies(parts, kPitch);
  EXPECT_LE(snapped.most_mm.x(), 0.25);
  EXPECT_LE(snapped.most_mm.y(), 0.125);
  EXPECT_LE(snapped.most_mm.z(), 0.5);
  EXPECT_GT(snapped.most_mm.minCoeff(), 0.1);
}

TEST_F(CopiesTest, ThatAreInPlaceAreNotMoved) {
  PlacedParts parts = copies_at({Vec3(0.1, 0, 0), Vec3(0.1 + 7 * 0.5, 3 * 0.25, 0)});
  EXPECT_EQ(snap_copies(parts, kPitch).copies, 0u);
}

TEST_F(CopiesTest, FollowTheFirstThatLiesAsTheyDo) {
  PlacedParts parts = copies_at({Vec3(1, 1, 0), Vec3(9.1, 1, 0), Vec3(14.3, 1, 0), Vec3(9, 5.1, 0)});
  const Mat3 turn = Eigen::AngleAxisd(0.3, Vec3::UnitZ()).toRotationMatrix();
  parts[1].job.placement.linear() = turn;
  parts[2].job.placement.linear() = Eigen::AngleAxisd(0.3 + 1e-8, Vec3::UnitZ()).toRotationMatrix();
  (void)snap_copies(parts, kPitch);
  EXPECT_EQ(parts[1].job.placement.linear(), turn);
  EXPECT_EQ(parts[2].job.placement.linear(), turn) << "turned alike but for rounding";
  EXPECT_TRUE(place_of(parts[1]).isApprox(Vec3(9.1, 1, 0)));
  EXPECT_TRUE(place_of(parts[2]).isApprox(Vec3(14.1, 1, 0)));
  EXPECT_TRUE(place_of(parts[3]).isApprox(Vec3(9, 5, 0)));
  EXPECT_THAT(grouped(parts), ElementsAre(ElementsAre(0, 3), ElementsAre(1, 2)));
}

TEST_F(CopiesTest, KeepTurnsAndSizesThatShowHoweverSmallTheScale) {
  PlacedParts parts = copies_at({Vec3(0, 0, 0), Vec3(5, 0, 0), Vec3(10, 0, 0)});
  parts[0].job.placement.linear() *= 1e-3;
  parts[1].job.placement.linear() *= 1.2e-3;
  parts[2].job.placement.linear() *= 1e-3 * (1 + 1e-9);
  (void)snap_copies(parts, kPitch);
  EXPECT_DOUBLE_EQ(parts[1].job.placement.linear()(0, 0), 1.2e-3);
  EXPECT_EQ(parts[2].job.placement.linear(), parts[0].job.placement.linear());
}

TEST_F(CopiesTest, OfOtherPartsAreOnTheirOwn) {
  PlacedParts parts = copies_at({Vec3(0, 0, 0), Vec3(5.2, 0, 0), Vec3(5.2, 3, 0), Vec3(10.3, 3, 0)});
  parts[2].is_copy = false;
  EXPECT_EQ(snap_copies(parts, kPitch).copies, 2u);
  EXPECT_TRUE(place_of(parts[3]).isApprox(Vec3(10.2, 3, 0)));
  EXPECT_THAT(grouped(parts), ElementsAre(ElementsAre(0, 1), ElementsAre(2, 3)));
}

TEST_F(CopiesTest, ShareAGroupInTheSameLayersAlone) {
  const PlacedParts parts = copies_at({Vec3(0, 0, 0), Vec3(5, 0, 3), Vec3(10, 0, 0), Vec3(5, 5, 3)});
  EXPECT_THAT(grouped(parts), ElementsAre(ElementsAre(0, 2), ElementsAre(1, 3)));
  const std::vector<CopyGroup> groups = copy_groups(parts);
  EXPECT_EQ(groups[0].copies[1].shift.columns, 20);
  EXPECT_EQ(groups[1].copies[1].shift.columns, 0);
  EXPECT_EQ(groups[1].copies[1].shift.rows, 20);
}

TEST_F(CopiesTest, ThatTheGridCutsOffAreOnTheirOwn) {
  const PlacedParts parts =
      copies_at({Vec3(-1, 0, 0), Vec3(5, 0, 0), Vec3(10, 0, 0), Vec3(16.5, 0, 0), Vec3(5, 8.5, 0), Vec3(5, 4, 0)});
  EXPECT_THAT(grouped(parts), ElementsAre(ElementsAre(0), ElementsAre(1, 2, 5), ElementsAre(3), ElementsAre(4)));
}

TEST_F(CopiesTest, KeepWhatLiesInTheGridWhereverTheyAre) {
  const PlacedParts parts = copies_at({Vec3(5, 2, 0), Vec3(0.5, 2, 0), Vec3(15.5, 7.5, 0)});
  const std::vector<CopyGroup> groups = copy_groups(parts);
  ASSERT_EQ(groups.size(), 1u);
  EXPECT_EQ(groups.front().within, (LayerWindow{9, 0, 10, 18}));
}

TEST_F(CopiesTest, BetweenVoxelsAreOnTheirOwn) {
  EXPECT_THAT(grouped(copies_at({Vec3(0, 0, 0), Vec3(5.2, 0, 0), Vec3(10, 0, 0.4)})),
              ElementsAre(ElementsAre(0), ElementsAre(1), ElementsAre(2)));
}

TEST_F(CopiesTest, AreOnTheirOwnUnlessTheJobSnapsThem) {
  PlacedParts parts = copies_at({Vec3(0, 0, 0), Vec3(5, 0, 0)});
  for (PlacedPart& part : parts) part.job.snap_copies = false;
  EXPECT_THAT(grouped(parts), ElementsAre(ElementsAre(0), ElementsAre(1)));
}

TEST_F(CopiesTest, AreOnTheirOwnWhereValuesStandStill) {
  PlacedParts parts = copies_at({Vec3(0, 0, 0), Vec3(5, 0, 0)});
  const auto source = std::make_shared<const ChannelFunction>(
      ChannelRange{"height", 0, 2}, std::vector<std::string>(),
      [](const Vec3& world, const Vec3&, auto) { return static_cast<float>(world.z()); });
  for (PlacedPart& part : parts) part.job.sources = {source};
  EXPECT_THAT(grouped(parts), ElementsAre(ElementsAre(0), ElementsAre(1)));
}

}  // namespace
}  // namespace ccslice
