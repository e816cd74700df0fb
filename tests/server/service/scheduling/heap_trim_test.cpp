// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/scheduling/heap_trim.h"

#include <gtest/gtest.h>
#include <malloc.h>

#include <algorithm>
#include <future>
#include <string>
#include <thread>
#include <vector>

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

TEST(HeapTrim, IsWorthItAfterMuchWasFreedAndOnceMore) {
  std::uint64_t freed_bytes = 0;
  HeapTrim trim([&] { return HeapTrim::Figures{.freed_bytes = freed_bytes}; });
  EXPECT_FALSE(trim.sweep());
  freed_bytes += 1 << 20;
  EXPECT_FALSE(trim.sweep());
  freed_bytes += 100 << 20;
  EXPECT_TRUE(trim.sweep());
  EXPECT_TRUE(trim.sweep()) << "what was counted just before it was freed";
  EXPECT_FALSE(trim.sweep());
  freed_bytes += 1 << 20;
  EXPECT_FALSE(trim.sweep());
}

constexpr std::uint64_t kMiB = 1 << 20;

TEST(HeapTrim, IsWorthItWhereFarMoreIsHeldThanAnybodyKnowsOf) {
  HeapTrim::Figures figures{.known_bytes = 100 * kMiB, .resident_bytes = 250 * kMiB};
  HeapTrim trim([&] { return figures; }, 0ms);
  EXPECT_FALSE(trim.sweep()) << "as it has been from the beginning";
  figures.resident_bytes += 200 * kMiB;
  figures.known_bytes += 190 * kMiB;
  EXPECT_FALSE(trim.sweep()) << "somebody holds it";
  figures.known_bytes -= 190 * kMiB;
  EXPECT_TRUE(trim.sweep());
  EXPECT_FALSE(trim.sweep()) << "again for what it couldn't give back";
  figures.resident_bytes -= 100 * kMiB;
  EXPECT_FALSE(trim.sweep());
  figures.resident_bytes += 70 * kMiB;
  EXPECT_TRUE(trim.sweep()) << "since it can be less";
}

TEST(HeapTrim, IsWorthItForLessWhenNothingRuns) {
  HeapTrim::Figures figures{.resident_bytes = 100 * kMiB};
  HeapTrim trim([&] { return figures; }, 0ms);
  EXPECT_FALSE(trim.sweep());
  figures.resident_bytes += 20 * kMiB;
  EXPECT_FALSE(trim.sweep());
  figures.is_idle = true;
  EXPECT_TRUE(trim.sweep());
  EXPECT_FALSE(trim.sweep());
}

TEST(HeapTrim, TakesNothingThatCallsHeldWhenItTrimmedForWhatCantBeGivenBack) {
  HeapTrim::Figures figures{.resident_bytes = 100 * kMiB, .is_idle = true};
  HeapTrim trim([&] { return figures; }, 0ms);
  EXPECT_FALSE(trim.sweep());
  figures.is_idle = false;
  figures.resident_bytes += 80 * kMiB;
  EXPECT_TRUE(trim.sweep()) << "a call holds it, but nobody knows";
  EXPECT_FALSE(trim.sweep());
  figures.is_idle = true;  // It has freed it since.
  EXPECT_TRUE(trim.sweep());
  EXPECT_FALSE(trim.sweep());
}

TEST(HeapTrim, HasARestBetweenSuchSweeps) {
  HeapTrim::Figures figures{.resident_bytes = 100 * kMiB};
  HeapTrim trim([&] { return figures; }, 1h);
  EXPECT_FALSE(trim.sweep());
  figures.resident_bytes += 100 * kMiB;
  EXPECT_TRUE(trim.sweep());
  figures.resident_bytes += 100 * kMiB;
  EXPECT_FALSE(trim.sweep());
  figures.freed_bytes += 100 * kMiB;
  EXPECT_TRUE(trim.sweep()) << "but for what is known to be free";
  EXPECT_TRUE(trim.sweep());
  figures.resident_bytes += 100 * kMiB;
  figures.is_idle = true;
  EXPECT_TRUE(trim.sweep()) << "or when nothing runs";
}

TEST(HeapTrim, IsWorthItWhenNothingRunsAndWhatNobodyKnewOfWasFreed) {
  HeapTrim::Figures figures{.resident_bytes = 100 * kMiB};
  std::uint64_t free_bytes = kMiB;
  HeapTrim trim([&] { return figures; }, 0ms, [&] { return free_bytes; });
  EXPECT_FALSE(trim.sweep());
  free_bytes += 20 * kMiB;
  EXPECT_FALSE(trim.sweep()) << "nobody asks while something runs";
  figures.is_idle = true;
  EXPECT_TRUE(trim.sweep());
  EXPECT_FALSE(trim.sweep()) << "the machine has it";
  free_bytes += 7 * kMiB;
  EXPECT_FALSE(trim.sweep());
  free_bytes += 2 * kMiB;
  EXPECT_TRUE(trim.sweep());
  free_bytes -= 20 * kMiB;
  EXPECT_FALSE(trim.sweep()) << "it is used again";
  free_bytes += 10 * kMiB;
  EXPECT_TRUE(trim.sweep());
}

/// Touched, so that the machine's memory is behind it.
std::vector<std::string> blocks(std::size_t count, std::size_t bytes) {
  std::vector<std::string> all;
  for (std::size_t i = 0; i < count; ++i) all.emplace_back(bytes, 'x');
  return all;
}

TEST(KeptMemory, IsLittleOfWhatAThreadHasFreed) {
  bound_kept_memory();
  {
    const std::size_t mapped_bytes = mallinfo2().hblkhd;
    // When it goes, the allocator keeps more from then on, unless it is told otherwise.
    const std::vector<std::string> large = blocks(1, 30 * kMiB);
    if (mallinfo2().hblkhd == mapped_bytes) GTEST_SKIP() << "sanitizers have allocators of their own";
  }
  std::promise<std::uint64_t> freed_bytes;
  std::promise<void> end;
  std::thread thread([&] {
    const std::uint64_t before_bytes = resident_memory_bytes();
    const std::size_t count = blocks(400, 100 << 10).size();
    malloc_trim(0);
    const std::uint64_t after_bytes = resident_memory_bytes();
    EXPECT_EQ(count, 400u);
    freed_bytes.set_value(after_bytes - std::min(after_bytes, before_bytes));
    end.get_future().wait();
  });
  EXPECT_LT(freed_bytes.get_future().get(), 8 * kMiB) << "of 39 MiB";
  end.set_value();
  thread.join();
}

TEST(HeapTrim, KnowsWhatTheProcessHolds) { EXPECT_GT(resident_memory_bytes(), kMiB); }

}  // namespace
}  // namespace ccslice::server
