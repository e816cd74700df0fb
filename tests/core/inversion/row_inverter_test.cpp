// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/inversion/row_inverter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

constexpr double kAcceptedMm = 1.01e-6;  // What inversion accepts, and rounding.

/// A solid whose channels are its own coordinates, rounded to what a channel holds exactly: a value that isn't its
/// point shows how far off the parameter is.
std::shared_ptr<const LimitSolid> coordinate_solid(ControlMesh mesh) {
  for (Vec3& p : mesh.positions) {
    for (double& coordinate : p) coordinate = std::round(1024 * coordinate) / 1024;
  }
  oracle::grade_by_coordinates(mesh);
  return prepare_solid(std::move(mesh));
}

struct Rows {
  explicit Rows(const LimitSolid& the_solid, const InversionOptions& options = {})
      : solid(the_solid), inverter(solid, options), rows(inverter, solid, options) {}

  const SolvedRow& solve(const Vec3& first, const Vec3& step, std::uint32_t count,
                         const std::optional<CellParam>& hint = {}) {
    rows.solve(first, step, count, hint, {}, {}, row);
    return row;
  }

  /// Every point resolved as point_inverter.h resolves it alone, with its own coordinates for channels.
  void expect_exact(const Vec3& first, const Vec3& step, std::uint32_t count, const std::string& name) {
    solve(first, step, count);
    PointInverter alone(solid);
    for (std::uint32_t k = 0; k < count; ++k) {
      const Vec3 point = first + k * step;
      const std::optional<InversionResult> found = alone.invert(point);
      const bool resolved = row.points[k] != RowPoint::kUnresolved;
      ASSERT_EQ(resolved, found.has_value()) << name << " point " << k << " at " << point.transpose();
      if (!resolved) continue;
      const double off = (Vec3::Map(&row.values[3 * k]) - point).norm();
      EXPECT_LT(off, found->residual_mm + kAcceptedMm) << name << " point " << k;
      EXPECT_LT(off, row.max_residual_mm + 1e-9) << name << " point " << k;
    }
  }

  const LimitSolid& solid;
  PointInverter inverter;
  RowInverter rows;
  SolvedRow row;
};

TEST(RowInverter, FindsEveryPointOfRowsThroughTheCatalogue) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> u(0, 1), direction(-1, 1);
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    const auto solid = coordinate_solid(mesh);
    Rows rows(*solid);
    LimitEvaluator evaluator(*solid);
    std::uniform_int_distribution<std::uint32_t> cell(0, solid->cell_count() - 1);
    for (int i = 0; i < 8; ++i) {
      const Vec3 middle = evaluator.geo({LimitCellId{cell(random)}, Vec3(u(random), u(random), u(random))});
      const Vec3 step = (i % 2 ? 0.05 : 0.4) * Vec3(direction(random), direction(random), direction(random));
      rows.expect_exact(middle - 20 * step, step, 41, name);
    }
  }
}

/// How far the materials of points of a row are from those of the same points alone: a share of the channels' ranges.
double worst_difference(Rows& rows, const Vec3& first, const Vec3& step, std::uint32_t count, std::size_t& compared) {
  const SolvedRow& row = rows.solve(first, step, count);
  PointInverter alone(rows.solid);
  const std::size_t channels = rows.solid.channel_count();
  std::vector<double> values(channels);
  double worst = 0;
  for (std::uint32_t k = 0; k < count; ++k) {
    const std::optional<InversionResult> found = alone.invert(first + k * step);
    if (!found || found->residual_mm > 1e-6 || row.points[k] == RowPoint::kUnresolved) continue;
    ++compared;
    alone.evaluator().mat(found->at, values);
    for (std::size_t c = 0; c < channels; ++c) {
      const ChannelRange& range = rows.solid.summary().channels[c];
      worst = std::max(worst, std::abs(row.values[k * channels + c] - values[c]) / (range.max - range.min));
    }
  }
  return worst;
}

/// Rows through random places of each cell of the catalogue, some of them beside lines and corners, of parts that many
/// times as large.
void expect_alike(double scale) {
  constexpr unsigned kSeed = 11;
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> u(0, 1), exponent(0, 8), direction(-1, 1);
  std::size_t compared = 0;
  for (auto [name, mesh] : oracle::tiny_meshes()) {
    for (Vec3& p : mesh.positions) p *= scale;
    const auto solid = prepare_solid(mesh);
    if (solid->channel_count() == 0) continue;
    Rows rows(*solid);
    LimitEvaluator evaluator(*solid);
    std::uniform_int_distribution<std::uint32_t> cell(0, solid->cell_count() - 1);
    for (int i = 0; i < 12; ++i) {
      CellParam middle{LimitCellId{cell(random)}, Vec3(u(random), u(random), u(random))};
      for (int a = 0; a < i % 4; ++a) middle.uvw[a] = std::exp2(-exponent(random));
      const Vec3 step = scale * (i % 2 ? 0.05 : 0.4) * Vec3(direction(random), direction(random), direction(random));
      EXPECT_LT(worst_difference(rows, evaluator.geo(middle) - 20 * step, step, 41, compared), 1e-6)
          << name << " times " << scale << ", seed " << kSeed << ", row " << i;
    }
  }
  EXPECT_GT(compared, 10000u);
}

