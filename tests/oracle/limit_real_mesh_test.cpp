// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Limit evaluation against brute force on real meshes: up to a thousand seeded cells of each class, by their one-rings.

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "tests/oracle/descents.h"
#include "tests/oracle/real_meshes.h"

namespace ccslice::oracle {
namespace {

constexpr double kTolerance = 1e-9;
constexpr std::size_t kCellsPerClass = 1000;
constexpr int kLevels = 5;
constexpr std::uint32_t kSeed = 20190801;

class RealMesh : public testing::TestWithParam<std::string> {};

TEST_P(RealMesh, LimitAgreesWithBruteForceInEveryClassOfCells) {
  const auto mesh = read_real_mesh(GetParam());
  if (!mesh) GTEST_SKIP() << GetParam() << " isn't in " << CCSLICE_SHARED_MESHES_DIR;
  const Subject subject(*mesh);
  LimitEvaluator evaluator(subject.solid());
  std::mt19937 random(kSeed);
  std::vector<std::uint32_t> cells(subject.solid().cell_count());
  std::iota(cells.begin(), cells.end(), 0u);
  std::shuffle(cells.begin(), cells.end(), random);
  std::array<std::size_t, 3> done{};
  std::array<WorstError, 3> worst;
  for (const std::uint32_t cell : cells) {
    const auto kind = static_cast<std::size_t>(subject.solid().cell_class(cell));
    if (done[kind]++ >= kCellsPerClass) continue;
    compare_on_descent(subject, evaluator, cell, random_descent(random, kLevels, done[kind] % 25 == 0), random,
                       worst[kind]);
  }
  for (std::size_t kind = 0; kind < 3; ++kind) {
    EXPECT_LT(worst[kind].position, kTolerance) << "class " << kind << " at " << worst[kind].position_at;
    EXPECT_LT(worst[kind].channel, kTolerance) << "class " << kind << " at " << worst[kind].channel_at;
    const std::string name = "class_" + std::to_string(kind);
    RecordProperty(name + "_cells", static_cast<int>(std::min(done[kind], kCellsPerClass)));
    RecordProperty(name + "_samples", static_cast<int>(worst[kind].samples));
    RecordProperty(name + "_worst_position", std::to_string(worst[kind].position * 1e12) + "e-12 of the diagonal");
    RecordProperty(name + "_worst_channel", std::to_string(worst[kind].channel * 1e12) + "e-12 of the range");
  }
}

INSTANTIATE_TEST_SUITE_P(Shared, RealMesh, testing::ValuesIn(real_mesh_names()),
                         [](const auto& info) { return case_name(info.param); });

}  // namespace
}  // namespace ccslice::oracle
