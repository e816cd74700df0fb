// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/scheduling/layer_stream.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <future>
#include <memory>
#include <mutex>
#include <random>
#include <stdexcept>
#include <thread>
#include <vector>

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;
using SteadyClock = std::chrono::steady_clock;

Executor::Lane lane_in(Executor& executor) { return executor.make_lane("client", Pieces::kBatch); }

/// A consumer that waits for its stream, as a call's pump does without waiting.
class Consumer {
 public:
  LayerStream::Notify notify() {
    return [this] {
      std::lock_guard lock(mutex_);
      ++notified_;
      changed_.notify_all();
    };
  }

  LayerStream::Pull pull(LayerStream& stream, Layer& layer) {
    while (true) {
      const LayerStream::Pull pulled = stream.pull(layer);
      if (pulled != LayerStream::Pull::kPending) return pulled;
      std::unique_lock lock(mutex_);
      ++waited_;
      if (!changed_.wait_for(lock, 10s, [this] { return notified_ == waited_; }))
        throw std::runtime_error("never notified");
    }
  }

  std::vector<std::uint32_t> pull_all(LayerStream& stream, LayerStream::Pull& last) {
    std::vector<std::uint32_t> indices;
    Layer layer;
    while ((last = pull(stream, layer)) == LayerStream::Pull::kLayer) indices.push_back(layer.index);
    return indices;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int notified_ = 0;
  int waited_ = 0;
};

Layer make_layer(std::uint32_t index) {
  Layer layer;
  layer.index = index;
  return layer;
}

std::vector<std::uint32_t> indices_of(LayerRange range) {
  std::vector<std::uint32_t> indices;
  for (std::uint32_t i = 0; i < range.count; ++i) indices.push_back(range.first + i);
  return indices;
}

/// Counts what is alive of anything that it hands out.
class Census {
 public:
  std::shared_ptr<void> count() {
    ++alive_;
    return std::shared_ptr<void>(nullptr, [this](void*) { --alive_; });
  }
  int alive() const { return alive_; }

