// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/scheduling/idle_watch.h"

#include <gtest/gtest.h>

#include <memory>
#include <thread>
#include <vector>

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

class SilentCall final : public IdleCall {
 public:
  using IdleCall::arm_wait;
  using IdleCall::begin_wait;
  using IdleCall::end_armed_wait;
  using IdleCall::end_wait;
  void wait() { arm_wait(begin_wait()); }
  bool keeps_message() const override { return keeps; }
  int ended = 0, lagged = 0;
  bool keeps = true;

 private:
  void idle() override { ++ended; }
  void lag() override { ++lagged; }
};

TEST(IdleWatch, EndsACallThatWaitsTooLongOnce) {
  IdleWatch watch(20ms);
  const auto call = std::make_shared<SilentCall>();
  watch.add(call);
  call->wait();
  watch.sweep();
  EXPECT_EQ(call->ended, 0) << "it has time";
  std::this_thread::sleep_for(30ms);
  watch.sweep();
  watch.sweep();
  EXPECT_EQ(call->ended, 1);
  EXPECT_FALSE(call->end_wait()) << "a message that comes now comes too late";
}

TEST(IdleWatch, EndsThoseFirstThatHaveKeptMessagesLongest) {
  IdleWatch watch(1h, {.in_need = 300ms});
  SilentCall* calls[4];
  std::vector<std::shared_ptr<SilentCall>> all;
  for (SilentCall*& call : calls) {
    all.push_back(std::make_shared<SilentCall>());
    call = all.back().get();
    watch.add(all.back());
  }
  calls[0]->keeps = false;
  for (SilentCall* call : {calls[0], calls[2], calls[1]}) {
    call->wait();
    std::this_thread::sleep_for(10ms);
  }
  std::this_thread::sleep_for(300ms);
  EXPECT_EQ(watch.end_longest(1), 1u);
  EXPECT_EQ(calls[2]->ended, 1);
  EXPECT_EQ(calls[1]->ended, 0);
  calls[3]->wait();
  EXPECT_EQ(watch.end_longest(10), 1u);
  EXPECT_EQ(calls[1]->ended, 1);
  EXPECT_EQ(calls[0]->ended, 0) << "it keeps none";
  EXPECT_EQ(calls[3]->ended, 0) << "it has time";
}

TEST(IdleWatch, TellsCallsThatLagLongBefore) {
  for (const auto patience : {0ms, 3'600'000ms}) {
    IdleWatch watch(patience, {.usual = 20ms});
    const auto call = std::make_shared<SilentCall>();
    watch.add(call);
    call->wait();
    watch.sweep();
    EXPECT_EQ(call->lagged, 0) << "it has time";
    std::this_thread::sleep_for(30ms);
    watch.sweep();
    EXPECT_EQ(call->lagged, 1);
    EXPECT_EQ(call->ended, 0);
    EXPECT_TRUE(call->end_wait()) << "the wait goes on";
    watch.sweep();
    EXPECT_EQ(call->lagged, 1);
  }
}

TEST(IdleWatch, TellsCallsThatLagSoonerInNeed) {
  IdleWatch watch(0ms, {.usual = 1h, .in_need = 20ms});
  const auto call = std::make_shared<SilentCall>();
  watch.add(call);
  call->wait();
  watch.sweep(/*in_need=*/true);
  EXPECT_EQ(call->lagged, 0) << "it has time";
  std::this_thread::sleep_for(30ms);
  watch.sweep();
  EXPECT_EQ(call->lagged, 0) << "nobody needs anything";
  watch.sweep(/*in_need=*/true);
  EXPECT_EQ(call->lagged, 1);
}

TEST(IdleWatch, LeavesCallsThatDontWait) {
  IdleWatch watch(1ms);
  const auto working = std::make_shared<SilentCall>();
  watch.add(working);
  working->wait();
  EXPECT_TRUE(working->end_wait());
  std::this_thread::sleep_for(5ms);
  watch.sweep();
  EXPECT_EQ(working->ended, 0);
}

TEST(IdleWatch, EndsNoWaitBeforeItIsArmed) {
  IdleWatch watch(1ms);
  const auto call = std::make_shared<SilentCall>();
  watch.add(call);
  const auto wait = call->begin_wait();
  std::this_thread::sleep_for(5ms);
  watch.sweep();
  EXPECT_FALSE(call->end_armed_wait());
  EXPECT_EQ(call->ended, 0);
  call->arm_wait(wait);
  watch.sweep();
  EXPECT_EQ(call->ended, 1);
  call->begin_wait();
  call->arm_wait(wait);
  EXPECT_FALSE(call->end_armed_wait()) << "another wait was armed";
  EXPECT_TRUE(call->end_wait());
}

TEST(IdleWatch, KeepsNoCallAlive) {
  IdleWatch watch(1h);
  auto call = std::make_shared<SilentCall>();
  const std::weak_ptr<SilentCall> weak = call;
  watch.add(call);
  watch.sweep();
  call.reset();
  EXPECT_TRUE(weak.expired());
  watch.sweep();
}

TEST(IdleWatch, MayHaveEndlessPatience) {
  IdleWatch watch(0ms);
  const auto call = std::make_shared<SilentCall>();
  watch.add(call);
  call->wait();
  std::this_thread::sleep_for(5ms);
  watch.sweep();
  EXPECT_EQ(call->ended, 0);
}

TEST(IdleWatch, AMessageAndTheEndOfPatienceDontBothWin) {
  for (int round = 0; round < 200; ++round) {
    IdleWatch watch(1ms);
    const auto call = std::make_shared<SilentCall>();
    watch.add(call);
    call->wait();
    std::this_thread::sleep_for(1ms);
    std::thread sweeper([&] { watch.sweep(); });
    const bool came = call->end_wait();
    sweeper.join();
    EXPECT_EQ(call->ended, came ? 0 : 1);
  }
}

}  // namespace
}  // namespace ccslice::server
