// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/inversion/point_inverter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/limit/boundary_surface.h"
#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

/// Two sharp boxes that share no vertex; the second, whose cells have the higher ids, lies `offset` from the first.
ControlMesh two_boxes(const Vec3& offset) {
  ControlMesh mesh = oracle::box_mesh(3, 3, 3);
  oracle::sharpen_by_cells(mesh, 1);
  oracle::append_mesh(mesh, ControlMesh(mesh), offset);
  return mesh;
}

TEST(PointInverter, FindsEveryEvaluatedPointOfTheCatalogue) {
  std::mt19937 random(21);
  std::uniform_real_distribution<double> u(0, 1), exponent(0, 20);
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    const auto solid = prepare_solid(mesh);
    PointInverter inverter(*solid);
    LimitEvaluator evaluator(*solid);
    std::uniform_int_distribution<std::uint32_t> cell(0, solid->cell_count() - 1);
    for (int i = 0; i < 300; ++i) {
      CellParam at{LimitCellId{cell(random)}, Vec3(u(random), u(random), u(random))};
      // Every third point lies beside a line, every ninth beside a corner.
      for (int a = 0; a < (i % 3 ? 0 : i % 9 ? 2 : 3); ++a) at.uvw[a] = std::exp2(-exponent(random));
      const Vec3 point = evaluator.geo(at);
      const auto found = inverter.invert(point);
      ASSERT_TRUE(found) << name << " cell " << at.cell << " at " << at.uvw.transpose();
      EXPECT_LE(found->residual_mm, 1e-6) << name << " cell " << at.cell << " at " << at.uvw.transpose();
      EXPECT_LE((evaluator.geo(found->at) - point).norm(), 1.01e-6) << name;
    }
  }
}

/// Random parameters beside a face of a cell, or beside two: 1/256 of it or less off.
class PlacesBesideFaces {
 public:
  PlacesBesideFaces(const LimitSolid& solid, double most_halvings, std::mt19937& random)
      : random_(random), cell_(0, solid.cell_count() - 1), exponent_(8, most_halvings) {}

  CellParam operator()(int i) {
    CellParam at{LimitCellId{cell_(random_)}, Vec3(u_(random_), u_(random_), u_(random_))};
    for (int k = 0; k <= i / 3 % 2; ++k) {
      const double distance = std::exp2(-exponent_(random_));
      at.uvw[(i + k) % 3] = i % 5 < 2 ? distance : 1 - distance;
    }
    return at;
  }

 private:
  std::mt19937& random_;
  std::uniform_int_distribution<std::uint32_t> cell_;
  std::uniform_real_distribution<double> u_{0, 1}, exponent_;
};

/// A parameter of the same cell a fifth of the way to its middle.
CellParam towards_middle(const CellParam& at) { return {at.cell, 0.2 * Vec3::Constant(0.5) + 0.8 * at.uvw}; }

// Nearer to a face between cells than a point may lie outside the solid: the nearest parameter in the cell behind the
// face won't do.
TEST(PointInverter, FindsPointsBesideFacesBetweenCells) {
  const auto solid = prepare_solid(make_engine());
  PointInverter inverter(*solid);
  LimitEvaluator evaluator(*solid);
  std::mt19937 random(7);
  PlacesBesideFaces places(*solid, 14, random);
  for (int i = 0; i < 4000; ++i) {
    const CellParam at = places(i);
    const auto found = inverter.invert(evaluator.geo(at));
    ASSERT_TRUE(found) << "cell " << at.cell << " at " << at.uvw.transpose();
    EXPECT_LE(found->residual_mm, 1e-6) << "cell " << at.cell << " at " << at.uvw.transpose();
  }
}

// Also from the other side of such a face, and beside the boundary.
TEST(PointInverter, FindsPointsBesideFacesFromHintsNearby) {
  const auto solid = prepare_solid(make_engine());
  PointInverter inverter(*solid);
  LimitEvaluator evaluator(*solid);
  std::mt19937 random(8);
  PlacesBesideFaces places(*solid, 24, random);
  std::uniform_real_distribution<double> offset(-0.05, 0.05);
  for (int i = 0; i < 4000; ++i) {
    const CellParam at = places(i);
    const Vec3 point = evaluator.geo(at);
    const auto hint = inverter.invert(point + Vec3(offset(random), offset(random), offset(random)));
    if (!hint) continue;
    const auto found = inverter.invert(point, hint->at);
    ASSERT_TRUE(found) << "cell " << at.cell << " at " << at.uvw.transpose();
    EXPECT_LE(found->residual_mm, 1e-6) << "cell " << at.cell << " at " << at.uvw.transpose();
  }
}