TEST(RowInverter, FindsTheMaterialsThatSinglePointsHave) {
  expect_alike(1);
  expect_alike(0.01);
}

TEST(RowInverter, MarchesThroughASolidWithoutSearchingEachPoint) {
  ControlMesh mesh = oracle::box_mesh(4, 4, 4);
  oracle::sharpen_by_cells(mesh, 1);
  const auto solid = coordinate_solid(std::move(mesh));
  Rows rows(*solid);
  const SolvedRow& row = rows.solve(Vec3(0.01, 17, 23), Vec3(0.04, 0, 0), 999);
  const auto searched = std::count(row.points.begin(), row.points.end(), RowPoint::kFull);
  EXPECT_GE(searched, 4);
  EXPECT_LE(searched, 8);  // One on entering each of the four cells, or two.
  EXPECT_EQ(std::count(row.points.begin(), row.points.end(), RowPoint::kUnresolved), 0);
  EXPECT_LE(row.max_residual_mm, 1e-6);
  for (std::size_t k = 0; k < 999; ++k) {
    EXPECT_LT((Vec3::Map(&row.values[3 * k]) - Vec3(0.01 + 0.04 * static_cast<double>(k), 17, 23)).norm(), kAcceptedMm);
  }
}

TEST(RowInverter, FollowsAHint) {
  const auto solid = coordinate_solid(oracle::box_mesh(3, 3, 3));
  Rows rows(*solid);
  const Vec3 first(15, 15, 15), step(0.03, 0, 0);
  const std::optional<CellParam> at = rows.solve(first, step, 1).last;
  ASSERT_TRUE(at);
  EXPECT_EQ(rows.row.points[0], RowPoint::kFull);
  EXPECT_EQ(rows.solve(first, step, 2, at).points, std::vector(2, RowPoint::kCoherent));
}

TEST(RowInverter, SaysWhichPointsItDoesNotReach) {
  ControlMesh mesh = oracle::box_mesh(2, 2, 2);
  oracle::sharpen_by_cells(mesh, 1);
  const auto solid = coordinate_solid(std::move(mesh));
  Rows rows(*solid);
  const SolvedRow& row = rows.solve(Vec3(-1.9, 5, 5), Vec3(0.2, 0, 0), 120);
  for (std::uint32_t k = 0; k < 120; ++k) {
    const double x = -1.9 + 0.2 * k;
    EXPECT_EQ(row.points[k] == RowPoint::kUnresolved, x < 0 || x > 20) << x;
  }
  EXPECT_EQ(rows.solve(Vec3(100, 0, 0), Vec3(0.1, 0, 0), 5).last, std::nullopt);
}

TEST(RowInverter, GivesFoldedPlacesToTheLowestCell) {
  ControlMesh mesh = oracle::folding_box_mesh();
  mesh.allow_folds = true;
  const auto solid = prepare_solid(mesh);
  ASSERT_GT(solid->summary().folding_cells, 0u);
  Rows rows(*solid);
  const Vec3 point = solid->summary().folds.front().position, step(0.02, 0, 0);
  PointInverter alone(*solid);
  for (std::uint32_t k = 0; k < 20; ++k) {
    const auto expected = alone.invert(point + k * step);
    ASSERT_TRUE(expected);
    rows.solve(point, step, k + 1);
    ASSERT_TRUE(rows.row.last);
    EXPECT_EQ(rows.row.last->cell, expected->at.cell);
  }
}

TEST(RowInverter, TakesRowsOfOnePointAndOfNone) {
  const auto solid = coordinate_solid(oracle::box_mesh(3, 3, 3));
  Rows rows(*solid);
  EXPECT_TRUE(rows.solve(Vec3(15, 15, 15), Vec3(0.03, 0, 0), 0).points.empty());
  EXPECT_EQ(rows.solve(Vec3(15, 15, 15), Vec3(0, 0, 0), 3).points.size(), 3u);
  EXPECT_LT((Vec3::Map(&rows.row.values[6]) - Vec3(15, 15, 15)).norm(), kAcceptedMm);
}

}  // namespace
}  // namespace ccslice
