// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/join_points.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "core/mesh/region_values.h"
#include "core/mesh/validate.h"
#include "tests/core/mesh/expect_error.h"
#include "tests/core/mesh/own_points.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

using oracle::box_mesh;
using testing::ElementsAre;
using testing::HasSubstr;

/// A row of two cells, each with points of its own, with a channel of one value for each cell.
ControlMesh two_cells(float first, float second) {
  ControlMesh mesh = with_own_points(box_mesh(2, 1, 1));
  mesh.channel_names = {"t"};
  mesh.channel_values.assign(16, first);
  std::fill(mesh.channel_values.begin() + 8, mesh.channel_values.end(), second);
  return mesh;
}

JoinReport join(ControlMesh& mesh, double distance_mm) {
  FileNumbers numbers;
  return join_points(distance_mm, mesh, numbers);
}

TEST(JoinPoints, GivesCellsWithOwnPointsTheirCommonOnes) {
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    if (!mesh.sharp_edges.empty() || !mesh.sharp_vertices.empty() || region_value_count(mesh) > 0) continue;
    if (mesh.interpolating) continue;
    ControlMesh joined = with_own_points(mesh);
    const std::size_t own = joined.vertex_count();
    const JoinReport report = join(joined, same_place_mm(joined));
    ASSERT_EQ(joined.vertex_count(), mesh.vertex_count()) << name;
    EXPECT_EQ(report.joined, own - mesh.vertex_count()) << name;
    EXPECT_EQ(report.farthest_apart_mm, 0) << name;
    EXPECT_EQ(report.chains, 0u) << name;
    for (std::size_t i = 0; i < mesh.cell_vertices.size(); ++i) {
      const std::uint32_t was = mesh.cell_vertices[i], now = joined.cell_vertices[i];
      EXPECT_EQ(joined.positions[now], mesh.positions[was]) << name;
      for (std::size_t c = 0; c < mesh.channel_count(); ++c) {
        EXPECT_EQ(joined.channel_values[now * mesh.channel_count() + c],
                  mesh.channel_values[was * mesh.channel_count() + c])
            << name;
      }
    }
  }
}

TEST(JoinPoints, LeavesAMeshWithoutThemAsItIs) {
  ControlMesh mesh = box_mesh(2, 2, 2);
  const ControlMesh before = mesh;
  const JoinReport report = join(mesh, same_place_mm(mesh));
  EXPECT_EQ(report.places, 0u);
  EXPECT_EQ(mesh.positions, before.positions);
  EXPECT_EQ(mesh.cell_vertices, before.cell_vertices);
}

TEST(JoinPoints, GivesTheSameMeshInAnyOrderOfPoints) {
  constexpr std::uint32_t kSeed = 5;
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> noise(-0.4, 0.4);
  ControlMesh own = with_own_points(box_mesh(3, 2, 2));
  own.channel_names = {"t"};
  for (Vec3& p : own.positions) {
    own.channel_values.push_back(static_cast<float>(p.x()));
    p += Vec3(noise(random), noise(random), noise(random));
  }
  ControlMesh first = own;
  // Any two of eight points that belong together are within 1.4; others are 9 apart at least.
  const JoinReport report = join(first, 1.4);
  EXPECT_EQ(first.vertex_count(), 36u);
  EXPECT_LE(report.farthest_apart_mm, 1.4);
  for (int round = 0; round < 5; ++round) {
    std::vector<std::uint32_t> order(own.vertex_count());
    std::iota(order.begin(), order.end(), 0u);
    std::ranges::shuffle(order, random);
    ControlMesh other = own;
    for (std::uint32_t v = 0; v < order.size(); ++v) {
      other.positions[order[v]] = own.positions[v];
      other.channel_values[order[v]] = own.channel_values[v];
    }
    for (std::uint32_t& v : other.cell_vertices) v = order[v];
    const JoinReport again = join(other, 1.4);
    EXPECT_EQ(again.farthest_apart_mm, report.farthest_apart_mm);
    ASSERT_EQ(other.vertex_count(), first.vertex_count());
    for (std::size_t i = 0; i < first.cell_vertices.size(); ++i) {
      EXPECT_EQ(other.positions[other.cell_vertices[i]], first.positions[first.cell_vertices[i]]) << "seed " << kSeed;
      EXPECT_EQ(other.channel_values[other.cell_vertices[i]], first.channel_values[first.cell_vertices[i]]);
    }
  }
}