TEST(PointInverter, UsesAHintInTheSameCell) {
  ControlMesh mesh = oracle::box_mesh(3, 3, 3);
  oracle::sharpen_by_cells(mesh, 1);
  const auto solid = prepare_solid(mesh);
  PointInverter inverter(*solid);
  const auto first = inverter.invert(Vec3(15, 15, 15));
  ASSERT_TRUE(first);
  EXPECT_TRUE(first->full);
  const auto second = inverter.invert(Vec3(15.1, 15, 15), first->at);
  ASSERT_TRUE(second);
  EXPECT_FALSE(second->full);
  const auto third = inverter.invert(Vec3(25, 5, 15), first->at);
  ASSERT_TRUE(third);
  EXPECT_TRUE(third->full);
  EXPECT_NE(third->at.cell, first->at.cell);
}

TEST(PointInverter, TakesTheNearestParameterJustOutsideAndNothingFarther) {
  ControlMesh mesh = oracle::box_mesh(2, 2, 2);
  oracle::sharpen_by_cells(mesh, 1);
  const auto solid = prepare_solid(mesh);
  InversionOptions options;
  options.outside_mm = 0.01;
  PointInverter inverter(*solid, options);
  const auto near = inverter.invert(Vec3(-0.005, 5, 5));
  ASSERT_TRUE(near);
  EXPECT_NEAR(near->residual_mm, 0.005, 1e-9);
  EXPECT_FALSE(inverter.invert(Vec3(-0.02, 5, 5)));
  EXPECT_FALSE(inverter.invert(Vec3(1000, 5, 5)));
  EXPECT_FALSE(inverter.invert(Vec3(-0.02, 5, 5), near->at));
}

// Off a face the foot of the perpendicular is the answer, which a hint leads to without looking at other cells.
TEST(PointInverter, EndsAtTheFaceBelowAPointThatAHintLeadsTo) {
  constexpr double kOffMm = 1e-3;
  const auto solid = prepare_solid(make_engine());
  const BoundarySurface surface(*solid);
  PointInverter inverter(*solid), fresh(*solid);
  LimitEvaluator evaluator(*solid);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> u(0.1, 0.9);
  std::uniform_int_distribution<std::uint32_t> face(0, static_cast<std::uint32_t>(surface.faces().size() - 1));
  int quick = 0;
  for (int i = 0; i < 1000; ++i) {
    const BoundaryFaceId f{face(random)};
    const CellParam at = surface.cell_param(f, u(random), u(random));
    const LimitSample sample = evaluator.sample(at);
    const int axis = surface.faces()[f].cell_side / 2;
    Vec3 normal = sample.jacobian.col((axis + 1) % 3).cross(sample.jacobian.col((axis + 2) % 3)).normalized();
    if ((surface.faces()[f].cell_side % 2 == 0) != (sample.jacobian.determinant() < 0)) normal = -normal;
    const Vec3 point = sample.position + kOffMm * normal;
    const auto found = inverter.invert(point, towards_middle(at)), searched = fresh.invert(point);
    ASSERT_TRUE(found && searched) << "face " << f;
    EXPECT_NEAR(found->residual_mm, kOffMm, 1e-8) << "face " << f;
    EXPECT_LE((evaluator.geo(found->at) - evaluator.geo(searched->at)).norm(), 1e-6) << "face " << f;
    EXPECT_TRUE(found->full && searched->full);
    quick += 2 * found->newton_steps < searched->newton_steps;
  }
  EXPECT_GT(quick, 600);
}

// Touching, and so near to it that their boxes don't meet.
TEST(PointInverter, FindsWhatAnotherPartHoldsBeyondTheFaceThatAHintLeadsTo) {
  for (const double gap_mm : {0.0, 1e-7, 5e-4}) {
    const auto solid = prepare_solid(two_boxes(Vec3(30 + gap_mm, 0, 0)));
    PointInverter inverter(*solid);
    const auto hint = inverter.invert(Vec3(29, 14, 16));
    ASSERT_TRUE(hint);
    ASSERT_LT(hint->at.cell, 27u);
    const auto found = inverter.invert(Vec3(30.001, 14, 16), hint->at);
    ASSERT_TRUE(found);
    EXPECT_GE(found->at.cell, 27u) << gap_mm;
    EXPECT_LE(found->residual_mm, 1e-6) << gap_mm;
  }
}