 private:
  std::atomic<int> alive_ = 0;
};

TEST(LayerStream, DeliversEveryLayerInOrderHoweverLongEachTakes) {
  for (const std::size_t threads : {1u, 2u, 5u}) {
    Executor executor(threads);
    const LayerRange range{.first = 3, .count = 61};
    Consumer consumer;
    const auto make = [](const CancellationToken&) {
      return [](std::uint32_t index, const CancellationToken&) {
        std::this_thread::sleep_for(std::chrono::microseconds(index * 7919 % 700));
        return make_layer(index);
      };
    };
    const auto stream =
        LayerStream::start(lane_in(executor), range, {.slab_layers = 8, .window_slabs = 4}, make, consumer.notify());
    LayerStream::Pull last{};
    EXPECT_EQ(consumer.pull_all(*stream, last), indices_of(range));
    EXPECT_EQ(last, LayerStream::Pull::kEnd);
  }
}

TEST(LayerStream, StartsSlabsAtMultiplesOfTheirSizeSoThatWorkersKeepTheirState) {
  Executor executor(2);
  Consumer consumer;
  std::atomic<int> makes = 0;
  const auto make = [&](const CancellationToken&) {
    ++makes;
    return [](std::uint32_t index, const CancellationToken&) { return make_layer(index); };
  };
  // The window holds all: a stream that waits for its consumer lets functions go, as often as the consumer is late.
  const auto stream = LayerStream::start(lane_in(executor), {.first = 0, .count = 800},
                                         {.slab_layers = 8, .window_slabs = 100}, make, consumer.notify());
  LayerStream::Pull last{};
  EXPECT_EQ(consumer.pull_all(*stream, last).size(), 800u);
  EXPECT_LE(makes, 2) << "a worker's finished slab hands its function on";
}

TEST(LayerStream, AConsumerThatNeverPullsHoldsTheWindowAndNoThread) {
  Executor executor(2);
  std::atomic<int> computed = 0;
  const auto make = [&](const CancellationToken&) {
    return [&](std::uint32_t index, const CancellationToken&) {
      ++computed;
      return make_layer(index);
    };
  };
  const auto stream = LayerStream::start(lane_in(executor), {.first = 0, .count = 1'000'000},
                                         {.slab_layers = 4, .window_slabs = 3}, make, [] {});
  executor.wait_idle();  // Would not return if a worker waited for the consumer.
  EXPECT_EQ(computed, 12);
  Layer layer;
  for (int i = 0; i < 4; ++i) ASSERT_EQ(stream->pull(layer), LayerStream::Pull::kLayer);
  executor.wait_idle();
  EXPECT_EQ(computed, 16) << "one slab taken, one more started";
}

TEST(LayerStream, AFailedLayerFailsTheStreamAfterTheLayersBeforeIt) {
  Executor executor(3);
  Consumer consumer;
  const auto make = [](const CancellationToken&) {
    return [](std::uint32_t index, const CancellationToken&) {
      if (index == 19) throw Error(ErrorCode::kInternal, "layer 19");
      return make_layer(index);
    };
  };
  const auto stream = LayerStream::start(lane_in(executor), {.first = 0, .count = 100},
                                         {.slab_layers = 8, .window_slabs = 5}, make, consumer.notify());
  LayerStream::Pull last{};
  EXPECT_EQ(consumer.pull_all(*stream, last), indices_of({.first = 0, .count = 19}));
  EXPECT_EQ(last, LayerStream::Pull::kFailed);
  EXPECT_THROW(std::rethrow_exception(stream->error()), Error);
}

void work_for_5_s(const CancellationToken& cancel) {
  for (const auto end = SteadyClock::now() + 5s; SteadyClock::now() < end; std::this_thread::sleep_for(1ms)) {
    cancel.throw_if_cancelled();
  }
}

/// Cancels a stream whose workers are busy for 5 s; how long it takes until all is quiet.
std::chrono::nanoseconds time_to_cancel(const LayerStream::MakeCompute& make) {
  Executor executor(2);
  Consumer consumer;
  auto stream = LayerStream::start(lane_in(executor), {.first = 0, .count = 1000},
                                   {.slab_layers = 8, .window_slabs = 4}, make, consumer.notify());
  SteadyClock::time_point start;
  std::thread canceller([&] {
    std::this_thread::sleep_for(20ms);
    start = SteadyClock::now();
    stream->cancel();
  });
  Layer layer;
  EXPECT_EQ(consumer.pull(*stream, layer), LayerStream::Pull::kFailed) << "a waiting consumer is told";
  canceller.join();
  executor.wait_idle();
  const auto taken = SteadyClock::now() - start;
  try {
    std::rethrow_exception(stream->error());
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kCancelled);
  }
  stream->cancel();
  return taken;
}

/// Of three attempts: other programs may keep the processor for a while.
std::chrono::nanoseconds least_time_to_cancel(const LayerStream::MakeCompute& make) {
  std::chrono::nanoseconds least = 1h;
  for (int attempt = 0; attempt < 3; ++attempt) least = std::min(least, time_to_cancel(make));
  return least;
}

TEST(LayerStream, CancellingStopsTheWorkWithin100MsAndLeaksNothing) {
  Census census;
  std::atomic<int> computed = 0;
  const auto make = [&](const CancellationToken&) {
    return [&, own = census.count()](std::uint32_t index, const CancellationToken& cancel) {
      ++computed;
      work_for_5_s(cancel);
      return make_layer(index);
    };
  };
  EXPECT_LT(least_time_to_cancel(make), 100ms);
  EXPECT_LE(computed, 3 * 2);
  EXPECT_EQ(census.alive(), 0);
}

