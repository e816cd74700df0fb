// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/scheduling/executor.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <functional>
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
      const Executor::Lane own = executor.make_lane("client", Pieces::kBatch);
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
    executor.make_lane("client", Pieces::kBatch).post([&] {
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
    executor.make_lane("client", Pieces::kBatch).post([this] { gate_.get_future().wait(); });
  }
  std::string run() {
    gate_.set_value();
    executor.wait_idle();
    return order;
  }
  void note(char c) { order += c; }

  Executor executor{1, [] { return Executor::Clock::time_point(); }};  // Nothing takes time.
  std::string order;

 private:
  std::promise<void> gate_;
};

TEST(Executor, LanesTakeTurnsHoweverMuchOneHasQueued) {
  SingleThread single;
  const Executor::Lane greedy = single.executor.make_lane("client", Pieces::kBatch);
  const Executor::Lane modest = single.executor.make_lane("client", Pieces::kBatch);
  for (int i = 0; i < 4; ++i) greedy.post([&] { single.note('g'); });
  for (int i = 0; i < 2; ++i) modest.post([&] { single.note('m'); });
  EXPECT_EQ(single.run(), "gmgmgg");
}

TEST(Executor, ContinuationsComeBeforeTheRestOfTheirLane) {
  SingleThread single;
  const Executor::Lane lane = single.executor.make_lane("client", Pieces::kBatch);
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
    executor.make_lane("client", Pieces::kLong).post([&, opened] {
      opened.wait();
      ++ended;
    });
  }
  std::promise<void> ran;
  executor.make_lane("client", Pieces::kBatch).post([&] { ran.set_value(); });
  EXPECT_EQ(ran.get_future().wait_for(5s), std::future_status::ready) << "although long pieces wait";
  EXPECT_EQ(ended, 0);
  open.set_value();
  executor.wait_idle();
  EXPECT_EQ(ended, 5) << "one after the other";
}

TEST(Executor, ASingleThreadTakesLongPiecesInTurn) {
  SingleThread single;
  for (int i = 0; i < 2; ++i) {
    single.executor.make_lane("client", Pieces::kLong).post([&] { single.note('l'); });
    single.executor.make_lane("client", Pieces::kBatch).post([&] { single.note('s'); });
  }
  EXPECT_EQ(single.run(), "lsls");
}

/// A clock that goes on when it is told to.
class StoppedClock {
 public:
  std::function<Executor::Clock::time_point()> now() {
    return [this] { return Executor::Clock::time_point(std::chrono::nanoseconds(ns_.load())); };
  }
  void go_on(std::chrono::nanoseconds time) { ns_ += time.count(); }

 private:
  std::atomic<std::chrono::nanoseconds::rep> ns_ = 0;
};

TEST(Executor, APieceGivesWayWhereItPollsOnceItsTurnIsOver) {
  StoppedClock clock;
  Executor executor(1, clock.now());
  const CancellationToken token = Executor::make_token();
  std::string order;
  executor.make_lane("a", Pieces::kBatch).post([&] {
    const std::thread::id thread = std::this_thread::get_id();
    executor.make_lane("b", Pieces::kBatch).post([&] { order += 'b'; });
    clock.go_on(Executor::kTurn - 1ms);
    token.throw_if_cancelled();
    order += 'a';
    clock.go_on(1ms);
    token.throw_if_cancelled();
    order += 'a';
    EXPECT_EQ(std::this_thread::get_id(), thread);
  });
  executor.wait_idle();
  EXPECT_EQ(order, "aba");
}

TEST(Executor, APieceGoesOnWhereNobodyElseWaitsOrHasHadLess) {
  StoppedClock clock;
  Executor executor(1, clock.now());
  const CancellationToken token = Executor::make_token();
  std::string order;
  executor.make_lane("a", Pieces::kBatch).post([&] {
    clock.go_on(1h);
    token.throw_if_cancelled();
    const Executor::Lane other = executor.make_lane("b", Pieces::kBatch);
    other.post([&] {
      clock.go_on(500ms);
      order += 'b';
    });
    other.post([&] { order += 'c'; });
    clock.go_on(20ms);
    token.throw_if_cancelled();  // To b, which then has had more.
    clock.go_on(20ms);
    token.throw_if_cancelled();
    order += 'a';
  });
  executor.wait_idle();
  EXPECT_EQ(order, "bac");
}

TEST(Executor, PollsOnOtherThreadsThanItsOwnDoNothing) {
  Executor::make_token().throw_if_cancelled();
  Executor executor(1);
  bool polled = false;
  executor.make_lane("a", Pieces::kBatch).post([&] {
    executor.make_lane("b", Pieces::kBatch).post([] {});
    std::thread([&] {
      std::this_thread::sleep_for(2 * Executor::kTurn);
      Executor::make_token().throw_if_cancelled();
      polled = true;
    }).join();
  });
  executor.wait_idle();
  EXPECT_TRUE(polled);
}

TEST(Executor, InteractiveWorkHasAProcessorOfItsOwn) {
  Executor executor(2);
  std::promise<void> open;
  const std::shared_future<void> opened = open.get_future().share();
  for (int i = 0; i < 5; ++i) executor.make_lane("a", Pieces::kBatch).post([opened] { opened.wait(); });
  for (int i = 0; i < 3; ++i) {
    std::promise<void> ran;
    executor.make_lane("a", Pieces::kInteractive).post([&] { ran.set_value(); });
    EXPECT_EQ(ran.get_future().wait_for(5s), std::future_status::ready);
  }
  open.set_value();
}

TEST(Executor, InteractiveWorkUsesTheOtherProcessorsToo) {
  Executor executor(2);
  std::promise<void> open;
  const std::shared_future<void> opened = open.get_future().share();
  std::atomic<int> running = 0;
  for (int i = 0; i < 3; ++i) {
    executor.make_lane("a", Pieces::kInteractive).post([&, opened] {
      ++running;
      opened.wait();
    });
  }
  const auto patience = std::chrono::steady_clock::now() + 5s;
  while (running < 3 && std::chrono::steady_clock::now() < patience) std::this_thread::sleep_for(1ms);
  EXPECT_EQ(running, 3);
  open.set_value();
}

TEST(Executor, HoweverManyPiecesHaveBegunOnlySoManyRun) {
  Executor executor(2);
  const CancellationToken token = Executor::make_token();
  constexpr int kCalls = 12;
  std::atomic<int> running = 0, most = 0, begun = 0, most_begun = 0, ended = 0;
  const auto note = [](std::atomic<int>& highest, int now) {
    int seen = highest;
    while (seen < now && !highest.compare_exchange_weak(seen, now)) {
    }
  };
  for (int i = 0; i < kCalls; ++i) {
    executor.make_lane("client " + std::to_string(i % 5), Pieces::kBatch).post([&] {
      note(most_begun, ++begun);
      for (int turn = 0; turn < 4; ++turn) {
        note(most, ++running);
        std::this_thread::sleep_for(Executor::kTurn);
        --running;
        token.throw_if_cancelled();
      }
      --begun;
      ++ended;
    });
  }
  executor.wait_idle();
  EXPECT_EQ(ended, kCalls);
  EXPECT_LE(most, 2);
  EXPECT_GT(most_begun, 2);
}

}  // namespace
}  // namespace ccslice::server
