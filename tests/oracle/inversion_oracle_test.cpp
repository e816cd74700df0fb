// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Round trips: evaluate, invert, compare.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/inversion/point_inverter.h"
#include "core/limit/cell_index.h"
#include "tests/oracle/nearest_places.h"
#include "tests/oracle/real_meshes.h"
#include "tests/oracle/subject.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::oracle {
namespace {

/// How close a point must be found again: the inverter's own goal and rounding. It holds beside convex corners of the
/// part too, where det J falls like r^2.2.
constexpr double kAcceptMm = 1.01e-6;

struct RoundTrips {
  std::array<std::size_t, 3> tried{}, lost{};  // By class of the cell.
  double worst_residual_mm = 0, worst_channel = 0;
  std::string where;
};

/// A parameter at depth 2^-depth from a corner or edge of the cell, or anywhere inside.
Vec3 random_uvw(std::mt19937& random, double deepest) {
  const auto parameter = [&] {
    if (random() % 3 == 0) return std::uniform_real_distribution<double>(0, 1)(random);
    const double depth = std::uniform_real_distribution<double>(1, deepest)(random);
    return random() % 2 ? std::exp2(-depth) : 1 - std::exp2(-depth);
  };
  return {parameter(), parameter(), parameter()};
}

void round_trip(const Subject& subject, PointInverter& inverter, const CellParam& at,
                const std::optional<CellParam>& hint, RoundTrips& trips) {
  const auto kind = static_cast<std::size_t>(subject.solid().cell_class(at.cell));
  ++trips.tried[kind];
  const Vec3 point = inverter.evaluator().geo(at);
  const auto found = inverter.invert(point, hint);
  const double residual = found ? (inverter.evaluator().geo(found->at) - point).norm() : 1e30;
  if (residual > kAcceptMm) {
    ++trips.lost[kind];
    trips.where += to_text(at) + ", " + std::to_string(residual * 1e6) + " nm; ";
    return;
  }
  trips.worst_residual_mm = std::max(trips.worst_residual_mm, std::abs(residual - found->residual_mm));
  const std::size_t count = subject.solid().channel_count();
  std::array<double, kMaxStride> before{}, after{};
  inverter.evaluator().mat(at, {before.data(), count});
  inverter.evaluator().mat(found->at, {after.data(), count});
  for (std::size_t c = 0; c < count; ++c) {
    const double span = subject.solid().summary().channels[c].max - subject.solid().summary().channels[c].min;
    trips.worst_channel = std::max(trips.worst_channel, std::abs(before[c] - after[c]) / span);
  }
}

class Inversion : public testing::TestWithParam<std::size_t> {};

TEST_P(Inversion, FindsEveryPointAgain) {
  const Subject subject(tiny_meshes()[GetParam()].mesh);
  PointInverter inverter(subject.solid());
  std::mt19937 random(static_cast<std::uint32_t>(GetParam()));
  const std::uint32_t cells = subject.solid().cell_count();
  RoundTrips trips;
  for (int i = 0; i < 600; ++i) {
    const LimitCellId cell{static_cast<std::uint32_t>(random() % cells)};
    const bool deep = i % 4 == 0;
    const CellParam at{cell, random_uvw(random, deep ? 14 : 5)};
    std::optional<CellParam> hint;
    if (i % 3 == 1) hint = CellParam{LimitCellId{static_cast<std::uint32_t>(random() % cells)}, random_uvw(random, 3)};
    if (i % 3 == 2) hint = CellParam{cell, (at.uvw + 0.05 * random_uvw(random, 1)).cwiseMax(0).cwiseMin(1)};
    round_trip(subject, inverter, at, hint, trips);
  }
  EXPECT_EQ(trips.lost, (std::array<std::size_t, 3>{})) << trips.where;
  EXPECT_LT(trips.worst_residual_mm, 1e-9);
  if (subject.solid().summary().folding_cells == 0) {
    EXPECT_LT(trips.worst_channel, 1e-4);
  }
}

TEST_P(Inversion, FindsNothingFarOutside) {
  const Subject subject(tiny_meshes()[GetParam()].mesh);
  PointInverter inverter(subject.solid());
  const Box3 box = subject.solid().summary().bounding_box;
  for (int b = 0; b < 8; ++b) {
    const Vec3 corner = box.corner(static_cast<Box3::CornerType>(b));
    EXPECT_FALSE(inverter.invert(corner + 0.1 * (corner - box.center()))) << b;
  }
}

/// Voxels may lie off the solid by what contours may. Beside smooth edges with one hexahedron a parameter within a
/// micrometre of the point may be a hundredth of a cell off the nearest one.
TEST_P(Inversion, FindsTheNearestPlaceOfPointsJustOffTheSolid) {
  const Subject subject(tiny_meshes()[GetParam()].mesh);
  const LimitSolid& solid = subject.solid();
  constexpr double kOutsideMm = 2e-3;
  PointInverter inverter(solid, {.outside_mm = kOutsideMm});
  LimitEvaluator evaluator(solid);
  std::mt19937 random(static_cast<std::uint32_t>(GetParam()));
  std::size_t tried = 0;
  for (int i = 0; i < 1000 && tried < 60; ++i) {
    CellParam at{LimitCellId{static_cast<std::uint32_t>(random() % solid.cell_count())}, random_uvw(random, 9)};
    const auto side = static_cast<int>(random() % 6);
    if (!(solid.boundary_sides(at.cell) >> side & 1)) continue;
    at.uvw[side / 2] = side % 2;
    const LimitSample sample = evaluator.sample(at);
    const Vec3 across = sample.jacobian.col((side / 2 + 1) % 3).cross(sample.jacobian.col((side / 2 + 2) % 3));
    const double off_mm = std::exp2(-std::uniform_real_distribution<double>(10, 17)(random));
    const Vec3 point = sample.position + (side % 2 == 1 ? off_mm : -off_mm) * across.normalized();
    if (solid.index().fold_boxes.any_at(point, kOutsideMm)) continue;  // The lowest cell wins there.
    const std::vector<NearPlace> places = nearest_places(evaluator, point, off_mm);
    if (places.front().distance_mm < 2 * kAcceptMm) continue;  // Another part of the solid is there.
    ++tried;
    const std::optional<CellParam> hint = i % 2 == 0 ? std::nullopt : std::optional(at);
    const auto found = inverter.invert(point, hint);
    ASSERT_TRUE(found) << to_text(at);
    EXPECT_LE(found->residual_mm, places.front().distance_mm + 1e-7 * off_mm) << to_text(at);
    const double apart_mm = (evaluator.geo(found->at) - places.front().position).norm();
    const bool is_rival = std::ranges::any_of(places, [&](const NearPlace& other) {
      return other.distance_mm < places[0].distance_mm + 1e-7 * off_mm &&
             (other.position - places[0].position).norm() > 1e-2 * off_mm;
    });
    EXPECT_TRUE(apart_mm < 1e-2 * off_mm || is_rival) << to_text(at) << ": " << apart_mm << " mm of " << off_mm;
  }
  if (solid.summary().folding_cells == 0) {
    EXPECT_GT(tried, 20u);
  }
}

INSTANTIATE_TEST_SUITE_P(TinyMeshes, Inversion, testing::Range<std::size_t>(0, tiny_meshes().size()),
                         [](const auto& info) { return tiny_meshes()[info.param].name; });

class RealInversion : public testing::TestWithParam<std::string> {};

TEST_P(RealInversion, FindsEveryPointAgain) {
  const auto mesh = read_real_mesh(GetParam());
  if (!mesh) GTEST_SKIP() << GetParam() << " isn't in " << CCSLICE_SHARED_MESHES_DIR;
  const Subject subject(*mesh);
  PointInverter inverter(subject.solid());
  std::mt19937 random(3);
  RoundTrips trips;
  std::array<std::vector<LimitCellId>, 3> cells;
  for (const LimitCellId cell : subject.solid().cells()) {
    cells[static_cast<std::size_t>(subject.solid().cell_class(cell))].push_back(cell);
  }
  for (const std::vector<LimitCellId>& of_class : cells) {
    for (int i = 0; i < 600 && !of_class.empty(); ++i) {
      round_trip(subject, inverter, {of_class[random() % of_class.size()], random_uvw(random, 8)}, std::nullopt, trips);
    }
  }
  for (int kind = 0; kind < 3; ++kind) {
    RecordProperty("class_" + std::to_string(kind),
                   std::to_string(trips.lost[kind]) + " of " + std::to_string(trips.tried[kind]));
  }
  EXPECT_EQ(trips.lost, (std::array<std::size_t, 3>{})) << trips.where;
}

INSTANTIATE_TEST_SUITE_P(Samples, RealInversion, testing::ValuesIn(sample_names()),
                         [](const auto& info) { return case_name(info.param); });

INSTANTIATE_TEST_SUITE_P(Fixtures, RealInversion, testing::ValuesIn(fixture_names()),
                         [](const auto& info) { return case_name(info.param); });

INSTANTIATE_TEST_SUITE_P(Shared, RealInversion, testing::ValuesIn(real_mesh_names()),
                         [](const auto& info) { return case_name(info.param); });

}  // namespace
}  // namespace ccslice::oracle
