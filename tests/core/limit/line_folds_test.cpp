// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/line_folds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "core/limit/limit_evaluator.h"
#include "core/limit/patch_path.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

constexpr int kSamples = 64;

/// det J of the cell at w along its line, in the direction and at the level that LineFolds looks at.
double determinant_at(const LimitCell& cell, std::uint32_t number, double w, LimitEvaluator& evaluator) {
  const double beside = std::ldexp(0.75, -LineFolds::kLevels);
  const std::array<double, 3> framed = {beside, beside, w};
  CellParam at{number, Vec3::Zero()};
  for (std::size_t a = 0; a < 3; ++a) {
    const auto b = cell.frame.axis[a];
    at.uvw[b] = cell.frame.origin >> b & 1 ? 1 - framed[a] : framed[a];
  }
  return evaluator.sample(at).jacobian.determinant();
}

/// Calls visit(finding, least determinant sampled, largest one) for each line cell.
template <typename Visit>
void for_each_line_cell(const LimitSolid& solid, Visit visit) {
  LimitEvaluator evaluator(solid);
  PatchBuilder builder(solid.data(), kPositionDimension);
  LineFolds folds(solid.data());
  for (std::uint32_t c = 0; c < solid.cell_count(); ++c) {
    const LimitCell& cell = solid.data().cells[c];
    if (cell.cell_class != CellClass::kLine) continue;
    FoldFinding finding;
    builder.visit_patches(
        cell, 0, 0, [](const PatchPath&, double*) {},
        [&](const PatchRest& rest) { finding = folds.examine(rest.op, rest.points); });
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
    for_each_line_cell(*LimitSolid::prepare(mesh), [&](const FoldFinding& finding, double least, double most) {
      ++cells;
      EXPECT_EQ(finding.verdict, FoldVerdict::kUnfolded) << name;
      EXPECT_GT(least, 0) << name;
      EXPECT_GE(finding.determinant, least - 1e-6 * most) << name;
      EXPECT_LE(finding.determinant, most * (1 + 1e-6)) << name;
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
    for_each_line_cell(*LimitSolid::prepare(mesh), [&](const FoldFinding& finding, double least, double most) {
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

}  // namespace
}  // namespace ccslice
