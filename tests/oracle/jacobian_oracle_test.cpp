// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The Jacobian against finite differences of geo.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "tests/oracle/real_meshes.h"
#include "tests/oracle/subject.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::oracle {
namespace {

/// Thick near 0 and 1, where irregular lines and vertices are.
double random_coordinate(std::mt19937& random) {
  const double depth = std::uniform_real_distribution<double>(1, 8)(random);
  return random() % 2 ? std::exp2(-depth) : 1 - std::exp2(-depth);
}

/// Central differences of fourth order, with steps that are short against the distance from the cell's borders.
Mat3 finite_differences(LimitEvaluator& evaluator, const CellParam& at) {
  const double h = 1e-3 * std::min(at.uvw.minCoeff(), 1 - at.uvw.maxCoeff());
  Mat3 result;
  for (int d = 0; d < 3; ++d) {
    const auto shifted = [&](double steps) { return evaluator.geo({at.cell, at.uvw + steps * h * Vec3::Unit(d)}); };
    result.col(d) = (8 * (shifted(1) - shifted(-1)) - (shifted(2) - shifted(-2))) / (12 * h);
  }
  return result;
}

class Jacobian : public testing::TestWithParam<std::size_t> {};

void expect_finite_differences(const Subject& subject, LimitEvaluator& evaluator, LimitCellId cell, int samples,
                               std::mt19937& random) {
  for (int i = 0; i < samples; ++i) {
    const CellParam at{cell, Vec3(random_coordinate(random), random_coordinate(random), random_coordinate(random))};
    const LimitSample sample = evaluator.sample(at);
    EXPECT_LT((sample.position - evaluator.geo(at)).norm(), 1e-12 * subject.diagonal_mm());
    const Mat3 difference = sample.jacobian - finite_differences(evaluator, at);
    ASSERT_LT(difference.norm(), 1e-5 * sample.jacobian.norm()) << to_text(at);
  }
}

TEST_P(Jacobian, AgreesWithFiniteDifferences) {
  const Subject subject(tiny_meshes()[GetParam()].mesh);
  LimitEvaluator evaluator(subject.solid());
  std::mt19937 random(static_cast<std::uint32_t>(GetParam()));
  const int samples = std::max(4, 1500 / static_cast<int>(subject.solid().cell_count()));
  for (const LimitCellId cell : subject.solid().cells()) {
    expect_finite_differences(subject, evaluator, cell, samples, random);
  }
}

TEST_P(Jacobian, IsFiniteOnTheBordersOfCells) {
  const Subject subject(tiny_meshes()[GetParam()].mesh);
  LimitEvaluator evaluator(subject.solid());
  const std::array<double, 5> values = {0, 0x1p-40, 0.5, 1 - 0x1p-40, 1};
  const std::uint32_t stride = subject.solid().cell_count() / 40 + 1;
  for (LimitCellId cell; cell < subject.solid().cell_count(); cell += stride) {
    for (const double u : values) {
      for (const double v : values) {
        for (const double w : values) {
          const LimitSample sample = evaluator.sample({cell, {u, v, w}});
          EXPECT_TRUE(sample.position.allFinite() && sample.jacobian.allFinite())
              << cell << " " << u << " " << v << " " << w;
        }
      }
    }
  }
}

class RealJacobian : public testing::TestWithParam<std::string> {};

TEST_P(RealJacobian, AgreesWithFiniteDifferences) {
  const std::optional<ControlMesh> mesh = read_real_mesh(GetParam());
  if (!mesh) GTEST_SKIP() << GetParam() << " isn't in " << CCSLICE_SHARED_MESHES_DIR;
  const Subject subject(*mesh);
  LimitEvaluator evaluator(subject.solid());
  std::mt19937 random(5);
  std::map<CellClass, std::vector<LimitCellId>> cells;
  for (const LimitCellId cell : subject.solid().cells()) {
    cells[subject.solid().cell_class(cell)].push_back(cell);
  }
  for (auto& [cell_class, of_class] : cells) {
    std::shuffle(of_class.begin(), of_class.end(), random);
    of_class.resize(std::min<std::size_t>(of_class.size(), 300));
    for (const LimitCellId cell : of_class) expect_finite_differences(subject, evaluator, cell, 4, random);
  }
}

INSTANTIATE_TEST_SUITE_P(Samples, RealJacobian, testing::ValuesIn(sample_names()),
                         [](const auto& info) { return case_name(info.param); });

INSTANTIATE_TEST_SUITE_P(Shared, RealJacobian, testing::ValuesIn(real_mesh_names()),
                         [](const auto& info) { return case_name(info.param); });

INSTANTIATE_TEST_SUITE_P(TinyMeshes, Jacobian, testing::Range<std::size_t>(0, tiny_meshes().size()),
                         [](const auto& info) { return tiny_meshes()[info.param].name; });

}  // namespace
}  // namespace ccslice::oracle
