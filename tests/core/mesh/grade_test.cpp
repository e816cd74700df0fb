// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/grade.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/mesh/models.h"
#include "tests/core/mesh/expect_error.h"

namespace ccslice {
namespace {

using testing::ElementsAre;

std::vector<float> graded(const std::vector<Vec3>& positions, const std::string& text) {
  ControlMesh mesh;
  mesh.positions = positions;
  apply_grade(parse_grade(text), mesh);
  return mesh.channel_values;
}

TEST(Grade, RunsAlongAnAxisOverTheBoundingBox) {
  EXPECT_THAT(graded({{1, 0, 9}, {2, 0, 9}, {5, 0, 9}}, "a=x"), ElementsAre(0.f, 0.25f, 1.f));
  EXPECT_THAT(graded({{1, 0, 9}, {2, 0, 9}, {5, 0, 9}}, "a=x:20..-20"), ElementsAre(20.f, 10.f, -20.f));
}

TEST(Grade, RunsAwayFromAnAxis) {
  const std::vector<Vec3> cross = {{-2, 0, 0}, {2, 0, 7}, {0, -1, 0}, {0, 1, 0}};
  EXPECT_THAT(graded(cross, "a=radial:z"), ElementsAre(1.f, 1.f, 0.f, 0.f));
  EXPECT_THAT(graded(cross, "a=radial:1..0:z:@0,0,0"), ElementsAre(0.f, 0.f, 1.f, 1.f));
}

TEST(Grade, RunsAwayFromAPoint) {
  EXPECT_THAT(graded({{0, 0, 0}, {0, 3, 4}, {0, 0, 10}}, "a=radial:0..10:@0,0,0"), ElementsAre(0.f, 5.f, 10.f));
}

TEST(Grade, IsConstantWhereThereIsNoExtent) {
  EXPECT_THAT(graded({{0, 1, 0}, {2, 1, 0}}, "a=y:7..9"), ElementsAre(7.f, 7.f));
}

TEST(Grade, AddsChannelsBesideThoseThatAreThere) {
  ControlMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 1, 1}};
  apply_grade(parse_grade("first=x"), mesh);
  apply_grade(parse_grade("second=y:3..5"), mesh);
  EXPECT_THAT(mesh.channel_names, ElementsAre("first", "second"));
  EXPECT_THAT(mesh.channel_values, ElementsAre(0.f, 3.f, 1.f, 5.f));
  expect_error([&] { apply_grade(parse_grade("first=z"), mesh); }, ErrorCode::kMeshBadChannel, "'first' already");
}

TEST(Grade, MistakesTeach) {
  for (const auto& [text, why] :
       std::vector<std::pair<std::string, std::string>>{{"stiffness", "there is no '='"},
                                                        {"=x", "no name"},
                                                        {"a=w", "the field is x, y, z or radial"},
                                                        {"a=", "the field is x, y, z or radial"},
                                                        {"a=x:z", "radial grades only"},
                                                        {"a=x:@0,0,0", "radial grades only"},
                                                        {"a=x:1..", "two numbers"},
                                                        {"a=x:1..nan", "two numbers"},
                                                        {"a=x:fast", "neither values"},
                                                        {"a=x:", "neither values"},
                                                        {"a=radial:@1,2", "three numbers"},
                                                        {"a=radial:@1,2,three", "three numbers"}}) {
    expect_error([&] { parse_grade(text); }, ErrorCode::kParameterInvalid, why);
    expect_error([&] { parse_grade(text); }, ErrorCode::kParameterInvalid, "for example stiffness=z");
  }
}

}  // namespace
}  // namespace ccslice