TEST(JoinPoints, JoinsWhatDiffersInTheLastDigit) {
  ControlMesh mesh = with_own_points(box_mesh(2, 1, 1, 0.1));
  for (std::size_t i = 8; i < 16; ++i) {
    for (double& x : mesh.positions[i]) x = std::nextafter(x, 1);
  }
  EXPECT_EQ(join(mesh, same_place_mm(mesh)).places, 4u);
  ControlMesh single = with_own_points(box_mesh(2, 1, 1, 10));
  for (std::size_t i = 8; i < 16; ++i) {
    for (double& x : single.positions[i]) x = std::nextafterf(static_cast<float>(x), 1e9f);
  }
  EXPECT_EQ(join(single, same_place_mm(single)).places, 4u) << "in single precision";
}

/// The number that text of so many significant digits has.
double written(double x, int digits) {
  char text[40];
  std::snprintf(text, sizeof text, "%.*g", digits, x);
  return std::stod(text);
}

TEST(JoinPoints, KnowsTheLastDigitOfText) {
  constexpr double kPitch = 7.3219054321987;
  for (const int digits : {6, 7, 8, 9}) {
    ControlMesh mesh = with_own_points(box_mesh(2, 1, 1, kPitch));
    // A unit in the last place of the largest coordinate, or of single precision.
    const double unit = std::max(std::pow(10, 2 - digits), 1.0 / (1 << 20));
    for (std::size_t i = 0; i < 16; ++i) {
      for (double& x : mesh.positions[i]) x = written(static_cast<float>(x + (i < 8 ? 0 : unit)), digits);
    }
    ControlMesh scaled = mesh;
    for (Vec3& p : scaled.positions) p *= 1000;
    EXPECT_EQ(join(mesh, last_digit_mm(mesh)).places, 4u) << digits;
    EXPECT_EQ(join(scaled, last_digit_mm(scaled)).places, 4u) << digits;
  }
  EXPECT_EQ(last_digit_mm(box_mesh(2, 1, 1, kPitch)), 0) << "in double precision";
  EXPECT_EQ(last_digit_mm(box_mesh(3, 1, 1, 50.1)), 0) << "round numbers";
  EXPECT_EQ(last_digit_mm({}), 0);
  ControlMesh far = box_mesh(1, 1, 1, 1);
  for (Vec3& p : far.positions) p.x() += 123456;
  EXPECT_NEAR(last_digit_mm(far), 2e-5 * std::sqrt(3), 1e-9) << "no more than that of the part";
}

TEST(JoinPoints, TakesABillionthOfThePartForOnePlace) {
  ControlMesh mesh = box_mesh(1, 1, 1, 1 / std::sqrt(3));
  EXPECT_NEAR(same_place_mm(mesh), 1e-9, 1e-15);
  ControlMesh whole = box_mesh(1, 1, 1, 1);
  EXPECT_NEAR(same_place_mm(whole), 2.4e-7, 1e-8) << "all are single-precision numbers";
  for (Vec3& p : whole.positions) p.x() += 4e6;
  EXPECT_NEAR(same_place_mm(whole), 1.7e-6, 1e-7) << "far away, but neighbours stay neighbours";
  EXPECT_EQ(same_place_mm({}), 0);
}

TEST(JoinPoints, TakesTheMiddleOfValuesThatAgree) {
  ControlMesh mesh = two_cells(1, 1);
  mesh.channel_values[0] = 0;  // The range.
  for (std::size_t i = 8; i < 16; ++i) mesh.channel_values[i] = 1.0000005f;
  const JoinReport report = join(mesh, 0);
  EXPECT_EQ(report.places, 4u);
  EXPECT_EQ(report.jumps, 0u);
  const float joined = mesh.channel_values[mesh.cell_vertices[1]];
  EXPECT_GT(joined, 1);
  EXPECT_LT(joined, 1.0000005f);
}

TEST(JoinPoints, RefusesValuesThatDisagreeWithBothAndTheirPoints) {
  ControlMesh mesh = two_cells(20, 35);
  const ControlMesh before = mesh;
  try {
    join(mesh, 0);
    ADD_FAILURE() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kMeshBadChannel);
    EXPECT_THAT(error.what(), HasSubstr("channel 't' is 20 at vertex 1 and 35 at vertex 8, points in one place, and "
                                        "values disagree in 3 more places"));
    EXPECT_THAT(error.ids(), ElementsAre(1, 8));
    EXPECT_EQ(error.field(), "channel_values");
  }
  EXPECT_EQ(mesh.positions, before.positions);
}

TEST(JoinPoints, KeepsValuesApartBetweenRegions) {
  ControlMesh mesh = two_cells(20, 35);
  mesh.cell_region_names = {"cold", "hot"};
  mesh.cell_regions = {0, 1};
  const JoinReport report = join(mesh, 0);
  EXPECT_EQ(report.places, 4u);
  EXPECT_EQ(report.jumps, 4u);
  ASSERT_EQ(mesh.vertex_count(), 12u);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(values_in_region(mesh, mesh.cell_vertices[i], 0)[0], 20) << i;
    EXPECT_EQ(values_in_region(mesh, mesh.cell_vertices[8 + i], 1)[0], 35) << i;
  }
  EXPECT_NO_THROW(validate(mesh));
}