TEST(LayerStream, CancellingStopsWhatComesBeforeTheFirstLayerWithin100Ms) {
  std::atomic<int> made = 0;
  const auto make = [&](const CancellationToken& cancel) {
    work_for_5_s(cancel);
    ++made;
    return [](std::uint32_t index, const CancellationToken&) { return make_layer(index); };
  };
  EXPECT_LT(least_time_to_cancel(make), 100ms);
  EXPECT_EQ(made, 0);
}

TEST(LayerStream, AVanishedConsumerLeavesNothingBehind) {
  Census census;
  {
    Executor executor(2);
    const auto make = [&census](const CancellationToken&) {
      return [own = census.count()](std::uint32_t index, const CancellationToken&) { return make_layer(index); };
    };
    (void)LayerStream::start(lane_in(executor), {.first = 0, .count = 1000}, {.slab_layers = 8, .window_slabs = 4},
                             make, [] {});
  }
  EXPECT_EQ(census.alive(), 0);
}

TEST(LayerStream, StreamsShareTheThreadsLayerByLayer) {
  Executor executor(1, [] { return Executor::Clock::time_point(); });  // All layers take the same time.
  std::mutex mutex;
  std::vector<char> order;
  const auto make = [&](char name) {
    return [&, name](const CancellationToken&) {
      return [&, name](std::uint32_t index, const CancellationToken&) {
        std::lock_guard lock(mutex);
        order.push_back(name);
        return make_layer(index);
      };
    };
  };
  std::promise<void> gate;
  lane_in(executor).post([&] { gate.get_future().wait(); });
  const auto a = LayerStream::start(lane_in(executor), {.first = 0, .count = 8}, {.slab_layers = 8, .window_slabs = 2},
                                    make('a'), [] {});
  const auto b = LayerStream::start(lane_in(executor), {.first = 0, .count = 8}, {.slab_layers = 8, .window_slabs = 2},
                                    make('b'), [] {});
  gate.set_value();
  executor.wait_idle();
  EXPECT_EQ(std::string(order.begin(), order.end()), "abababababababab");
}

TEST(LayerStreamConsistency, ManyStreamsManyCancelsUnderLoad) {
  const auto seed = std::random_device()();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  Census census;
  Executor executor(4);
  std::vector<std::thread> clients;
  for (int client = 0; client < 6; ++client) {
    clients.emplace_back([&, own_seed = random()] {
      std::mt19937 own(own_seed);
      for (int round = 0; round < 20; ++round) {
        Consumer consumer;
        const auto make = [&census](const CancellationToken&) {
          return [own = census.count()](std::uint32_t index, const CancellationToken&) { return make_layer(index); };
        };
        const LayerRange range{.first = static_cast<std::uint32_t>(own() % 20),
                               .count = 1 + static_cast<std::uint32_t>(own() % 90)};
        const auto stream = LayerStream::start(lane_in(executor), range, {.slab_layers = 4, .window_slabs = 3}, make,
                                               consumer.notify());
        const std::uint32_t stop_at = own() % 2 == 0 ? range.count : own() % range.count;
        Layer layer;
        for (std::uint32_t i = 0; i < stop_at; ++i) {
          ASSERT_EQ(consumer.pull(*stream, layer), LayerStream::Pull::kLayer);
          ASSERT_EQ(layer.index, range.first + i);
        }
        stream->cancel();
        // Notifications of this consumer are over once its work is.
        while (stream.use_count() > 1) std::this_thread::yield();
      }
    });
  }
  for (std::thread& client : clients) client.join();
  executor.wait_idle();
  EXPECT_EQ(census.alive(), 0);
}

/// A layer whose contours occupy at least this much.
Layer make_layer_of_contours(std::uint32_t index, std::size_t bytes) {
  Layer layer = make_layer(index);
  layer.contours.loops.emplace_back();
  layer.contours.loops.back().points.resize(bytes / sizeof(ContourPoint) + 1);
  return layer;
}

