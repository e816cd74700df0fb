// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/layer_queue.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace ccslice::client {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kSoon(20), kLate(20'000);
constexpr std::uint64_t kRoomy = 1 << 30;

Layer layer_of(std::uint32_t index, std::size_t bytes = 10) {
  Layer layer;
  layer.index = index;
  layer.planes.emplace_back().samples.assign(bytes, 'x');
  return layer;
}

TEST(LayerQueue, GivesBlocksThatMakeUpTheWhole) {
  LayerQueue queue({1000, 1000}, 2, kRoomy);
  std::uint32_t next = 1000, last = 1000;
  while (const auto block = queue.take()) {
    EXPECT_EQ(block->first, next);
    EXPECT_LE(block->count, std::min(64u, last)) << "blocks get smaller";
    EXPECT_GE(block->count, std::min(16u, 2000 - next));
    next += block->count;
    last = block->count;
  }
  EXPECT_EQ(next, 2000u);
  EXPECT_LE(last, 16u);
}

TEST(LayerQueue, GivesSmallerBlocksWhereLayersAreLarge) {
  LayerQueue queue({0, 1000}, 2, 1'000'000);
  EXPECT_EQ(queue.take()->count, 64u);
  EXPECT_TRUE(queue.put({}, layer_of(0, 100'000)));
  EXPECT_EQ(queue.take()->count, 4u);
  ASSERT_TRUE(queue.next(kLate));
  EXPECT_TRUE(queue.put({}, layer_of(1, 10'000'000)));
  EXPECT_EQ(queue.take()->count, 1u);
}

TEST(LayerQueue, PutsLayersInOrder) {
  LayerQueue queue({5, 3}, 2, kRoomy);
  EXPECT_FALSE(queue.done());
  queue.put({}, layer_of(7));
  queue.put({}, layer_of(6));
  EXPECT_FALSE(queue.next(kSoon));
  queue.put({}, layer_of(5));
  for (const std::uint32_t index : {5, 6, 7}) EXPECT_EQ(queue.next(kLate)->layer.index, index);
  EXPECT_TRUE(queue.done());
}

TEST(LayerQueue, KeepsNoMoreThanItMayAndAlwaysTakesTheLayerThatIsDue) {
  LayerQueue queue({0, 100}, 2, 50'000);
  queue.put({}, layer_of(10, 40'000));
  std::atomic<bool> in = false;
  std::thread early([&] {
    queue.put({}, layer_of(11, 40'000));
    in = true;
  });
  queue.put({}, layer_of(0, 40'000));
  ASSERT_TRUE(queue.next(kLate));
  EXPECT_FALSE(in) << "there is no room yet";
  for (std::uint32_t index = 1; index <= 10; ++index) {
    if (index < 10) queue.put({}, layer_of(index, 40'000));
    ASSERT_TRUE(queue.next(kLate));
  }
  EXPECT_EQ(queue.next(kLate)->layer.index, 11u);
  early.join();
}

TEST(LayerQueue, EndsWithTheFirstFailure) {
  LayerQueue queue({0, 100}, 2, kRoomy);
  queue.put({}, layer_of(0));
  queue.fail(std::make_exception_ptr(std::runtime_error("first")));
  queue.fail(std::make_exception_ptr(std::logic_error("second")));
  EXPECT_TRUE(queue.next(kLate)) << "what is there is still delivered";
  EXPECT_THROW(queue.next(kLate), std::runtime_error);
  EXPECT_FALSE(queue.take());
  EXPECT_FALSE(queue.put({}, layer_of(1)));
}

TEST(LayerQueue, WakesThoseWhoWaitForRoomWhenItStops) {
  LayerQueue queue({0, 100}, 2, 1);
  std::thread early([&] { EXPECT_FALSE(queue.put({}, layer_of(50))); });
  std::this_thread::sleep_for(kSoon);
  queue.stop();
  early.join();
}

TEST(LayerQueue, BringsEveryLayerOnceFromThreadsOfAnyPace) {
  const auto seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  LayerQueue queue({17, 2000}, 4, 20'000);
  std::vector<std::thread> threads;
  for (unsigned t = 0; t < 4; ++t) {
    threads.emplace_back([&, random = std::minstd_rand(seed + t)]() mutable {
      while (const auto block = queue.take()) {
        for (std::uint32_t i = 0; i < block->count; ++i) {
          if (random() % 100 == 0) std::this_thread::sleep_for(std::chrono::microseconds(random() % 500));
          ASSERT_TRUE(queue.put({}, layer_of(block->first + i, random() % 2000)));
        }
      }
    });
  }
  for (std::uint32_t index = 17; !queue.done(); ++index) {
    const auto item = queue.next(kLate);
    ASSERT_TRUE(item);
    ASSERT_EQ(item->layer.index, index);
  }
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace ccslice::client