// Off both of them.
TEST(PointInverter, TakesTheNearerFaceOfASlitWhateverTheHint) {
  const auto solid = prepare_solid(two_boxes(Vec3(30.0015, 0, 0)));
  PointInverter inverter(*solid);
  const auto first = inverter.invert(Vec3(29, 14, 16)), second = inverter.invert(Vec3(31, 14, 16));
  ASSERT_TRUE(first && second);
  for (const double off_mm : {1e-5, 5e-4, 1e-3, 1.49e-3}) {
    for (const CellParam& hint : {first->at, second->at}) {
      const auto found = inverter.invert(Vec3(30 + off_mm, 14, 16), hint);
      ASSERT_TRUE(found);
      EXPECT_EQ(found->at.cell >= 27u, off_mm > 0.75e-3) << off_mm << " from " << hint.cell;
      EXPECT_NEAR(found->residual_mm, std::min(off_mm, 1.5e-3 - off_mm), 1e-8) << off_mm << " from " << hint.cell;
    }
  }
}

// A U whose arms lean through each other.
TEST(PointInverter, FindsWhatAnotherArmHoldsBeyondTheFaceThatAHintLeadsTo) {
  ControlMesh mesh = oracle::box_mesh(7, 3, 8, 10, [](int x, int, int z) { return z < 2 || x != 3; });
  for (Vec3& p : mesh.positions) {
    const double lean = std::clamp((p.z() - 20) / 40, 0.0, 1.0);
    p.x() += p.x() < 35 ? 8 * lean : -8 * lean;
  }
  const auto solid = prepare_solid(mesh);
  ASSERT_EQ(solid->summary().folding_cells + solid->summary().undecided_cells, 0u);
  const BoundarySurface surface(*solid);
  PointInverter inverter(*solid), fresh(*solid);
  LimitEvaluator evaluator(*solid);
  std::mt19937 random(6);
  std::uniform_real_distribution<double> u(0, 1);
  std::uniform_int_distribution<std::uint32_t> face(0, static_cast<std::uint32_t>(surface.faces().size() - 1));
  int inside = 0;
  for (int i = 0; i < 4000; ++i) {
    const CellParam at = surface.cell_param(BoundaryFaceId{face(random)}, u(random), u(random));
    // A thousandth of a millimetre to some side: outside of the arm itself, half of the time.
    const Vec3 point = evaluator.geo(at) + 1e-3 * Vec3(u(random) - 0.5, u(random) - 0.5, u(random) - 0.5);
    const auto searched = fresh.invert(point);
    if (!searched || searched->residual_mm > 1e-6) continue;
    const auto found = inverter.invert(point, towards_middle(at));
    ASSERT_TRUE(found) << point.transpose();
    EXPECT_LE(found->residual_mm, 1e-6) << point.transpose();
    inside += found->at.cell != at.cell;
  }
  EXPECT_GT(inside, 50);
}

TEST(PointInverter, GivesFoldedPlacesToTheLowestCellWhateverTheHint) {
  ControlMesh mesh = oracle::folding_box_mesh();
  mesh.allow_folds = true;
  const auto solid = prepare_solid(mesh);
  ASSERT_GT(solid->summary().folding_cells, 0u);
  PointInverter inverter(*solid);
  const Vec3 point = solid->summary().folds.front().position;
  const auto plain = inverter.invert(point);
  ASSERT_TRUE(plain);
  for (const LimitCellId c : solid->cells()) {
    const auto hinted = inverter.invert(point, CellParam{c, Vec3::Constant(0.5)});
    ASSERT_TRUE(hinted);
    EXPECT_EQ(hinted->at.cell, plain->at.cell);
    EXPECT_LT((hinted->at.uvw - plain->at.uvw).norm(), 1e-12) << "another of its parameters";
  }
}

TEST(PointInverter, GivesOverlapsOfAPartToItsLowestCellWhateverTheHint) {
  const auto solid = prepare_solid(oracle::spiral(-0.3));
  ASSERT_EQ(solid->summary().folding_cells + solid->summary().undecided_cells, 0u);
  PointInverter inverter(*solid);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> part(0, 1);
  for (int i = 0; i < 300; ++i) {
    // The first turn's outer radius is 5 mm and 0.7 mm more a turn. The second turn begins 0.3 mm further in.
    const double turn = 0.1 + 0.8 * part(random), angle = 2 * std::numbers::pi * turn;
    const double radius = 5 + 0.7 * turn - 0.15 + 0.2 * (part(random) - 0.5);
    const Vec3 point(radius * std::cos(angle), radius * std::sin(angle), 0.7 + 0.6 * part(random));
    const auto plain = inverter.invert(point);
    ASSERT_TRUE(plain);
    EXPECT_LT(plain->at.cell, solid->cell_count() / 2) << "of the first turn";
    for (const std::uint32_t step : {0u, solid->cell_count() / 2}) {
      const LimitCellId near{(plain->at.cell + step) % solid->cell_count()};
      const auto hinted = inverter.invert(point, CellParam{near, Vec3(plain->at.uvw)});
      ASSERT_TRUE(hinted);
      EXPECT_EQ(hinted->at.cell, plain->at.cell);
      EXPECT_LT((hinted->at.uvw - plain->at.uvw).norm(), 1e-6);
    }
  }
}