TEST(LayerStream, CountsContoursThatNobodyCouldForesee) {
  constexpr std::uint64_t kLayerBytes = 1 << 20;
  constexpr std::size_t kThreads = 2;
  Census scratch;  // Pieces that end late give back what they hold of it.
  std::atomic<std::uint32_t> computed = 0;
  Executor executor(kThreads);
  const auto make = [&](const CancellationToken&) -> LayerStream::ComputeLayer {
    return [&computed, own = scratch.count()](std::uint32_t layer, const CancellationToken&) {
      ++computed;
      return make_layer_of_contours(layer, kLayerBytes);
    };
  };
  Consumer consumer;
  const auto stream = LayerStream::start(lane_in(executor), {.first = 3, .count = 100},
                                         choose_window(0, 4 * kLayerBytes, kThreads), make, consumer.notify());
  executor.wait_idle();
  EXPECT_LE(computed, 4 + kThreads) << "the window, and what was being computed when it filled up";
  EXPECT_LE(scratch.alive(), 1) << "a stream that has come to a stop keeps little else";
  LayerStream::Pull last{};
  EXPECT_EQ(consumer.pull_all(*stream, last), indices_of({.first = 3, .count = 100}));
  EXPECT_EQ(last, LayerStream::Pull::kEnd);
}

