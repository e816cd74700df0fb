// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/meshes/preparation_memory.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

/// The memory has 80 bytes, 10 of which are for small preparations.
class PreparationMemoryTest : public ::testing::Test {
 protected:
  using Share = PreparationMemory::Share;

  bool wait(Share& share, std::uint64_t bytes) {
    share.wait(bytes, [this] { ++begun_; });
    return share.bytes() == 0;
  }

  MemoryBudget budget_{80};
  PreparationMemory memory_{budget_, 50ms};
  std::atomic<int> begun_{0};
};

TEST_F(PreparationMemoryTest, WhoWaitsGetsAllThatItAskedForOnceItIsThere) {
  std::optional<Share> first(std::in_place, memory_);
  Share second(memory_);
  ASSERT_TRUE(first->resize(40));
  ASSERT_TRUE(second.resize(20));
  EXPECT_FALSE(second.resize(41));
  EXPECT_EQ(second.bytes(), 20u);
  EXPECT_EQ(memory_.waiting(), 0u);
  EXPECT_TRUE(wait(second, 41));
  EXPECT_EQ(memory_.waiting(), 1u);
  EXPECT_EQ(budget_.used_bytes(), 40u) << "gives back what it had";
  ASSERT_TRUE(first->resize(35));
  EXPECT_EQ(begun_, 0) << "an eighth is left to small ones";
  ASSERT_TRUE(first->resize(29));
  EXPECT_EQ(begun_, 1);
  EXPECT_EQ(memory_.waiting(), 0u);
  EXPECT_EQ(second.bytes(), 41u);
  first.reset();
  EXPECT_EQ(begun_, 1);
}

TEST_F(PreparationMemoryTest, WhoWaitsForWhatIsThereBeginsAtOnce) {
  Share share(memory_);
  EXPECT_FALSE(wait(share, 80));
  EXPECT_EQ(begun_, 1);
}

TEST_F(PreparationMemoryTest, WhoGoesWaitsNoMore) {
  std::optional<Share> first(std::in_place, memory_), second(std::in_place, memory_);
  ASSERT_TRUE(first->resize(70));
  ASSERT_TRUE(wait(*second, 70));
  second.reset();
  first.reset();
  EXPECT_EQ(begun_, 0);
  EXPECT_EQ(budget_.used_bytes(), 0u);
}

TEST_F(PreparationMemoryTest, SmallOnesFindRoomBesideLargeOnes) {
  Share large(memory_), small(memory_), other(memory_);
  ASSERT_TRUE(large.resize(11));
  ASSERT_TRUE(large.resize(70));
  EXPECT_TRUE(small.resize(10));
  EXPECT_FALSE(other.resize(1));
}

TEST_F(PreparationMemoryTest, WhoNeedsAllGetsIt) {
  Share large(memory_);
  EXPECT_TRUE(large.resize(80));
}

TEST_F(PreparationMemoryTest, WhoHasWaitedForLongIsPassedByNoneLikeIt) {
  std::optional<Share> running(std::in_place, memory_);
  Share waiting(memory_), next(memory_);
  ASSERT_TRUE(running->resize(30));
  ASSERT_TRUE(wait(waiting, 60));
  EXPECT_TRUE(next.resize(15)) << "it hasn't waited for long";
  EXPECT_TRUE(next.resize(0));
  std::this_thread::sleep_for(60ms);
  EXPECT_FALSE(next.resize(15));
  EXPECT_TRUE(running->resize(35)) << "who is there already goes on";
  Share small(memory_), smaller(memory_);
  EXPECT_TRUE(small.resize(8)) << "there is room for both";
  EXPECT_FALSE(smaller.resize(3));
  EXPECT_TRUE(smaller.resize(2));
  EXPECT_FALSE(smaller.resize(11));
  running.reset();
  EXPECT_EQ(begun_, 1);
  EXPECT_EQ(waiting.bytes(), 60u);
}

TEST_F(PreparationMemoryTest, ThoseWhoWaitComeInTheirOrderAndWhoFitsPasses) {
  std::optional<Share> running(std::in_place, memory_);
  Share first(memory_), second(memory_), third(memory_);
  ASSERT_TRUE(running->resize(70));
  ASSERT_TRUE(wait(first, 50));
  ASSERT_TRUE(wait(second, 50));
  ASSERT_TRUE(wait(third, 15));
  ASSERT_TRUE(running->resize(40));
  EXPECT_EQ(third.bytes(), 15u);
  running.reset();
  EXPECT_EQ(first.bytes(), 50u);
  EXPECT_EQ(second.bytes(), 0u);
  EXPECT_EQ(begun_, 2);
}

/// As preparations do: each asks for more and more, and begins anew where there is none.
TEST_F(PreparationMemoryTest, AllComeToTheirEndUnderConcurrentUse) {
  std::vector<std::thread> preparations;
  for (std::uint64_t i = 0; i < 6; ++i) {
    preparations.emplace_back([&, i] {
      for (int round = 0; round < 50; ++round) {
        Share share(memory_);
        std::uint64_t granted = 0;
        for (std::uint64_t bytes = 1; bytes <= 8 + 12 * i; bytes += 3 + i) {
          if (share.resize(std::max(bytes, granted))) continue;
          std::atomic<bool> begun = false;
          share.wait(bytes, [&] { begun = true; });
          while (!begun) std::this_thread::yield();
          granted = bytes;
        }
      }
    });
  }
  for (std::thread& preparation : preparations) preparation.join();
  EXPECT_EQ(budget_.used_bytes(), 0u);
}

}  // namespace
}  // namespace ccslice::server
