// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/admission.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <list>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "server/service/service_error.h"

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

/// A call that asks for a place and remembers what came of it.
class Caller {
 public:
  explicit Caller(Admission& admission) : admission_(admission), place_(admission) {
    admission.request(place_, [this](const std::exception_ptr& refusal) {
      refused_ = refusal;
      decided_ = true;
    });
  }
  bool decided() const { return decided_; }
  bool runs() const { return decided_ && !refused_; }
  std::optional<ServiceError> refusal() const {
    if (!decided_ || !refused_) return std::nullopt;
    try {
      std::rethrow_exception(refused_);
    } catch (const ServiceError& error) {
      return error;
    }
  }
  void end() { admission_.give_back(place_); }
  bool leave() { return admission_.leave_queue(place_); }

 private:
  Admission& admission_;
  Admission::Place place_;
  std::atomic<bool> decided_{false};
  std::exception_ptr refused_;
};

template <class Condition>
bool comes_true(Condition condition) {
  for (int i = 0; i < 1000 && !condition(); ++i) std::this_thread::sleep_for(5ms);
  return condition();
}

TEST(Admission, RunsSoManyAndLetsTheOthersWaitInOrder) {
  Admission admission({.running = 2, .waiting = 2, .longest_wait = 1h});
  Caller first(admission), second(admission), third(admission), fourth(admission);
  EXPECT_TRUE(first.runs() && second.runs());
  EXPECT_FALSE(third.decided() || fourth.decided());
  EXPECT_EQ(admission.running(), 2u);
  EXPECT_EQ(admission.waiting(), 2u);
  second.end();
  EXPECT_TRUE(third.runs());
  EXPECT_FALSE(fourth.decided());
  second.end();  // Nothing any more.
  EXPECT_EQ(admission.running(), 2u);
  first.end();
  EXPECT_TRUE(fourth.runs());
  third.end();
  fourth.end();
  EXPECT_EQ(admission.running(), 0u);
}

TEST(Admission, RefusesWhoFindsTheQueueFullAndSaysWhenToComeAgain) {
  Admission admission({.running = 1, .waiting = 1, .longest_wait = 1h});
  Caller first(admission), second(admission), third(admission);
  ASSERT_TRUE(third.refusal());
  EXPECT_EQ(third.refusal()->code(), ServiceErrorCode::kServerBusy);
  ASSERT_TRUE(third.refusal()->retry_delay());
  EXPECT_GE(*third.refusal()->retry_delay(), 1s);
  EXPECT_LE(*third.refusal()->retry_delay(), 30s);
}

TEST(Admission, TheRetryDelayFollowsTheQueue) {
  Admission few({.running = 1, .waiting = 1, .longest_wait = 1h}),
      many({.running = 1, .waiting = 20, .longest_wait = 1h});
  const auto delay_of = [](Admission& admission, std::size_t waiting) {
    std::vector<std::unique_ptr<Caller>> callers;
    for (std::size_t i = 0; i < waiting + 2; ++i) callers.push_back(std::make_unique<Caller>(admission));
    return *callers.back()->refusal()->retry_delay();
  };
  EXPECT_LT(delay_of(few, 1), delay_of(many, 20));
}

TEST(Admission, TimeInWhichNobodyWaitedDoesNotLengthenTheRetryDelay) {
  Admission admission({.running = 1, .waiting = 20, .longest_wait = 1h});
  Caller(admission).end();
  std::this_thread::sleep_for(1500ms);
  std::vector<std::unique_ptr<Caller>> callers;
  for (int i = 0; i < 21; ++i) callers.push_back(std::make_unique<Caller>(admission));
  callers.front()->end();
  callers.push_back(std::make_unique<Caller>(admission));
  const Caller refused(admission);
  ASSERT_TRUE(refused.refusal());
  EXPECT_LE(*refused.refusal()->retry_delay(), 21s) << "a second for each run";
}

TEST(Admission, CallsThatEndAsSoonAsTheyBeginDontStackUp) {
  constexpr std::size_t kMany = 200'000;
  Admission admission({.running = 1, .waiting = kMany, .longest_wait = 1h});
  Caller first(admission);
  std::list<Admission::Place> places;
  std::size_t ended = 0;
  for (std::size_t i = 0; i < kMany; ++i) {
    Admission::Place& place = places.emplace_back(admission);
    admission.request(place, [&admission, &place, &ended](const std::exception_ptr&) {
      admission.give_back(place);
      ++ended;
    });
  }
  first.end();
  EXPECT_EQ(ended, kMany);
  EXPECT_EQ(admission.running(), 0u);
}

TEST(Admission, NobodyWaitsForever) {
  Admission admission({.running = 1, .waiting = 2, .longest_wait = 20ms});
  Caller first(admission), second(admission), third(admission);
  EXPECT_TRUE(comes_true([&] { return second.decided() && third.decided(); }));
  EXPECT_EQ(second.refusal()->code(), ServiceErrorCode::kServerBusy);
  EXPECT_EQ(third.refusal()->code(), ServiceErrorCode::kServerBusy);
  EXPECT_EQ(admission.waiting(), 0u);
  first.end();
  EXPECT_TRUE(Caller(admission).runs());
}

TEST(Admission, WhoLeavesTheQueueHearsNothingMore) {
  Admission admission({.running = 1, .waiting = 2, .longest_wait = 1h});
  Caller first(admission), second(admission), third(admission);
  EXPECT_TRUE(second.leave());
  EXPECT_FALSE(second.leave());
  EXPECT_FALSE(first.leave()) << "it runs";
  first.end();
  EXPECT_FALSE(second.decided());
  EXPECT_TRUE(third.runs());
}

TEST(Admission, ADrainRefusesThoseWhoWaitAndThoseWhoCome) {
  Admission admission({.running = 1, .waiting = 2, .longest_wait = 1h});
  Caller first(admission), second(admission);
  admission.drain();
  EXPECT_EQ(second.refusal()->code(), ServiceErrorCode::kServerDraining);
  Caller third(admission);
  EXPECT_EQ(third.refusal()->code(), ServiceErrorCode::kServerDraining);
  EXPECT_TRUE(first.runs());
}

TEST(Admission, APlaceThatGoesIsGivenBack) {
  Admission admission({.running = 1, .waiting = 1, .longest_wait = 1h});
  auto first = std::make_unique<Caller>(admission);
  Caller second(admission);
  first = nullptr;
  EXPECT_TRUE(second.runs());
}

TEST(Admission, ManyThreadsNeverRunMoreThanTheLimit) {
  Admission admission({.running = 3, .waiting = 100, .longest_wait = 1h});
  std::atomic<int> running{0}, most{0}, done{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i) {
    threads.emplace_back([&] {
      for (int round = 0; round < 200; ++round) {
        std::atomic<bool> admitted{false};
        Admission::Place place(admission);
        admission.request(place, [&](const std::exception_ptr& refusal) {
          EXPECT_FALSE(refusal);
          const int now = ++running;
          for (int seen = most; now > seen && !most.compare_exchange_weak(seen, now);) {
          }
          admitted = true;
        });
        if (round % 7 == 0 && admission.leave_queue(place)) continue;
        while (!admitted) std::this_thread::yield();
        --running;
        ++done;
        admission.give_back(place);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_LE(most, 3);
  EXPECT_GT(done, 1000);
  EXPECT_EQ(admission.running(), 0u);
  EXPECT_EQ(admission.waiting(), 0u);
}

}  // namespace
}  // namespace ccslice::server
