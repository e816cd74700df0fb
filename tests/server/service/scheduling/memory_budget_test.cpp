// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/scheduling/memory_budget.h"

#include <gtest/gtest.h>

#include <chrono>
#include <limits>
#include <string>
#include <thread>
#include <vector>

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

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

TEST(MemoryBudget, KeepsAQuarterFromAnyOneClient) {
  MemoryBudget budget(100);
  std::vector<MemoryBudget::Share> many;
  for (int i = 0; i < 12; ++i) {
    many.emplace_back(budget, "many");
    EXPECT_EQ(many.back().resize(10), i < 7) << i;
  }
  EXPECT_TRUE(many.back().resize(5));
  EXPECT_FALSE(many.front().resize(11)) << "nor does one of several grow";
  MemoryBudget::Share other(budget, "other");
  EXPECT_TRUE(other.resize(25));
  EXPECT_FALSE(other.resize(26)) << "more than there is";
  EXPECT_TRUE(many.front().resize(5));
  EXPECT_FALSE(many.back().resize(11));
  EXPECT_TRUE(many.back().resize(10)) << "what it gave back";
  many.clear();
  EXPECT_TRUE(other.resize(75));
  EXPECT_EQ(budget.clients(), 1u) << "none who holds nothing is remembered";
  other.give_back();
  EXPECT_EQ(budget.clients(), 0u);
}

TEST(MemoryBudget, KeepsNothingFromWhoeverIsNoClient) {
  MemoryBudget budget(100);
  MemoryBudget::Share first(budget), second(budget);
  EXPECT_TRUE(first.resize(10));
  EXPECT_TRUE(second.resize(90));
  EXPECT_EQ(budget.clients(), 0u);
}

TEST(MemoryBudget, CountsMovedSharesForTheirClients) {
  MemoryBudget budget(100);
  MemoryBudget::Share first(budget, "one");
  ASSERT_TRUE(first.resize(70));
  MemoryBudget::Share moved = std::move(first);
  MemoryBudget::Share rest = moved.split_off_beyond(30);
  moved.give_back();
  MemoryBudget::Share other(budget, "other");
  ASSERT_TRUE(other.resize(1));
  EXPECT_FALSE(other.resize(61)) << "40 are held yet";
  std::swap(other, rest);
  other.give_back();
  EXPECT_TRUE(rest.resize(75)) << "it is the other one's";
  EXPECT_EQ(budget.clients(), 1u);
}

TEST(MemoryBudget, LendsTheLastQuarterToAShareThatIsItsClientsOnlyOne) {
  MemoryBudget budget(100);
  MemoryBudget::Share large(budget, "large"), more(budget, "large");
  EXPECT_TRUE(large.resize(70));
  EXPECT_TRUE(large.resize(100)) << "whatever fits into the budget can get in";
  EXPECT_TRUE(large.resize(80));
  EXPECT_FALSE(more.resize(1)) << "not a second one";
}

TEST(MemoryBudget, EndsALoanThatHasLastedAndKeepsOthersOutAndLendsNothingForAWhile) {
  const auto loan = 300ms;
  MemoryBudget budget(100, {}, loan);
  MemoryBudget::Share large(budget, "large"), other(budget, "other"), nobodys(budget);
  ASSERT_TRUE(large.resize(90));
  std::this_thread::sleep_for(loan);
  EXPECT_TRUE(large.resize(91)) << "nobody has been kept out";
  EXPECT_FALSE(other.resize(10));
  EXPECT_FALSE(large.resize(92));
  large.give_back();
  EXPECT_TRUE(large.resize(75));
  EXPECT_FALSE(large.resize(76)) << "so soon again";
  EXPECT_TRUE(other.resize(25)) << "its turn";
  other.give_back();
  std::this_thread::sleep_for(2 * loan);
  EXPECT_TRUE(large.resize(90));
  EXPECT_FALSE(nobodys.resize(11));
  EXPECT_TRUE(large.resize(91)) << "for that long it may go on";
  std::this_thread::sleep_for(loan);
  EXPECT_FALSE(large.resize(92)) << "also for those who are no clients";
}

TEST(MemoryBudget, TellsOfALoanThatIsOverdueWhoDoesntGrowAnyMore) {
  const auto loan = 300ms;
  MemoryBudget budget(100, {}, loan);
  EXPECT_FALSE(budget.is_lent(75));
  EXPECT_TRUE(budget.is_lent(76));
  MemoryBudget::Share large(budget, "large"), other(budget, "other");
  ASSERT_TRUE(large.resize(90));
  std::this_thread::sleep_for(loan);
  EXPECT_FALSE(budget.is_overdue("large")) << "nobody has been kept out";
  EXPECT_FALSE(other.resize(20));
  EXPECT_TRUE(budget.is_overdue("large"));
  EXPECT_FALSE(budget.is_overdue("other"));
  large.give_back();
  EXPECT_FALSE(budget.is_overdue("large"));
  EXPECT_FALSE(large.resize(76)) << "so soon again";
}

TEST(MemoryBudget, CountsClientsRightlyFromManyThreads) {
  MemoryBudget budget(100);
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&budget, client = std::to_string(t / 2)] {
      for (int i = 0; i < 1000; ++i) {
        MemoryBudget::Share share(budget, client);
        if (share.resize(20)) {
          EXPECT_LE(budget.used_bytes(), 100u);
          (void)share.resize(40);
        }
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(budget.used_bytes(), 0u);
  EXPECT_EQ(budget.clients(), 0u);
}

}  // namespace
}  // namespace ccslice::server
