// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// How meshes are prepared for the cache: once for all who ask, each client in his turn, not before there is memory, and
// no longer than somebody waits.

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "server/service/meshes/mesh_cache.h"
#include "tests/server/service/mesh_cache_fixture.h"

namespace ccslice::server {
namespace {

TEST_F(MeshCacheTest, PreparesOnceWhenAskedForTwiceAtTheSameTime) {
  std::atomic<int> preparations = 0;
  std::promise<void> gate;
  std::shared_future<void> open = gate.get_future().share();
  const auto prepare = [&](const CancellationToken&, PreparationProgress&) {
    ++preparations;
    open.wait();
    return mesh_of(10);
  };
  std::vector<std::promise<MeshCache::Outcome>> done(5);
  for (auto& one : done) {
    cache_.get_or_prepare("a", prepare, [&one](const MeshCache::Outcome& outcome) { one.set_value(outcome); });
  }
  gate.set_value();
  const MeshPtr first = done[0].get_future().get().mesh;
  for (std::size_t i = 1; i < done.size(); ++i) EXPECT_EQ(done[i].get_future().get().mesh, first);
  EXPECT_EQ(preparations, 1);
}

TEST_F(MeshCacheTest, SharesAFailureAndCachesNothingOfIt) {
  std::promise<void> gate;
  std::shared_future<void> open = gate.get_future().share();
  const auto prepare = [&](const CancellationToken&, PreparationProgress&) -> PreparedMesh {
    open.wait();
    throw Error(ErrorCode::kMeshEmpty, "no cells");
  };
  std::promise<MeshCache::Outcome> first;
  std::promise<MeshCache::Outcome> second;
  cache_.get_or_prepare("a", prepare, [&](const MeshCache::Outcome& outcome) { first.set_value(outcome); });
  cache_.get_or_prepare("a", prepare, [&](const MeshCache::Outcome& outcome) { second.set_value(outcome); });
  gate.set_value();
  EXPECT_EQ(code_of(first.get_future().get()), static_cast<int>(ErrorCode::kMeshEmpty));
  EXPECT_EQ(code_of(second.get_future().get()), static_cast<int>(ErrorCode::kMeshEmpty));
  EXPECT_EQ(cache_.use().meshes, 0u);
  EXPECT_EQ(put("a", 10).error, nullptr) << "a later upload starts afresh";
}

TEST_F(MeshCacheTest, CancelsAPreparationOnceNobodyWaitsForIt) {
  std::promise<void> started;
  std::atomic<bool> saw_cancel = false;
  const auto prepare = [&](const CancellationToken& cancel, PreparationProgress&) -> PreparedMesh {
    started.set_value();
    while (!cancel.cancelled()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    saw_cancel = true;
    cancel.throw_if_cancelled();
    return {};
  };
  std::promise<MeshCache::Outcome> first;
  std::promise<MeshCache::Outcome> second;
  auto ticket_1 = cache_.get_or_prepare("a", prepare, [&](const MeshCache::Outcome& o) { first.set_value(o); });
  auto ticket_2 = cache_.get_or_prepare("a", prepare, [&](const MeshCache::Outcome& o) { second.set_value(o); });
  started.get_future().wait();
  ticket_1.cancel();
  EXPECT_EQ(code_of(first.get_future().get()), static_cast<int>(ErrorCode::kCancelled));
  EXPECT_FALSE(saw_cancel) << "the second one still waits";
  ticket_2.cancel();
  ticket_2.cancel();
  EXPECT_EQ(code_of(second.get_future().get()), static_cast<int>(ErrorCode::kCancelled));
  EXPECT_EQ(code_of(put("a", 10)), 0) << "who comes later starts afresh";
  executor_.wait_idle();
  EXPECT_TRUE(saw_cancel);
}

TEST_F(MeshCacheTest, TellsHowFarAPreparationIsWhileItRuns) {
  EXPECT_FALSE(cache_.preparation("a"));
  std::promise<void> counted, go_on;
  const auto prepare = [&](const CancellationToken&, PreparationProgress& progress) {
    progress.begin(PreparationStep::kBuilding, 7);
    progress.add(3);
    counted.set_value();
    go_on.get_future().wait();
    return mesh_of(10);
  };
  std::promise<MeshCache::Outcome> done;
  cache_.get_or_prepare("a", prepare, [&](const MeshCache::Outcome& outcome) { done.set_value(outcome); });
  counted.get_future().wait();
  const auto state = cache_.preparation("a");
  ASSERT_TRUE(state);
  EXPECT_EQ(state->step, PreparationStep::kBuilding);
  EXPECT_EQ(state->done, 3u);
  EXPECT_EQ(state->total, 7u);
  EXPECT_FALSE(cache_.preparation("b"));
  EXPECT_EQ(cache_.use().misses, 0u) << "who asks uses nothing";
  go_on.set_value();
  EXPECT_EQ(code_of(done.get_future().get()), 0);
  EXPECT_FALSE(cache_.preparation("a"));
  EXPECT_NE(cache_.find("a"), nullptr);
}

TEST_F(MeshCacheTest, KnowsThatAPreparationWaitsAndForgetsOneThatFailedOrWasCancelled) {
  std::promise<void> open;
  const auto opened = open.get_future().share();
  for (const char* id : {"a", "b"}) {  // More than may run.
    cache_.get_or_prepare(
        id,
        [opened](const CancellationToken&, PreparationProgress& progress) -> PreparedMesh {
          progress.begin(PreparationStep::kReading);
          opened.wait();
          throw Error(ErrorCode::kMeshEmpty, "no cells");
        },
        [](const MeshCache::Outcome&) {});
  }
  auto ticket = cache_.get_or_prepare(
      "c", [](const CancellationToken&, PreparationProgress&) { return mesh_of(1); }, [](const MeshCache::Outcome&) {});
  ASSERT_TRUE(cache_.preparation("c"));
  EXPECT_EQ(cache_.preparation("c")->step, PreparationStep::kWaiting);
  ticket.cancel();
  EXPECT_FALSE(cache_.preparation("c"));
  open.set_value();
  executor_.wait_idle();
  EXPECT_FALSE(cache_.preparation("a"));
}

/// Under ThreadSanitizer this looks for races between those who count and those who ask.
TEST_F(MeshCacheTest, TellsHowFarItIsWhileSeveralThreadsCount) {
  std::atomic<bool> over = false;
  std::vector<std::thread> askers;
  for (int asker = 0; asker < 2; ++asker) {
    askers.emplace_back([&] {
      PreparationProgress::State last;
      while (!over) {
        const auto state = cache_.preparation("a");
        if (!state) continue;
        EXPECT_GE(state->step, last.step);
        if (state->step == last.step) {
          EXPECT_GE(state->done, last.done);
        }
        EXPECT_LE(state->done, state->total);
        last = *state;
      }
    });
  }
  const auto outcome = get("a", [](const CancellationToken&, PreparationProgress& progress) {
    for (const auto step : {PreparationStep::kBuilding, PreparationStep::kBounding, PreparationStep::kFolding}) {
      progress.begin(step, 20'000);
      std::vector<std::thread> counters;
      for (int counter = 0; counter < 2; ++counter) {
        counters.emplace_back([&] {
          for (int i = 0; i < 10'000; ++i) progress.add(1);
        });
      }
      for (std::thread& counter : counters) counter.join();
    }
    return mesh_of(10);
  });
  over = true;
  for (std::thread& asker : askers) asker.join();
  EXPECT_EQ(code_of(outcome), 0);
}

TEST_F(MeshCacheTest, APreparationThatNobodyWaitsForLetsGoOfItsBytesBeforeItsTurn) {
  std::promise<void> open;
  auto hold_up = [opened = open.get_future().share()](const CancellationToken&, PreparationProgress&) {
    opened.wait();
    return mesh_of(1);
  };
  cache_.get_or_prepare("a", hold_up, [](const MeshCache::Outcome&) {});
  auto bytes = std::make_shared<std::string>("the bytes of an upload");
  const std::weak_ptr<std::string> held = bytes;
  auto ticket = cache_.get_or_prepare(
      "b",
      [bytes = std::move(bytes)](const CancellationToken&, PreparationProgress&) { return mesh_of(bytes->size()); },
      [](const MeshCache::Outcome&) {});
  EXPECT_FALSE(held.expired());
  ticket.cancel();
  EXPECT_TRUE(held.expired());
  open.set_value();
  executor_.wait_idle();
}

TEST_F(MeshCacheTest, WhoeverJoinsAPreparationBringsItToHisTurn) {
  Executor one_at_a_time{1};  // Of two that begin together either may be the first to say so.
  MeshCache cache{one_at_a_time, options()};
  std::promise<void> open;
  std::vector<std::string> order;
  std::mutex mutex;
  const auto prepare = [&, opened = open.get_future().share()](const std::string& id) {
    return [&, id, opened](const CancellationToken&, PreparationProgress&) {
      opened.wait();
      const std::lock_guard lock(mutex);
      order.push_back(id);
      return mesh_of(1);
    };
  };
  const auto nothing = [](const MeshCache::Outcome&) {};
  for (const char* client : {"1", "2", "3"}) {  // As many others as may begin one beside.
    cache.get_or_prepare(std::string("first of ") + client, prepare(""), nothing, client);
  }
  for (const char* id : {"a", "b", "c", "d", "joined"}) cache.get_or_prepare(id, prepare(id), nothing, "many");
  cache.get_or_prepare("joined", prepare("joined again"), nothing, "one");
  cache.get_or_prepare("joined", prepare("joined again"), nothing, "one");
  open.set_value();
  one_at_a_time.wait_idle();
  std::erase(order, "");
  ASSERT_EQ(order.size(), 5u) << "each once";
  EXPECT_LE(std::ranges::find(order, "joined") - order.begin(), 1);
}

/// What preparations do that ask for so many bytes of a memory of 80.
class LackingPreparations : public MeshCacheTest {
 protected:
  MeshCache::Prepare prepare(std::uint64_t bytes) {
    return [this, bytes, share = std::make_shared<PreparationMemory::Share>(memory_)](const CancellationToken&,
                                                                                      PreparationProgress& progress) {
      ++attempts_;
      progress.begin(PreparationStep::kReading);
      if (!share->resize(bytes)) throw PreparationMemory::Lack{share, bytes};
      return mesh_of(1);
    };
  }
  std::future<MeshCache::Outcome> begin(const std::string& id, std::uint64_t bytes) {
    auto promise = std::make_shared<std::promise<MeshCache::Outcome>>();
    ticket_ = cache_.get_or_prepare(id, prepare(bytes),
                                    [promise](const MeshCache::Outcome& outcome) { promise->set_value(outcome); });
    return promise->get_future();
  }

  MemoryBudget budget_{80};
  PreparationMemory memory_{budget_};
  std::optional<PreparationMemory::Share> others_{std::in_place, memory_};
  std::atomic<int> attempts_{0};
  MeshCache::Ticket ticket_;
};

TEST_F(LackingPreparations, AreBegunAnewWhenThereIsMemory) {
  ASSERT_TRUE(others_->resize(70));
  std::future<MeshCache::Outcome> large = begin("a", 50);
  executor_.wait_idle();
  EXPECT_EQ(attempts_, 1);
  ASSERT_TRUE(cache_.preparation("a"));
  EXPECT_EQ(cache_.preparation("a")->step, PreparationStep::kWaiting);
  std::future<MeshCache::Outcome> joined = begin("a", 50);
  EXPECT_EQ(code_of(begin("b", 5).get()), 0) << "others aren't held up";
  others_.reset();
  EXPECT_EQ(code_of(large.get()), 0);
  EXPECT_EQ(code_of(joined.get()), 0);
  executor_.wait_idle();
  EXPECT_EQ(attempts_, 3);
  EXPECT_EQ(budget_.used_bytes(), 0u);
}

TEST_F(LackingPreparations, WaitNoMoreOnceNobodyWaitsForThem) {
  ASSERT_TRUE(others_->resize(70));
  std::future<MeshCache::Outcome> large = begin("a", 50);
  executor_.wait_idle();
  ticket_.cancel();
  EXPECT_EQ(code_of(large.get()), static_cast<int>(ErrorCode::kCancelled));
  EXPECT_FALSE(cache_.preparation("a"));
  others_.reset();
  executor_.wait_idle();
  EXPECT_EQ(attempts_, 1);
  EXPECT_EQ(budget_.used_bytes(), 0u);
}

TEST_F(LackingPreparations, AreCancelledAtAnyTime) {
  for (int round = 0; round < 200; ++round) {
    others_.emplace(memory_);
    ASSERT_TRUE(others_->resize(70));
    std::future<MeshCache::Outcome> large = begin("a", 50);
    std::thread giving([&] { others_.reset(); });
    ticket_.cancel();
    giving.join();
    (void)large.get();
    cache_.erase("a");
    executor_.wait_idle();  // What was begun anew may hold its memory still.
    ASSERT_EQ(budget_.used_bytes(), 0u) << round;
  }
}

}  // namespace
}  // namespace ccslice::server
