// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/memory_budget.h"

#include <gtest/gtest.h>

#include <limits>
#include <thread>
#include <vector>

namespace ccslice::server {
namespace {

TEST(MemoryBudget, SharesAreGivenBackWithTheObject) {
  MemoryBudget budget(10);
  {
    MemoryBudget::Share share(budget);
    EXPECT_TRUE(share.resize(8));
    EXPECT_FALSE(share.resize(11));
    EXPECT_EQ(share.bytes(), 8u) << "nothing changed";
    EXPECT_TRUE(share.resize(3));
    EXPECT_EQ(budget.used_bytes(), 3u);
    const MemoryBudget::Share moved = std::move(share);
    EXPECT_EQ(budget.used_bytes(), 3u);
  }
  EXPECT_EQ(budget.used_bytes(), 0u);
}

TEST(MemoryBudget, HugeSharesDontOverflow) {
  MemoryBudget budget(10);
  MemoryBudget::Share first(budget);
  MemoryBudget::Share second(budget);
  EXPECT_TRUE(first.resize(1));
  EXPECT_FALSE(second.resize(std::numeric_limits<std::uint64_t>::max()));
}

TEST(MemoryBudget, WindowsShrinkAsItFillsAndTheLeastIsHeldToTheEnd) {
  MemoryBudget budget(1000);
  std::vector<MemoryBudget::Share> shares;
  while (auto share = budget.take_between(100, 200)) shares.push_back(std::move(*share));
  EXPECT_EQ(shares.front().bytes(), 200u);
  EXPECT_EQ(shares.back().bytes(), 100u);
  EXPECT_GE(shares.size(), 6u);
  EXPECT_LE(budget.used_bytes(), 1000u);
  EXPECT_GT(budget.used_bytes(), 900u);
}

TEST(MemoryBudget, ThreadsNeverTakeMoreThanThereIs) {
  MemoryBudget budget(100);
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&] {
      for (int i = 0; i < 1000; ++i) {
        MemoryBudget::Share share(budget);
        if (share.resize(40)) {
          EXPECT_LE(budget.used_bytes(), 100u);
        }
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(budget.used_bytes(), 0u);
}

TEST(MemoryBudget, LeavesWhatItIsToldTo) {
  MemoryBudget budget(100);
  MemoryBudget::Share share(budget);
  EXPECT_FALSE(share.resize(90, 20));
  EXPECT_TRUE(share.resize(80, 20));
  MemoryBudget::Share other(budget);
  EXPECT_FALSE(other.resize(1, 20));
  EXPECT_TRUE(other.resize(20));
  EXPECT_FALSE(other.resize(21, 200)) << "more than there is";
}

TEST(MemoryBudget, TellsOfWhatSharesGiveBack) {
  int told = 0;
  MemoryBudget budget(100, [&] { ++told; });
  MemoryBudget::Share share(budget);
  ASSERT_TRUE(share.resize(60));
  ASSERT_TRUE(share.resize(50));
  EXPECT_EQ(told, 0) << "not of what is resized";
  {
    const MemoryBudget::Share rest = share.split_off_beyond(20);
    EXPECT_EQ(rest.bytes(), 30u);
    EXPECT_EQ(share.bytes(), 20u);
    EXPECT_EQ(budget.used_bytes(), 50u);
  }
  EXPECT_EQ(told, 1);
  EXPECT_EQ(budget.used_bytes(), 20u);
  share.give_back();
  share.give_back();
  EXPECT_EQ(told, 2) << "nothing was left the second time";
  EXPECT_EQ(budget.given_back_bytes(), 60u);
}

}  // namespace
}  // namespace ccslice::server
