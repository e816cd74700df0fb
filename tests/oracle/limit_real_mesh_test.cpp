// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Limit evaluation against brute force on real meshes: up to a thousand seeded cells of each class, by their one-rings.

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/oracle/descents.h"
#include "tests/oracle/real_meshes.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::oracle {
namespace {

constexpr double kTolerance = 1e-9;
constexpr std::size_t kCellsPerClass = 1000, kSharpCellsPerClass = 200;
constexpr int kLevels = 5;
constexpr std::uint32_t kSeed = 20190801;

/// By class of the cell: cells looked at, errors met.
struct ClassErrors {
  std::array<std::size_t, 3> cells{};
  std::array<WorstError, 3> worst;
};

ClassErrors compare_every_class(const Subject& subject, std::size_t most_cells) {
  LimitEvaluator evaluator(subject.solid());
  std::mt19937 random(kSeed);
  std::vector<LimitCellId> cells = subject.solid().cells().to_vector();
  std::shuffle(cells.begin(), cells.end(), random);
  ClassErrors errors;
  for (const LimitCellId cell : cells) {
    const auto kind = static_cast<std::size_t>(subject.solid().cell_class(cell));
    if (errors.cells[kind] >= most_cells) continue;
    const bool irregular_end = errors.cells[kind]++ % 25 == 0;
    compare_on_descent(subject, evaluator, cell, random_descent(random, kLevels, irregular_end), random,
                       errors.worst[kind]);
  }
  return errors;
}

void expect_small(const ClassErrors& errors) {
  for (std::size_t kind = 0; kind < 3; ++kind) {
    EXPECT_LT(errors.worst[kind].position, kTolerance) << "class " << kind << " at " << errors.worst[kind].position_at;
    EXPECT_LT(errors.worst[kind].channel, kTolerance) << "class " << kind << " at " << errors.worst[kind].channel_at;
  }
}

class RealMesh : public testing::TestWithParam<std::string> {};

TEST_P(RealMesh, LimitAgreesWithBruteForceInEveryClassOfCells) {
  const auto mesh = read_real_mesh(GetParam());
  if (!mesh) GTEST_SKIP() << GetParam() << " isn't in " << CCSLICE_SHARED_MESHES_DIR;
  const ClassErrors errors = compare_every_class(Subject(*mesh), kCellsPerClass);
  expect_small(errors);
  for (std::size_t kind = 0; kind < 3; ++kind) {
    const std::string name = "class_" + std::to_string(kind);
    RecordProperty(name + "_cells", static_cast<int>(errors.cells[kind]));
    RecordProperty(name + "_samples", static_cast<int>(errors.worst[kind].samples));
    RecordProperty(name + "_worst_position",
                   std::to_string(errors.worst[kind].position * 1e12) + "e-12 of the diagonal");
    RecordProperty(name + "_worst_channel", std::to_string(errors.worst[kind].channel * 1e12) + "e-12 of the range");
  }
}

class SharpRealMesh : public testing::TestWithParam<std::string> {};

TEST_P(SharpRealMesh, LimitAgreesWithBruteForce) {
  std::optional<ControlMesh> mesh = read_real_mesh(GetParam());
  if (!mesh) GTEST_SKIP() << GetParam() << " isn't in " << CCSLICE_SHARED_MESHES_DIR;
  sharpen_by_cells(*mesh, 1);
  ASSERT_FALSE(mesh->sharp_edges.empty());
  expect_small(compare_every_class(Subject(*mesh), kSharpCellsPerClass));
}

INSTANTIATE_TEST_SUITE_P(Samples, RealMesh, testing::ValuesIn(sample_names()),
                         [](const auto& info) { return case_name(info.param); });

INSTANTIATE_TEST_SUITE_P(Fixtures, RealMesh, testing::ValuesIn(fixture_names()),
                         [](const auto& info) { return case_name(info.param); });

INSTANTIATE_TEST_SUITE_P(Shared, RealMesh, testing::ValuesIn(small_real_mesh_names()),
                         [](const auto& info) { return case_name(info.param); });

INSTANTIATE_TEST_SUITE_P(NightlyShared, RealMesh, testing::ValuesIn(real_mesh_names()),
                         [](const auto& info) { return case_name(info.param); });

INSTANTIATE_TEST_SUITE_P(Shared, SharpRealMesh, testing::ValuesIn(small_real_mesh_names()),
                         [](const auto& info) { return case_name(info.param); });

INSTANTIATE_TEST_SUITE_P(NightlyShared, SharpRealMesh, testing::ValuesIn(real_meshes_with_convex_edges()),
                         [](const auto& info) { return case_name(info.param); });

}  // namespace
}  // namespace ccslice::oracle
