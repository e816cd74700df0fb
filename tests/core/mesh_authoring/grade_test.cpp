// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_authoring/grade.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "core/models/models.h"
#include "tests/core/mesh/expect_error.h"
#include "tests/support/tiny_meshes.h"

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

TEST(Grade, RunsFromTheBoundaryInwards) {
  const auto by_place = [](const std::string& text) {
    ControlMesh mesh = oracle::box_mesh(6, 6, 6);
    apply_grade(parse_grade(text), mesh);
    std::map<double, std::set<float>> values;  // By depth.
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
      const Vec3& p = mesh.positions[v];
      values[std::min(p.minCoeff(), (Vec3(60, 60, 60) - p).minCoeff())].insert(mesh.channel_values[v]);
    }
    return values;
  };
  using ByDepth = std::map<double, std::set<float>>;
  EXPECT_EQ(by_place("a=distance"), (ByDepth{{0, {0.f}}, {10, {1.f / 3}}, {20, {2.f / 3}}, {30, {1.f}}}));
  EXPECT_EQ(by_place("a=distance:90..30:20"), (ByDepth{{0, {90.f}}, {10, {60.f}}, {20, {30.f}}, {30, {30.f}}}));
}

TEST(Grade, ByDistanceSaysHowDeepItGoes) {
  ControlMesh mesh = oracle::box_mesh(6, 6, 6);
  EXPECT_EQ(apply_grade(parse_grade("a=distance"), mesh), 30);
  EXPECT_EQ(apply_grade(parse_grade("b=distance:90..30:20"), mesh), 30);
  EXPECT_EQ(apply_grade(parse_grade("c=z"), mesh), 0);
}

TEST(Grade, HasNoDepthWhereAllControlPointsLieOnTheBoundary) {
  ControlMesh mesh = oracle::box_mesh(1, 3, 3);
  EXPECT_EQ(apply_grade(parse_grade("a=distance:5..9"), mesh), 0);
  EXPECT_THAT(mesh.channel_values, testing::Each(5.f));
}

TEST(Grade, ComesFromAFile) {
  const std::string path = (std::filesystem::temp_directory_path() / "ccslice_grade_test.txt").string();
  const auto with_text = [&](const std::string& text) {
    std::ofstream(path) << text;
    return graded({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, "a=file:" + path);
  };
  EXPECT_THAT(with_text("# hardness\n20 -1.5\n3e2\n"), ElementsAre(20.f, -1.5f, 300.f));
  expect_error([&] { with_text("1\n2\n"); }, ErrorCode::kFileSyntax, "expected the value of vertex 2 of 3");
  expect_error([&] { with_text("1\n2\n3\n4\n"); }, ErrorCode::kFileSyntax, path + ": line 4: expected no more than 3");
  expect_error([&] { with_text("1\ntwo\n3\n"); }, ErrorCode::kFileSyntax, "line 2");
  expect_error([&] { with_text("1\n2\nnan\n"); }, ErrorCode::kMeshNonFinite, "line 3");
  std::filesystem::remove(path);
  expect_error([&] { graded({{0, 0, 0}}, "a=file:" + path); }, ErrorCode::kFileUnreadable, path);
}

TEST(Grade, MistakesTeach) {
  for (const auto& [text, why] :
       std::vector<std::pair<std::string, std::string>>{{"stiffness", "there is no '='"},
                                                        {"=x", "no name"},
                                                        {"a=w", "the field is x, y, z, radial, distance or file"},
                                                        {"a=", "the field is x, y, z, radial, distance or file"},
                                                        {"a=x:z", "radial grades only"},
                                                        {"a=x:@0,0,0", "radial grades only"},
                                                        {"a=x:1..", "two numbers"},
                                                        {"a=x:1..nan", "two numbers"},
                                                        {"a=x:fast", "neither values"},
                                                        {"a=x:", "neither values"},
                                                        {"a=x:5", "neither values"},
                                                        {"a=distance:z", "radial grades only"},
                                                        {"a=distance:0", "more than 0 mm"},
                                                        {"a=distance:-1", "more than 0 mm"},
                                                        {"a=file", "the field is x, y, z, radial, distance or file"},
                                                        {"a=file:", "the file has no name"},
                                                        {"a=radial:@1,2", "three numbers"},
                                                        {"a=radial:@1,2,three", "three numbers"}}) {
    expect_error([&] { parse_grade(text); }, ErrorCode::kParameterInvalid, why);
    expect_error([&] { parse_grade(text); }, ErrorCode::kParameterInvalid, "for example stiffness=z");
  }
}

}  // namespace
}  // namespace ccslice
