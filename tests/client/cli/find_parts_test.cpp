// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/tray/find_parts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/client/cli/package_files.h"

namespace ccslice::cli {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::vector<Vec3> random_points(std::size_t count, unsigned seed, double size_mm = 100) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> coordinate(0, size_mm);
  std::vector<Vec3> points(count);
  for (Vec3& point : points) point = Vec3(coordinate(random), coordinate(random), coordinate(random));
  return points;
}

TrayInstance instance_of(std::vector<Vec3> points, const Placement& placement, const std::string& name = "") {
  TrayInstance instance;
  instance.points = std::make_shared<std::vector<Vec3>>(std::move(points));
  instance.placement = placement;
  instance.name = name;
  instance.label = "object 3 'x'";
  return instance;
}

/// Returns points as a program writes them: floats about another origin, in a frame of its own.
std::vector<Vec3> as_floats(std::vector<Vec3> points, const Vec3& origin) {
  for (Vec3& point : points) {
    point = (point.cast<float>().cast<double>() - origin).cast<float>().cast<double>();
  }
  return points;
}

const std::vector<Mat3> kAsMeshed = {Mat3::Identity()};

TEST(FindParts, FindsPartsWhateverOriginTheyHave) {
  const std::vector<ExportedPart> parts = {{"a", random_points(40, 1), kAsMeshed},
                                           {"b", random_points(41, 2), kAsMeshed}};
  for (const std::size_t p : {0u, 1u}) {
    const Vec3 origin(50.3, 40.1, 60.7);
    const Placement placement = motion(Vec3(1, 2, 3), 77, Vec3(120, 240, 10));
    const PartSearch search = find_part(parts, instance_of(as_floats(parts[p].points, origin), placement));
    ASSERT_TRUE(search.found) << search.fault;
    EXPECT_EQ(search.found->part, p);
    EXPECT_FALSE(search.found->mirrored);
    EXPECT_LT(search.found->residual_mm, 3e-5);
    for (const Vec3& point : parts[p].points) {
      EXPECT_LT((search.found->placement * point - placement * (point - origin)).norm(), 5e-5);
    }
  }
}

TEST(FindParts, TurnsByRightAnglesStayExact) {
  const std::vector<ExportedPart> parts = {{"a", random_points(40, 1), kAsMeshed}};
  const PartSearch search = find_part(
      parts, instance_of(as_floats(parts[0].points, Vec3(50, 40, 60)), motion(Vec3::UnitZ(), 90, Vec3(120, 240, 10))));
  ASSERT_TRUE(search.found) << search.fault;
  Mat3 turn;
  turn << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  EXPECT_EQ(search.found->placement.linear(), turn);
}

TEST(FindParts, TakesMirroredPartsAndSaysSo) {
  const std::vector<ExportedPart> parts = {{"a", random_points(40, 1), kAsMeshed}};
  Placement mirror = Placement::Identity();
  mirror.linear()(0, 0) = -1;
  const PartSearch search = find_part(parts, instance_of(parts[0].points, mirror));
  ASSERT_TRUE(search.found) << search.fault;
  EXPECT_TRUE(search.found->mirrored);
  EXPECT_EQ(search.found->placement.linear(), mirror.linear());
}

TEST(FindParts, KeepsTheScaleOfTheJob) {
  const Mat3 scale = Vec3(2, 1, 1).asDiagonal();
  const std::vector<ExportedPart> parts = {{"a", random_points(40, 1), {Mat3::Identity(), scale}}};
  Placement scaled = Placement::Identity();
  scaled.linear() = scale;
  const Placement placement = motion(Vec3(1, 0, 1), 33, Vec3(1, 2, 3)) * scaled;
  const PartSearch search = find_part(parts, instance_of(parts[0].points, placement));
  ASSERT_TRUE(search.found) << search.fault;
  EXPECT_FALSE(search.found->mirrored);
  EXPECT_TRUE(search.found->placement.matrix().isApprox(placement.matrix(), 1e-9));
}

TEST(FindParts, TellsPartsOfOneMeshByTheirNames) {
  const std::vector<Vec3> points = random_points(40, 1);
  const std::vector<ExportedPart> parts = {{"a", points, kAsMeshed}, {"b", points, kAsMeshed}};
  EXPECT_EQ(find_part(parts, instance_of(points, Placement::Identity(), "b")).found->part, 1u);
  EXPECT_EQ(find_part(parts, instance_of(points, Placement::Identity(), "a")).found->part, 0u);
  EXPECT_EQ(find_part(parts, instance_of(points, Placement::Identity(), "c")).found->part, 0u);
}

TEST(FindParts, RefusesScaledAndEditedOnesByName) {
  const std::vector<ExportedPart> parts = {{"ring", random_points(40, 1), kAsMeshed}};
  Placement scaled = Placement::Identity();
  scaled.linear().diagonal() = Vec3(1, 1.5, 1);
  const PartSearch by_scale = find_part(parts, instance_of(parts[0].points, scaled));
  EXPECT_FALSE(by_scale.found);
  EXPECT_FALSE(by_scale.is_foreign);
  EXPECT_THAT(by_scale.fault,
              AllOf(HasSubstr("object 3 'x' is scaled by 1.5 x 1 x 1"), HasSubstr("'ring'"), HasSubstr(" um")));
  EXPECT_THAT(by_scale.remedy, HasSubstr("100 %"));
  std::vector<Vec3> edited = parts[0].points;
  edited[17].z() += 0.01;
  const PartSearch by_edit = find_part(parts, instance_of(edited, motion(Vec3(1, 1, 1), 20, Vec3(1, 2, 3))));
  EXPECT_FALSE(by_edit.found);
  EXPECT_THAT(by_edit.fault, AllOf(HasSubstr("was edited"), HasSubstr("vertex 17")));
  edited = parts[0].points;
  edited[17].z() += 0.0008;
  EXPECT_TRUE(find_part(parts, instance_of(edited, Placement::Identity())).found) << "within 1 um";
}

TEST(FindParts, TellsOthersFromThoseOfOtherTolerance) {
  const std::vector<ExportedPart> parts = {{"ring", random_points(40, 1), kAsMeshed}};
  const PartSearch other = find_part(parts, instance_of(random_points(39, 2), Placement::Identity(), "cube"));
  EXPECT_TRUE(other.is_foreign);
  EXPECT_THAT(other.fault, HasSubstr("none of the job's parts"));
  EXPECT_TRUE(find_part(parts, instance_of(random_points(40, 2), Placement::Identity(), "cube")).is_foreign)
      << "as many vertices, in quite other places";
  const PartSearch coarser = find_part(parts, instance_of(random_points(39, 2), Placement::Identity(), "ring"));
  EXPECT_FALSE(coarser.is_foreign);
  EXPECT_THAT(coarser.fault, AllOf(HasSubstr("39 vertices"), HasSubstr("with 40"), HasSubstr("--chord-tolerance")));
  EXPECT_TRUE(find_part(parts, instance_of({}, Placement::Identity())).is_foreign);
}

}  // namespace
}  // namespace ccslice::cli
