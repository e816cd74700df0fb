// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/channel_tolerances.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace ccslice {
namespace {

const std::vector<ChannelRange> kChannels = {{"stiffness", 0, 2}, {"colour", -1, 1}, {"constant", 5, 5}};

PlaneSpec plane_of(const std::string& channel, SampleType type) {
  PlaneSpec plane;
  plane.content = PlaneContent::kChannel;
  plane.channel = channel;
  plane.sample_type = type;
  return plane;
}

SliceJob job_of_planes(const std::vector<PlaneSpec>& planes) {
  SliceJob job;
  job.planes = planes;
  return job;
}

TEST(ChannelTolerances, AreSharesOfTheChannelsRangeByThePlanesSamples) {
  const SliceJob job =
      job_of_planes({plane_of("stiffness", SampleType::kUint8), plane_of("colour", SampleType::kFloat32)});
  const auto tolerances = channel_tolerances(job, kChannels);
  ASSERT_EQ(tolerances.size(), 2u);
  EXPECT_EQ(tolerances[0].channel, 0u);
  EXPECT_EQ(tolerances[0].tolerance, 2.0 / 1024);
  EXPECT_EQ(tolerances[1].channel, 1u);
  EXPECT_EQ(tolerances[1].tolerance, 2.0 / 65536);
}

TEST(ChannelTolerances, TakeTheStrictestOfSeveralPlanes) {
  PlaneSpec narrow = plane_of("stiffness", SampleType::kUint8);
  narrow.range = ValueRange{0.5, 0.6};
  const SliceJob job =
      job_of_planes({plane_of("stiffness", SampleType::kUint8), narrow, plane_of("stiffness", SampleType::kUint8)});
  const auto tolerances = channel_tolerances(job, kChannels);
  ASSERT_EQ(tolerances.size(), 1u);
  EXPECT_NEAR(tolerances[0].tolerance, 0.1 / 1024, 1e-15);
}

TEST(ChannelTolerances, ARangeWiderThanTheChannelsGivesNoMoreRoom) {
  PlaneSpec wide = plane_of("stiffness", SampleType::kUint16);
  wide.range = ValueRange{-100, 100};
  EXPECT_EQ(channel_tolerances(job_of_planes({wide}), kChannels)[0].tolerance, 2.0 / 65536);
}

TEST(ChannelTolerances, FollowTheJobsOwn) {
  SliceJob job = job_of_planes({plane_of("stiffness", SampleType::kUint8)});
  job.channel_tolerance = 0.25;
  EXPECT_EQ(channel_tolerances(job, kChannels)[0].tolerance, 0.5);
}

TEST(ChannelTolerances, LeaveAConstantChannelItsRounding) {
  EXPECT_NEAR(channel_tolerances(job_of_planes({plane_of("constant", SampleType::kUint8)}), kChannels)[0].tolerance,
              5e-9, 1e-20);
}

TEST(ChannelTolerances, AreSharesOfTheRangeHoweverFarThatIsFromZero) {
  const std::vector<ChannelRange> far = {{"far", 1e6, 1e6 + 1}, {"below", -1e6 - 1, -1e6}};
  for (const ChannelRange& channel : far) {
    const auto tolerances = channel_tolerances(job_of_planes({plane_of(channel.name, SampleType::kUint16)}), far);
    EXPECT_EQ(tolerances[0].tolerance, 1.0 / 65536);
  }
}

// Some hundred units in the last place of its largest value.
TEST(ChannelTolerances, AreNoLessThanRounding) {
  PlaneSpec narrow = plane_of("stiffness", SampleType::kUint16);
  narrow.range = ValueRange{1, 1 + 1e-10};
  EXPECT_NEAR(channel_tolerances(job_of_planes({narrow}), kChannels)[0].tolerance, 2e-13, 1e-20);
}

TEST(ChannelTolerances, CountTheChannelsOfPlanesOfSeveral) {
  PlaneSpec plane;
  plane.content = PlaneContent::kChannels;
  plane.channels = {"colour", "stiffness"};
  plane.sample_type = SampleType::kFloat32;
  const auto tolerances = channel_tolerances(job_of_planes({plane}), kChannels);
  ASSERT_EQ(tolerances.size(), 2u);
  EXPECT_EQ(tolerances[0].channel, 1u);
  EXPECT_EQ(tolerances[1].channel, 0u);
}

// The steepest place: half a unit from one material to the next.
TEST(ChannelTolerances, HalftonedChannelsGoByTheSteepestPlaceOfTheirMap) {
  SliceJob job;
  Printing printing;
  printing.materials = {{"a", 1}, {"b", 2}, {"c", 3}};
  printing.map.kind = BlendMap{"stiffness", {{0, 1}, {0.5, 2}, {2, 3}}};
  job.printing = printing;
  PlaneSpec plane;
  plane.content = PlaneContent::kMaterials;
  plane.sample_type = SampleType::kUint8;
  job.planes = {plane};
  const auto tolerances = channel_tolerances(job, kChannels);
  ASSERT_EQ(tolerances.size(), 1u);
  EXPECT_EQ(tolerances[0].tolerance, 0.5 / 1024);
}

}  // namespace
}  // namespace ccslice
