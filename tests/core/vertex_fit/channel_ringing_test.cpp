// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/vertex_fit/channel_ringing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "core/limit/limit_evaluator.h"
#include "core/limit/limit_solid.h"
#include "core/prepare/prepare_solid.h"
#include "core/vertex_fit/vertex_fit.h"
#include "tests/core/mesh/expect_error.h"
#include "tests/support/cell_regions.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

ControlMesh with_channel(ControlMesh mesh, double (*value)(const Vec3&)) {
  mesh.channel_names = {"a"};
  mesh.channel_values.clear();
  for (const Vec3& p : mesh.positions) mesh.channel_values.push_back(static_cast<float>(value(p)));
  return mesh;
}

double step(const Vec3& p) { return p.x() < 2.5 ? 20 : 30; }
double slope(const Vec3& p) { return 3 * p.x() - p.y() + 1; }

/// The mesh fitted in positions and channels, and what rings.
std::vector<ChannelRinging> ringing_of(const ControlMesh& mesh, ControlMesh& fitted) {
  const VertexFit fit(mesh);
  FitReport report;
  fitted = fit.fit_positions(FittedVertices::kAll, report);
  return fit.fit_channels(mesh, fitted).ringing;
}

std::vector<ChannelRinging> ringing_of(const ControlMesh& mesh) {
  ControlMesh fitted;
  return ringing_of(mesh, fitted);
}

struct Sample {
  Vec3 place;
  double value = 0;
  ControlCellId cell;
};

/// The first channel of the limit by evaluating it, at corners and middles of its cells and halfway between them.
std::vector<Sample> evaluate(const ControlMesh& fitted) {
  const auto solid = prepare_solid(fitted);
  LimitEvaluator evaluator(*solid);
  std::vector<Sample> samples;
  std::vector<double> values(solid->channel_count());
  for (const LimitCellId cell : solid->cells()) {
    for (int i = 0; i < 125; ++i) {
      const Vec3 uvw = Vec3(i % 5, i / 5 % 5, i / 25) / 4;
      const Vec3 place = evaluator.geo_and_mat({cell, uvw}, values);
      samples.push_back({place, values[0], solid->control_cell(cell)});
    }
  }
  return samples;
}

/// What was found is in the limit, and it is about as far as the limit goes.
void expect_found_by_evaluation(const ControlMesh& mesh) {
  ControlMesh fitted;
  const auto ringing = ringing_of(mesh, fitted);
  ASSERT_EQ(ringing.size(), 1u);
  const std::vector<Sample> samples = evaluate(fitted);
  double low = samples.front().value, high = low, nearest = 1e9, there = 0;
  bool is_in_cell = false;
  for (const Sample& sample : samples) {
    low = std::min(low, sample.value);
    high = std::max(high, sample.value);
    const double distance = (sample.place - ringing[0].place).norm();
    if (distance < nearest) nearest = distance, there = sample.value;
    is_in_cell |= distance < 1e-6 && sample.cell == ringing[0].cell;
  }
  EXPECT_LT(nearest, 1e-6);
  EXPECT_TRUE(is_in_cell) << "cell " << ringing[0].cell;
  EXPECT_NEAR(there, ringing[0].value, 1e-3);
  // The coarser a mesh, the more its limit bends between the samples.
  const double range = high - low;
  EXPECT_GT(ringing[0].low, low - 1e-6 * range);
  EXPECT_LT(ringing[0].low, low + 0.06 * range);
  EXPECT_LT(ringing[0].high, high + 1e-6 * range);
  EXPECT_GT(ringing[0].high, high - 0.06 * range);
}

TEST(FindRinging, FindsHowFarTheLimitGoesBesideAStep) {
  expect_found_by_evaluation(with_channel(oracle::box_mesh(6, 4, 4, 1), step));
}

TEST(FindRinging, FindsItInTetrahedraAndWedges) {
  std::size_t meshes = 0;
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    if (std::ranges::all_of(mesh.cell_kinds, [](CellKind kind) { return kind == CellKind::kHex; })) continue;
    ControlMesh single = with_channel(mesh, [](const Vec3&) { return 0.0; });
    single.channel_values[0] = 1;
    try {
      if (ringing_of(single).empty()) continue;
    } catch (const Error&) {
      continue;  // Not to be fitted.
    }
    SCOPED_TRACE(name);
    expect_found_by_evaluation(single);
    ++meshes;
  }
  EXPECT_GT(meshes, 0u);
}

