// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/executor.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <mutex>
#include <string>
#include <thread>

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

TEST(Executor, RunsEverythingBeforeItGoes) {
  std::atomic<int> ran = 0;
  {
    Executor executor(2);
    for (int lane = 0; lane < 10; ++lane) {
      const Executor::Lane own = executor.make_lane();
      for (int i = 0; i < 100; ++i) own.post([&ran] { ++ran; });
    }
  }
  EXPECT_EQ(ran, 1000);
}

TEST(Executor, UsesAllItsThreadsAndNoMore) {
  Executor executor(3);
  std::atomic<int> running = 0;
  std::atomic<int> most = 0;
  for (int i = 0; i < 30; ++i) {
    executor.make_lane().post([&] {
      const int now = ++running;
      int seen = most;
      while (seen < now && !most.compare_exchange_weak(seen, now)) {
      }
      // Long enough for the other threads to come, however busy the machine is.
      const auto patience = std::chrono::steady_clock::now() + 5s;
      while (most < 3 && std::chrono::steady_clock::now() < patience) std::this_thread::sleep_for(1ms);
      std::this_thread::sleep_for(2ms);
      --running;
    });
  }
  executor.wait_idle();
  EXPECT_EQ(most, 3);
}

/// One thread, held up until `open`, so that everything is queued before anything runs.
class SingleThread {
 public:
  SingleThread() {
    executor.make_lane().post([this] { gate_.get_future().wait(); });
  }
  std::string run() {
    gate_.set_value();
    executor.wait_idle();
    return order;
  }
  void note(char c) { order += c; }

  Executor executor{1};
  std::string order;

 private:
  std::promise<void> gate_;
};

TEST(Executor, LanesTakeTurnsHoweverMuchOneHasQueued) {
  SingleThread single;
  const Executor::Lane greedy = single.executor.make_lane();
  const Executor::Lane modest = single.executor.make_lane();
  for (int i = 0; i < 4; ++i) greedy.post([&] { single.note('g'); });
  for (int i = 0; i < 2; ++i) modest.post([&] { single.note('m'); });
  EXPECT_EQ(single.run(), "gmgmgg");
}

TEST(Executor, ContinuationsComeBeforeTheRestOfTheirLane) {
  SingleThread single;
  const Executor::Lane lane = single.executor.make_lane();
  lane.post([&] {
    single.note('1');
    lane.post_front([&] { single.note('2'); });
  });
  lane.post([&] { single.note('3'); });
  EXPECT_EQ(single.run(), "123");
}

TEST(Executor, LongPiecesLeaveAThreadForTheShortOnes) {
  Executor executor(2);
  std::promise<void> open;
  const std::shared_future<void> opened = open.get_future().share();
  std::atomic<int> ended = 0;
  for (int i = 0; i < 5; ++i) {
    executor.make_lane(Executor::Pieces::kLong).post([&, opened] {
      opened.wait();
      ++ended;
    });
  }
  std::promise<void> ran;
  executor.make_lane().post([&] { ran.set_value(); });
  EXPECT_EQ(ran.get_future().wait_for(5s), std::future_status::ready) << "although long pieces wait";
  EXPECT_EQ(ended, 0);
  open.set_value();
  executor.wait_idle();
  EXPECT_EQ(ended, 5) << "one after the other";
}

TEST(Executor, ASingleThreadTakesLongPiecesInTurn) {
  SingleThread single;
  for (int i = 0; i < 2; ++i) {
    single.executor.make_lane(Executor::Pieces::kLong).post([&] { single.note('l'); });
    single.executor.make_lane().post([&] { single.note('s'); });
  }
  EXPECT_EQ(single.run(), "lsls");
}

}  // namespace
}  // namespace ccslice::server
