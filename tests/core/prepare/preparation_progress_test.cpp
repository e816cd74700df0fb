// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/preparation_progress.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "core/limit/limit_solid.h"
#include "core/models/models.h"
#include "core/prepare/id_ranges.h"
#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

using State = PreparationProgress::State;

TEST(PreparationProgress, CountsEachStepByItself) {
  PreparationProgress progress;
  EXPECT_EQ(progress.state().step, PreparationStep::kWaiting);
  EXPECT_EQ(progress.state().total, 0u);
  progress.begin(PreparationStep::kBuilding, 10);
  progress.add(3);
  progress.add(4);
  EXPECT_EQ(progress.state().step, PreparationStep::kBuilding);
  EXPECT_EQ(progress.state().done, 7u);
  EXPECT_EQ(progress.state().total, 10u);
  progress.begin(PreparationStep::kBounding, 5);
  EXPECT_EQ(progress.state().done, 0u);
  EXPECT_EQ(progress.state().total, 5u);
}

/// Looks on from within: wherever a preparation polls its token.
class Onlooker {
 public:
  Onlooker() { current_ = this; }
  ~Onlooker() { current_ = nullptr; }

  std::shared_ptr<const LimitSolid> prepare(ControlMesh mesh, int threads) {
    PrepareOptions options;
    options.threads = threads;
    options.cancel = CancellationToken::make([]() noexcept { current_->look(); });
    options.progress = &progress_;
    return prepare_solid(std::move(mesh), options);
  }

  PreparationProgress progress_;
  std::vector<State> seen_;

 private:
  void look() {
    const std::lock_guard lock(mutex_);
    seen_.push_back(progress_.state());
  }

  static inline Onlooker* current_ = nullptr;
  std::mutex mutex_;
};

void expect_honest(const Onlooker& onlooker, const LimitSolid& solid) {
  std::map<PreparationStep, State> last;
  State before;
  for (const State& state : onlooker.seen_) {
    EXPECT_GE(state.step, before.step);
    if (state.step == before.step) {
      EXPECT_GE(state.done, before.done);
    }
    EXPECT_LE(state.done, state.total);
    last[state.step] = before = state;
  }
  for (const PreparationStep step :
       {PreparationStep::kBuilding, PreparationStep::kBounding, PreparationStep::kFolding}) {
    ASSERT_TRUE(last.contains(step)) << static_cast<int>(step);
    EXPECT_EQ(last[step].total, solid.cell_count());
  }
  EXPECT_EQ(onlooker.progress_.state().step, PreparationStep::kFinishing);
}

TEST(PreparationProgress, OfAPreparationGrowsWithWhatIsDone) {
  for (const int threads : {1, 3}) {
    Onlooker onlooker;
    const auto solid = onlooker.prepare(make_bracket(), threads);
    ASSERT_GT(solid->cell_count(), 2 * kMostIdsPerRange);
    expect_honest(onlooker, *solid);
    std::map<PreparationStep, std::uint64_t> most;
    for (const State& state : onlooker.seen_) most[state.step] = std::max(most[state.step], state.done);
    // What is counted after the last poll of a step shows no more.
    EXPECT_GE(most[PreparationStep::kFolding] + static_cast<std::uint64_t>(threads) * kMostIdsPerRange,
              solid->cell_count());
    EXPECT_GE(most[PreparationStep::kBuilding] + 512, solid->cell_count());
  }
}

TEST(PreparationProgress, TellsOfRefinedCellsToo) {
  for (const char* name : {"sharp_hex_wedge_tet", "single_wedge", "box_3"}) {
    SCOPED_TRACE(name);
    Onlooker onlooker;
    const auto solid = onlooker.prepare(oracle::tiny_mesh(name), 2);
    expect_honest(onlooker, *solid);
  }
}

}  // namespace
}  // namespace ccslice