TEST(FindRinging, FindsNothingAlongASlope) {
  ControlMesh mesh = oracle::box_mesh(6, 4, 4, 1);
  oracle::sharpen_by_cells(mesh, 1);
  EXPECT_TRUE(ringing_of(with_channel(mesh, slope)).empty());
}

TEST(FindRinging, FindsNothingInAConstant) {
  EXPECT_TRUE(ringing_of(with_channel(oracle::box_mesh(3, 3, 3, 1), [](const Vec3&) { return 7.0; })).empty());
}

TEST(FindRinging, TellsChannelsApart) {
  ControlMesh mesh = oracle::box_mesh(6, 4, 4, 1);
  oracle::sharpen_by_cells(mesh, 1);
  mesh.channel_names = {"slope", "step", "again"};
  for (const Vec3& p : mesh.positions) {
    for (const double value : {slope(p), step(p), 25 - step(p)})
      mesh.channel_values.push_back(static_cast<float>(value));
  }
  const auto ringing = ringing_of(mesh);
  ASSERT_EQ(ringing.size(), 2u);
  EXPECT_EQ(ringing[0].channel, 1u);
  EXPECT_EQ(ringing[1].channel, 2u);
  EXPECT_NEAR(ringing[1].low, 25 - ringing[0].high, 1e-4);
  EXPECT_NEAR(ringing[1].high, 25 - ringing[0].low, 1e-4);
}

/// A channel that is constant in each region has a step between them, but none that the limit has to follow.
TEST(FindRinging, LooksAtEachRegionByItself) {
  const ControlMesh mesh = oracle::region_meshes().front().mesh;
  const auto by_region = [](std::uint32_t, std::uint8_t region) {
    return std::vector<float>{region == 0 ? 1.0f : 5.0f};
  };
  EXPECT_TRUE(ringing_of(oracle::with_jumping_channels(mesh, {"a"}, by_region)).empty());
}

/// More cells than are refined at once: one control value of the last ones sticks out.
TEST(FindRinging, LooksAtManyCells) {
  const ControlMesh mesh = oracle::box_mesh(40, 30, 30, 1);
  ASSERT_GT(mesh.cell_count(), 1u << 15);
  VertexSystem::Values points = VertexSystem::Values::Zero(static_cast<Eigen::Index>(mesh.vertex_count()), 4);
  const Vec3 place(38, 28, 28);
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
    const auto row = static_cast<Eigen::Index>(v);
    points.row(row).head<3>() = mesh.positions[v].transpose();
    points(row, 3) = (mesh.positions[v] - place).norm() < 0.5 ? -27 : 0;
  }
  const std::vector<std::array<double, 2>> ranges = {{0, 1}};
  std::vector<std::size_t> sampled;
  const auto ringing =
      find_ringing(make_cell_complex(mesh), points, ranges, {}, [&](std::size_t done, std::size_t total) {
        EXPECT_EQ(total, mesh.cell_count());
        sampled.push_back(done);
      });
  EXPECT_EQ(sampled, std::vector<std::size_t>({1u << 15, mesh.cell_count()})) << "progress";
  ASSERT_EQ(ringing.size(), 1u);
  EXPECT_NEAR(ringing[0].value, -8, 1e-9) << "its weight in its own limit point is 8/27";
  EXPECT_LT((ringing[0].place - place).norm(), 1e-9);
}

TEST(FindRinging, StopsWhenCancelled) {
  const ControlMesh mesh = oracle::box_mesh(6, 6, 6, 1);
  VertexSystem::Values points = VertexSystem::Values::Zero(static_cast<Eigen::Index>(mesh.vertex_count()), 4);
  points(0, 3) = 2;
  const std::vector<std::array<double, 2>> ranges = {{0, 1}};
  const auto token = CancellationToken::make();
  token.cancel();
  expect_error([&] { find_ringing(make_cell_complex(mesh), points, ranges, token); }, ErrorCode::kCancelled, "cancel");
}

}  // namespace
}  // namespace ccslice
