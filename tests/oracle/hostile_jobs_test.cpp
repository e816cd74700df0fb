// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The first seeds of random jobs that nobody tuned anything for (hostile_check.h). tests/bench/hostile_jobs tries more,
// and one alone: --seeds N --verbose.

#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include "tests/oracle/hostile_check.h"

namespace ccslice::oracle {
namespace {

constexpr std::uint64_t kSeeds = 300, kSeedsACase = 10;

class HostileJobs : public testing::TestWithParam<std::uint64_t> {};

TEST_P(HostileJobs, KeepWhatIsPromised) {
  std::uint64_t sliced = 0;
  for (std::uint64_t i = 0; i < kSeedsACase; ++i) {
    const HostileResult result = run_hostile_seed(GetParam() + i);
    sliced += result.refused.empty();
    EXPECT_FALSE(result.failed()) << to_text(result);
  }
  EXPECT_GT(sliced, 0u) << "nothing is tested here";
}

INSTANTIATE_TEST_SUITE_P(Seeds, HostileJobs, testing::Range<std::uint64_t>(1, kSeeds + 1, kSeedsACase),
                         [](const auto& info) { return "from_" + std::to_string(info.param); });

// A part of 0.017 mm that folds. Its 960 cells are all nearer to a voxel than voxels may lie off the solid, and the one
// that holds it was among the last to be searched: two voxels took another one's material.
TEST(HostileJob, FindsTheCellThatHoldsAVoxelAmongAllThatComeNear) {
  const HostileResult result = run_hostile_seed(10529);
  EXPECT_FALSE(result.failed()) << to_text(result);
  EXPECT_GT(result[HostileCheck::kTruth].compared, 50u);
}

TEST(HostileJob, IsTheSameForTheSameSeed) {
  const HostileResult once = run_hostile_seed(7), again = run_hostile_seed(7);
  EXPECT_EQ(once.description, again.description);
  EXPECT_EQ(once.voxels, again.voxels);
  EXPECT_EQ(once[HostileCheck::kTolerance].worst, again[HostileCheck::kTolerance].worst);
}

}  // namespace
}  // namespace ccslice::oracle