TEST(PointInverter, GivesOverlapsToThePartWithTheLowestCellWhateverTheHint) {
  const auto solid = prepare_solid(two_boxes(Vec3(13, 14, 12)));
  ASSERT_EQ(solid->summary().folding_cells + solid->summary().undecided_cells, 0u);
  PointInverter inverter(*solid);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> u(0, 1);
  const auto place = [&] { return 0.25 + 0.5 * static_cast<double>(random() % 86); };  // A quarter off all faces.
  for (int i = 0; i < 3000; ++i) {
    const Vec3 point(place(), place(), place());
    const bool in_first = (point.array() < 30).all();
    const bool in_second =
        ((point - Vec3(13, 14, 12)).array() > 0).all() && ((point - Vec3(13, 14, 12)).array() < 30).all();
    const CellParam hint{LimitCellId{static_cast<std::uint32_t>(random() % 54)}, Vec3(u(random), u(random), u(random))};
    const auto found = inverter.invert(point, hint);
    ASSERT_EQ(found.has_value(), in_first || in_second) << point.transpose();
    if (!found) continue;
    EXPECT_EQ(found->at.cell < 27, in_first) << point.transpose() << " from cell " << hint.cell;
    EXPECT_LE(found->residual_mm, 1e-6);
  }
}

TEST(PointInverter, StandsPointsThatArentFinite) {
  const auto solid = prepare_solid(oracle::box_mesh(2, 2, 2));
  PointInverter inverter(*solid);
  EXPECT_FALSE(inverter.invert(Vec3(std::nan(""), 0, 0)));
  EXPECT_FALSE(inverter.invert(Vec3(0, INFINITY, 0)));
}

/// All over the solid's box and a little beyond; every fourth in the solid, or within the distance that counts as
/// outside of it, or beside a line or a corner of its cells.
std::vector<Vec3> scattered_points(const LimitSolid& solid, double outside_mm, int count, std::mt19937& random) {
  LimitEvaluator evaluator(solid);
  std::uniform_real_distribution<double> share(-0.05, 1.05), u(0, 1), exponent(0, 20), off(-outside_mm, outside_mm);
  const Box3& box = solid.summary().bounding_box;
  std::vector<Vec3> points;
  for (int i = 0; i < count; ++i) {
    if (i % 4) {
      points.emplace_back(box.min() + Vec3(share(random), share(random), share(random)).cwiseProduct(box.sizes()));
      continue;
    }
    CellParam at{LimitCellId{static_cast<std::uint32_t>(random() % solid.cell_count())},
                 Vec3(u(random), u(random), u(random))};
    for (int a = 0; a < i / 4 % 4; ++a) at.uvw[a] = std::exp2(-exponent(random));
    points.emplace_back(evaluator.geo(at) + Vec3(off(random), off(random), off(random)));
  }
  return points;
}

void expect_batch_equals_one_by_one(const ControlMesh& mesh, const std::string& name, int count) {
  constexpr unsigned kSeed = 23;
  std::mt19937 random(kSeed);
  const auto solid = prepare_solid(mesh);
  InversionOptions options;
  const std::vector<Vec3> points = scattered_points(*solid, options.outside_mm, count, random);
  PointInverter one_by_one(*solid, options);
  std::vector<std::optional<InversionResult>> expected;
  for (const Vec3& point : points) expected.push_back(one_by_one.invert(point));
  for (const bool proves : {false, true}) {
    options.proves_outside = proves;
    PointInverter inverter(*solid, options);
    std::vector<std::optional<InversionResult>> found(points.size());
    inverter.invert(points, [&](std::size_t p, const InversionResult& result) { found[p] = result; }, {});
    for (std::size_t p = 0; p < points.size(); ++p) {
      ASSERT_EQ(found[p].has_value(), expected[p].has_value()) << name << ", seed " << kSeed << ", point " << p;
      if (!found[p]) continue;
      EXPECT_EQ(found[p]->at.cell, expected[p]->at.cell) << name << ", seed " << kSeed << ", point " << p;
      EXPECT_EQ(found[p]->at.uvw, expected[p]->at.uvw) << name << ", seed " << kSeed << ", point " << p;
      EXPECT_EQ(found[p]->residual_mm, expected[p]->residual_mm) << name << ", seed " << kSeed << ", point " << p;
    }
  }
}