TEST(JoinPoints, RefusesValuesThatDisagreeWithinARegion) {
  ControlMesh mesh = with_own_points(box_mesh(3, 1, 1));
  mesh.channel_names = {"t"};
  for (std::size_t i = 0; i < 24; ++i) mesh.channel_values.push_back(static_cast<float>(i / 8));
  mesh.cell_region_names = {"a", "b"};
  mesh.cell_regions = {0, 1, 1};
  expect_error([&] { join(mesh, 0); }, ErrorCode::kMeshBadChannel, "is 1 at vertex 9 and 2 at vertex 16");
}

TEST(JoinPoints, NamesValuesOfOneRegionWhereOthersAreFartherApart) {
  ControlMesh mesh = with_own_points(box_mesh(2, 2, 1));
  mesh.channel_names = {"t"};
  mesh.channel_values.assign(32, 1);
  std::fill(mesh.channel_values.begin() + 16, mesh.channel_values.end(), 9);
  mesh.channel_values[11] = 2;  // Of the second cell, in the middle.
  mesh.cell_region_names = {"a", "b"};
  mesh.cell_regions = {0, 0, 1, 1};
  expect_error([&] { join(mesh, 0); }, ErrorCode::kMeshBadChannel, "is 1 at vertex 2 and 2 at vertex 11");
}

TEST(JoinPoints, NamesTheValuesOfARegionThatVerticesHaveBeside) {
  ControlMesh mesh = with_own_points(box_mesh(2, 1, 1));
  mesh.channel_names = {"t"};
  mesh.channel_values.assign(16, 5);
  mesh.cell_region_names = {"a"};
  mesh.cell_regions = {0, 0};
  append_region_values(8, 0, std::vector<float>{7}, mesh);
  expect_error([&] { join(mesh, 0); }, ErrorCode::kMeshBadChannel, "is 5 at vertex 1 and 7 at vertex 8");
}

TEST(JoinPoints, NamesCellsWithARepeatedCorner) {
  ControlMesh mesh = with_own_points(box_mesh(3, 1, 1, 10));
  for (std::size_t i = 8; i < 16; ++i) mesh.positions[i].x() = 10 + 0.001 * (mesh.positions[i].x() - 10);
  const ControlMesh before = mesh;
  try {
    join(mesh, 0.02);
    ADD_FAILURE() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kMeshRepeatedVertex);
    EXPECT_THAT(error.what(), HasSubstr("points within 0.02 mm of each other are joined, which leaves a corner "
                                        "repeated in cell 1: two of the first one's corners are 0.01 mm apart before"));
    EXPECT_THAT(error.ids(), ElementsAre(1));
  }
  EXPECT_EQ(mesh.positions, before.positions);
}

TEST(JoinPoints, NamesCellsThatBecomeFlatOrFold) {
  // The apex of the first one is moved through its base.
  ControlMesh thin;
  thin.cell_kinds = {CellKind::kTet, CellKind::kTet};
  thin.positions = {{0, 0, 0}, {10, 0, 0}, {0, 10, 0}, {3, 3, 0.1}, {20, 0, 0}, {30, 0, 0}, {20, 10, 0}, {3, 3, -0.3}};
  thin.cell_vertices = {0, 1, 2, 3, 4, 5, 6, 7};
  ControlMesh allowed = thin;
  thin.cell_vertices = {0, 1, 2, 3, 4, 6, 5, 7};
  expect_error([&] { join(thin, 0.5); }, ErrorCode::kMeshInvertedCell,
               "which flattens or folds cell 0: the least Jacobian at the first one's corners is 10 mm^3 before, and "
               "-10 afterwards");
  allowed.allow_folds = true;
  EXPECT_EQ(join(allowed, 0.5).places, 1u);
  thin.interpolating = true;
  EXPECT_EQ(join(thin, 0.5).places, 1u) << "fitted control points may fold";
}

