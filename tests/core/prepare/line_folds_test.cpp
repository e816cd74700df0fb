// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/line_folds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "core/limit/limit_evaluator.h"
#include "core/limit/patch_path.h"
#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

constexpr int kSamples = 64;

/// The place of a cell at framed coordinates: its irregular line along the third axis, its vertex at the origin.
CellParam framed(const LimitCell& cell, LimitCellId number, const Vec3& at) {
  CellParam result{number, Vec3::Zero()};
  for (Eigen::Index a = 0; a < 3; ++a) {
    const auto b = cell.frame.axis[static_cast<std::size_t>(a)];
    result.uvw[b] = cell.frame.origin >> b & 1 ? 1 - at[a] : at[a];
  }
  return result;
}

/// det J of the cell at w along its line, in the direction and at the level that LineFolds looks at.
double determinant_at(const LimitCell& cell, LimitCellId number, double w, LimitEvaluator& evaluator) {
  const double beside = std::ldexp(0.75, -LineFolds::kLevels);
  return evaluator.sample(framed(cell, number, {beside, beside, w})).jacobian.determinant();
}

/// det J / (|J_u| |J_v| |J_w|), the smallest one met at distances 1 to 2^-30 from the cell's line, or from every pair
/// of the axes that meet in its vertex, in many directions: as far as it is beyond what doubles make of it.
double least_sampled(const LimitCell& cell, LimitCellId number, LimitEvaluator& evaluator) {
  double least = 1;
  const auto look = [&](const Vec3& at) {
    const Mat3 j = evaluator.sample(framed(cell, number, at)).jacobian;
    const double value = j.determinant() / j.colwise().norm().prod();
    std::array<double, 3> sorted = {at[0], at[1], at[2]};
    std::sort(sorted.begin(), sorted.end());
    const double off = cell.cell_class == CellClass::kLine ? std::max(at[0], at[1]) : sorted[1];
    if (value < -1e-6 - 1e-13 / off) least = std::min(least, value);
  };
  const bool is_line = cell.cell_class == CellClass::kLine;
  for (int halvings = 0; halvings <= (is_line ? 30 : 20); ++halvings) {
    const double r = std::ldexp(1, -halvings);
    for (int direction = 0; direction <= 8; ++direction) {
      const double u = r * std::min(1.0, (8 - direction) / 4.0), v = r * std::min(1.0, direction / 4.0);
      for (int k = 0; k <= 6; ++k) {
        if (is_line) look({u, v, k / 6.0});
        const double w = std::ldexp(1, -2 * k);
        if (!is_line) look({u, v, w}), look({u, w, v}), look({w, u, v});
      }
    }
  }
  return least;
}

/// Calls visit(finding, least determinant sampled, largest one) for each line cell.
template <typename Visit>
void for_each_line_cell(const LimitSolid& solid, LineFolds::Views views, Visit visit) {
  LimitEvaluator evaluator(solid);
  PatchBuilder builder(solid.data(), kPositionDimension);
  LineFolds folds(solid.data());
  for (const LimitCellId c : solid.cells()) {
    const LimitCell& cell = solid.data().cells[c];
    if (cell.cell_class != CellClass::kLine) continue;
    FoldFinding finding;
    builder.visit_patches(
        cell, 0, 0, [](const PatchPath&, double*) {},
        [&](const PatchRest& rest) { finding = folds.examine(rest.op, rest.points, views); });
    double least = determinant_at(cell, c, 0, evaluator), most = least;
    for (int i = 1; i <= kSamples; ++i) {
      const double sampled = determinant_at(cell, c, static_cast<double>(i) / kSamples, evaluator);
      least = std::min(least, sampled), most = std::max(most, sampled);
    }
    visit(finding, least, most);
  }
}

TEST(LineFolds, AgreesWithTheEvaluatorOnTheCatalogue) {
  std::size_t cells = 0;
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    for_each_line_cell(*prepare_solid(mesh), LineFolds::Views::kFirst,
                       [&](const FoldFinding& finding, double least, double most) {
                         ++cells;
                         EXPECT_EQ(finding.verdict, FoldVerdict::kUnfolded) << name;
                         EXPECT_GT(least, 0) << name;
                         EXPECT_GE(finding.determinant, least - 5e-3 * most) << name;
                         EXPECT_LE(finding.determinant, most * (1 + 5e-3)) << name;
                       });
  }
  EXPECT_GT(cells, 500u);
}