TEST(PointInverter, ABatchIsWhatItsPointsAreOneByOne) {
  for (const auto& [name, mesh] : oracle::tiny_meshes()) expect_batch_equals_one_by_one(mesh, name, 120);
  expect_batch_equals_one_by_one(make_engine(), "engine", 4000);
  expect_batch_equals_one_by_one(make_coyote(), "coyote", 2000);
}

TEST(PointInverter, ABatchIsWhatItsPointsAreNearFoldsAndOverlaps) {
  ControlMesh folding = oracle::folding_box_mesh();
  folding.allow_folds = true;
  expect_batch_equals_one_by_one(folding, "folding box", 1000);
  expect_batch_equals_one_by_one(two_boxes(Vec3(5, 5, 5)), "two boxes", 1000);
}

constexpr unsigned kCrowdSeed = 27;

/// 512 cells, more than 50 of which fold.
std::shared_ptr<const LimitSolid> folding_crowd() {
  ControlMesh mesh = oracle::box_mesh(8, 8, 8);
  oracle::jitter(mesh, 11, kCrowdSeed);
  mesh.allow_folds = true;
  return prepare_solid(mesh);
}

// Within the whole size of the part all cells count as near: far too many to be searched.
TEST(PointInverter, FindsTheCellThatHoldsAPointNearFoldsWhereAllComeNear) {
  std::mt19937 random(kCrowdSeed);
  const auto solid = folding_crowd();
  ASSERT_GT(solid->summary().folding_cells, 50u);
  PointInverter near(*solid, {.outside_mm = 1e-4});
  PointInverter far(*solid, {.outside_mm = solid->summary().bounding_box.diagonal().norm()});
  LimitEvaluator evaluator(*solid);
  std::uniform_real_distribution<double> u(0, 1);
  const auto random_place = [&] {
    return CellParam{LimitCellId{static_cast<std::uint32_t>(random() % solid->cell_count())},
                     Vec3(u(random), u(random), u(random))};
  };
  for (int i = 0; i < 300; ++i) {
    const Vec3 point = evaluator.geo(random_place());
    const auto expected = near.invert(point);
    ASSERT_TRUE(expected) << i;
    for (const auto& found : {far.invert(point), far.invert(point, random_place()), far.invert(point, expected->at)}) {
      ASSERT_TRUE(found) << i;
      EXPECT_LE(found->residual_mm, 1e-6) << i;
      EXPECT_EQ(found->at.cell, expected->at.cell) << i;
    }
  }
}

TEST(PointInverter, TakesAPlaceJustBelowAPointOffASolidThatFoldsWhereAllCellsComeNear) {
  constexpr double kOffMm = 0.3;
  std::mt19937 random(kCrowdSeed);
  const auto solid = folding_crowd();
  PointInverter far(*solid, {.outside_mm = solid->summary().bounding_box.diagonal().norm()});
  LimitEvaluator evaluator(*solid);
  std::uniform_real_distribution<double> u(0, 1);
  int tried = 0;
  for (const LimitCellId cell : solid->cells()) {
    for (int side = 0; side < 6; ++side) {
      if (!(solid->boundary_sides(cell) >> side & 1)) continue;
      Vec3 uvw(u(random), u(random), u(random));
      uvw[side / 2] = side % 2;
      const LimitSample sample = evaluator.sample({cell, uvw});
      const Vec3 across = sample.jacobian.col((side / 2 + 1) % 3).cross(sample.jacobian.col((side / 2 + 2) % 3));
      const Vec3 point = sample.position + (side % 2 == 1 ? kOffMm : -kOffMm) * across.normalized();
      const auto found = far.invert(point);
      ASSERT_TRUE(found) << cell;
      // Newton's method may stop at a side of the cell that isn't the nearest place of it.
      EXPECT_LE(found->residual_mm, 2 * kOffMm) << "cell " << cell << ", side " << side;
      ++tried;
    }
  }
  EXPECT_GT(tried, 300);
}

TEST(PointInverter, ABatchStopsWhenCancelled) {
  const auto solid = prepare_solid(make_box());
  PointInverter inverter(*solid);
  const CancellationToken cancel = CancellationToken::make();
  cancel.cancel();
  const std::vector<Vec3> points(3, Vec3(5, 5, 5));
  EXPECT_THROW(inverter.invert(
                   points, [](std::size_t, const InversionResult&) {}, cancel),
               Error);
}

}  // namespace
}  // namespace ccslice