TEST(JoinPoints, SaysHowLongAChainIs) {
  ControlMesh mesh = with_own_points(box_mesh(2, 1, 1, 10));
  // Along the common face the second cell's points lie one step off, so chains have two points.
  for (std::size_t i = 8; i < 16; ++i) mesh.positions[i].y() += 0.001;
  EXPECT_EQ(join(mesh, 0.001).chains, 0u);
  ControlMesh three = with_own_points(box_mesh(2, 2, 1, 10));
  for (std::size_t i = 0; i < 32; ++i) three.positions[i].z() += 0.001 * static_cast<double>(i / 8);
  const JoinReport report = join(three, 0.0015);
  EXPECT_EQ(report.chains, 2u) << "the middle edge's, of four points each";
  EXPECT_EQ(report.longest_chain.points, 4u);
  EXPECT_NEAR(report.longest_chain.length_mm, 0.003, 1e-12);
  EXPECT_TRUE(report.longest_chain.place.isApprox(Vec3(10, 10, 0.0015)) ||
              report.longest_chain.place.isApprox(Vec3(10, 10, 10.0015)));
}

TEST(JoinPoints, TakesTagsNumbersAndMidNodesAlong) {
  ControlMesh mesh = with_own_points(box_mesh(2, 1, 1));
  // Corners 1 and 2 of the first cell are corners 0 and 3 of the second one.
  mesh.sharp_edges = {{1, 2}, {11, 8}, {0, 1}};
  mesh.sharp_vertices = {1, 8, 0};
  mesh.interpolating = true;
  mesh.missed_vertices = {{1, Vec3(1, 1, 1)}, {2, Vec3(2, 2, 2)}, {8, Vec3(1, 1, 1)}};
  mesh.mid_nodes.edges = {{1, 2}, {8, 11}};
  mesh.mid_nodes.positions = {{10, 5, 1}, {10, 5, 1}};
  FileNumbers numbers;
  for (std::uint64_t v = 0; v < 16; ++v) numbers.vertices.push_back(900 + v);
  const JoinReport report = join_points(0, mesh, numbers);
  EXPECT_THAT(mesh.sharp_edges, ElementsAre(ElementsAre(1, 2), ElementsAre(0, 1)));
  EXPECT_THAT(mesh.sharp_vertices, ElementsAre(1, 0));
  ASSERT_EQ(mesh.missed_vertices.size(), 2u);
  EXPECT_EQ(mesh.missed_vertices[0].vertex, 1u);
  EXPECT_EQ(mesh.missed_vertices[1].vertex, 2u);
  EXPECT_THAT(numbers.vertices, ElementsAre(900, 901, 902, 903, 904, 905, 906, 907, 909, 910, 913, 914));
  EXPECT_THAT(mesh.mid_nodes.edges, ElementsAre(ElementsAre(1, 2)));
  EXPECT_EQ(report.bent_edges, 0u);
}

TEST(JoinPoints, SaysWhereMidNodesAreElsewhere) {
  ControlMesh mesh = with_own_points(box_mesh(2, 1, 1));
  mesh.mid_nodes.edges = {{1, 2}, {8, 11}};
  mesh.mid_nodes.positions = {{10, 5, 1}, {10, 5, 3}};
  const JoinReport report = join(mesh, 0);
  EXPECT_EQ(report.bent_edges, 1u);
  EXPECT_EQ(report.bent_by_mm, 2);
}

TEST(JoinPoints, TakesMidNodesWithinTheDistanceForOne) {
  ControlMesh mesh = with_own_points(box_mesh(2, 1, 1));
  mesh.mid_nodes.edges = {{1, 2}, {5, 6}, {8, 11}, {12, 15}};
  mesh.mid_nodes.positions = {{10, 5, 1}, {10, 5, 11}, {10, 5, 3}, {10, 5, 11.001}};
  const JoinReport report = join(mesh, 0.01);
  EXPECT_EQ(report.bent_edges, 1u);
  EXPECT_EQ(report.bent_by_mm, 2);
}

TEST(JoinPoints, LeavesToValidationWhatIsNotFinite) {
  ControlMesh mesh = two_cells(1, 1);
  mesh.channel_values[8] = std::numeric_limits<float>::quiet_NaN();
  mesh.positions[15].x() = std::numeric_limits<double>::infinity();
  EXPECT_NO_THROW(join(mesh, 1e-9));
  expect_error([&] { validate(mesh); }, ErrorCode::kMeshNonFinite, "infinite");
}

TEST(JoinPoints, RefusesAMillionPointsInOnePlaceByName) {
  ControlMesh mesh;
  constexpr std::uint32_t kPoints = 1'000'000;
  mesh.positions.assign(kPoints, Vec3(1, 2, 3));
  mesh.cell_kinds.assign(kPoints / 4, CellKind::kTet);
  mesh.cell_vertices.resize(kPoints);
  std::iota(mesh.cell_vertices.begin(), mesh.cell_vertices.end(), 0u);
  expect_error([&] { join(mesh, same_place_mm(mesh)); }, ErrorCode::kMeshRepeatedVertex, "in cells 0, 1, 2, 3");
}

}  // namespace
}  // namespace ccslice