TEST(LayerStream, AFailureAheadDoesntKeepParkedLayersFromComing) {
  Executor executor(3);
  const auto make = [](const CancellationToken&) -> LayerStream::ComputeLayer {
    return [](std::uint32_t layer, const CancellationToken&) {
      if (layer == 12) throw std::runtime_error("layer 12");
      if (layer < 8) std::this_thread::sleep_for(1ms);
      return make_layer_of_contours(layer, 10'000);
    };
  };
  for (const std::uint64_t window_bytes : {std::uint64_t{1}, std::uint64_t{60'000}, std::uint64_t{1} << 30}) {
    Consumer consumer;
    const auto stream = LayerStream::start(lane_in(executor), {.first = 0, .count = 64},
                                           choose_window(0, window_bytes, 3), make, consumer.notify());
    executor.wait_idle();
    LayerStream::Pull last{};
    EXPECT_EQ(consumer.pull_all(*stream, last), indices_of({.first = 0, .count = 12}));
    EXPECT_EQ(last, LayerStream::Pull::kFailed);
  }
}

TEST(LayerStream, ALayerLargerThanTheWindowStillComes) {
  Executor executor(3);
  const auto make = [](const CancellationToken&) -> LayerStream::ComputeLayer {
    return [](std::uint32_t layer, const CancellationToken&) { return make_layer_of_contours(layer, 10'000); };
  };
  Consumer consumer;
  const auto stream = LayerStream::start(lane_in(executor), {.first = 0, .count = 50}, choose_window(0, 100, 3), make,
                                         consumer.notify());
  LayerStream::Pull last{};
  EXPECT_EQ(consumer.pull_all(*stream, last).size(), 50u);
  EXPECT_EQ(last, LayerStream::Pull::kEnd);
}

TEST(StreamWindow, IsASlabPerThreadAndTwoMoreWhereMemoryAllows) {
  const StreamWindow window = choose_window(1000, 1 << 30, 4);
  EXPECT_EQ(window.slab_layers, kSlabLayers);
  EXPECT_EQ(window.window_slabs, 6u);
}

TEST(StreamWindow, HasSmallerSlabsForLargerLayers) {
  const StreamWindow window = choose_window(10 << 20, 100 << 20, 2);
  EXPECT_EQ(window.slab_layers, 2u);
  EXPECT_EQ(window.window_slabs, 4u);
}

TEST(StreamWindow, NeverExceedsItsBytesUnlessForOneLayer) {
  for (std::uint64_t layer_bytes : {0ull, 1ull, 1000ull, 1'000'000ull, 60'000'000ull, 1'000'000'000ull}) {
    for (std::size_t threads : {1u, 2u, 64u}) {
      const StreamWindow window = choose_window(layer_bytes, 64 << 20, threads);
      const std::uint64_t layers = std::uint64_t{window.slab_layers} * window.window_slabs;
      EXPECT_TRUE(layers == 1 || layers * layer_bytes <= 64 << 20) << layer_bytes << " " << threads;
      EXPECT_EQ(kSlabLayers % window.slab_layers, 0u);
    }
  }
}

/// A stream whose functions are counted, and made only as a switch says.
class LimitedStream : public ::testing::Test {
 protected:
  LayerStream::MakeCompute make() {
    return [this](const CancellationToken&) {
      return [this, counted = census_.count()](std::uint32_t index, const CancellationToken&) {
        most_alive_ = std::max<int>(most_alive_, census_.alive());
        std::this_thread::sleep_for(100us);
        return make_layer(index);
      };
    };
  }
  ComputeLimit limit() {
    return {.may_add = [this] { return may_add_.load(); }, .is_crowded = [this] { return crowded_.load(); }};
  }

  Census census_;
  std::atomic<int> most_alive_ = 0;
  std::atomic<bool> may_add_ = true, crowded_ = false;
  Executor executor_{4};
  Consumer consumer_;
};

TEST_F(LimitedStream, ComesToItsEndWithOneFunctionAlone) {
  may_add_ = false;
  const LayerRange range{.first = 5, .count = 300};
  const auto stream = LayerStream::start(lane_in(executor_), range, {.slab_layers = 4, .window_slabs = 6}, make(),
                                         consumer_.notify(), limit());
  LayerStream::Pull last{};
  EXPECT_EQ(consumer_.pull_all(*stream, last), indices_of(range));
  EXPECT_EQ(most_alive_, 1);
}

TEST_F(LimitedStream, GivesFunctionsBackWhileOthersNeedThemAndTakesMoreLater) {
  const auto stream = LayerStream::start(lane_in(executor_), {.first = 0, .count = 100'000},
                                         {.slab_layers = 16, .window_slabs = 6}, make(), consumer_.notify(), limit());
  Layer layer;
  const auto pull_until = [&](const auto& holds) {
    for (int i = 0; i < 20'000 && !holds(); ++i) {
      if (consumer_.pull(*stream, layer) != LayerStream::Pull::kLayer) return false;
    }
    return holds();
  };
  EXPECT_TRUE(pull_until([this] { return census_.alive() >= 2; }));
  may_add_ = false;
  crowded_ = true;
  EXPECT_TRUE(pull_until([this] { return census_.alive() == 1; }));
  for (int i = 0; i < 100; ++i) {
    ASSERT_EQ(consumer_.pull(*stream, layer), LayerStream::Pull::kLayer);
    EXPECT_EQ(census_.alive(), 1);
  }
  may_add_ = true;
  crowded_ = false;
  EXPECT_TRUE(pull_until([this] { return census_.alive() >= 2; }));
  stream->cancel();
  executor_.wait_idle();
}

TEST_F(LimitedStream, HasMoreSlabsInFlightWhenToldTo) {
  const auto stream = LayerStream::start(lane_in(executor_), {.first = 0, .count = 100'000},
                                         {.slab_layers = 4, .window_slabs = 1}, make(), consumer_.notify());
  executor_.wait_idle();
  EXPECT_EQ(most_alive_, 1);
  stream->set_window_slabs(8);
  executor_.wait_idle();
  Layer layer;
  for (int i = 0; i < 32; ++i) ASSERT_EQ(stream->pull(layer), LayerStream::Pull::kLayer) << i;
  stream->cancel();
  executor_.wait_idle();
  EXPECT_EQ(census_.alive(), 0);
}

}  // namespace
}  // namespace ccslice::server