// Points of an extraordinary edge are moved along it, until it turns back on itself.
TEST(LineFolds, FindsLinesThatTurnBack) {
  constexpr unsigned kSeed = 3;
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> share(-2, 2);
  int folded = 0, unfolded = 0;
  for (int i = 0; i < 40; ++i) {
    ControlMesh mesh = oracle::fan_mesh(5, 2, 6);
    mesh.allow_folds = true;
    double height = 0;
    for (const Vec3& p : mesh.positions) height = std::max(height, p.z());
    for (Vec3& p : mesh.positions) {
      if (std::hypot(p.x(), p.y()) < 1e-9 && p.z() > 0 && p.z() < height) p.z() += share(random) * height / 6;
    }
    for_each_line_cell(*prepare_solid(mesh), LineFolds::Views::kFirst,
                       [&](const FoldFinding& finding, double least, double most) {
                         if (std::abs(least) < 1e-3 * most) return;
                         (least < 0 ? folded : unfolded) += 1;
                         EXPECT_EQ(finding.verdict, least < 0 ? FoldVerdict::kFolds : FoldVerdict::kUnfolded)
                             << "seed " << kSeed << ", mesh " << i << ": " << least;
                         EXPECT_EQ(finding.determinant < 0, least < 0);
                       });
  }
  EXPECT_GT(folded, 20);
  EXPECT_GT(unfolded, 100);
}

/// Cells that fold by dense samples, and how many cells are reported or undecided.
std::size_t count_sampled(const LimitSolid& solid) {
  LimitEvaluator evaluator(solid);
  std::size_t count = 0;
  for (const LimitCellId c : solid.cells()) {
    const LimitCell& cell = solid.data().cells[c];
    if (cell.cell_class == CellClass::kRegular || least_sampled(cell, c, evaluator) > 0) continue;
    ++count;
    const Box3 box = solid.data().cell_boxes.box(c);
    EXPECT_TRUE(solid.data().fold_boxes.any_meeting(
        box, [&](std::uint32_t item) { return solid.data().fold_boxes.box(item).isApprox(box); }))
        << "cell " << c;
  }
  return count;
}

// det J goes to minus infinity along a sharp edge with two cells that is reentrant, like the logarithm of the distance.
TEST(LineFolds, FindsEveryCellThatFoldsBesideASharpEdge) {
  std::size_t sampled = 0;
  for (const int cells : {2, 3}) {
    for (const double degrees : {90.0, 150.0, 200.0, 230.0, 270.0, 320.0}) {
      constexpr unsigned kSeed = 7;
      SCOPED_TRACE(std::to_string(cells) + " cells, " + std::to_string(degrees) + " degrees, seed 7");
      sampled += count_sampled(*prepare_solid(oracle::sharp_fan(cells, degrees, kSeed)));
    }
  }
  sampled += count_sampled(*prepare_solid(oracle::crossed_valleys()));
  EXPECT_GT(sampled, 60u);
}

TEST(LineFolds, LeavesConvexSharpEdgesAlone) {
  ControlMesh mesh = oracle::box_mesh(4, 4, 2, 10);
  oracle::sharpen(mesh, [](const Vec3& a, const Vec3& b) { return a.z() == 20 && b.z() == 20 && a.x() == b.x(); });
  for (Vec3& p : mesh.positions) p.z() -= 0.1 * (p.x() - 20) * (p.x() - 20) / 10;
  int cells = 0;
  for_each_line_cell(*prepare_solid(mesh), LineFolds::Views::kAll, [&](const FoldFinding& finding, double, double) {
    ++cells;
    EXPECT_EQ(finding.verdict, FoldVerdict::kUnfolded);
  });
  EXPECT_GT(cells, 20);
}

}  // namespace
}  // namespace ccslice
