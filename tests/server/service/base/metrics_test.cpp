// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/base/metrics.h"

#include <gtest/gtest.h>

#include <numeric>
#include <thread>
#include <vector>

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

TEST(DurationHistogramTest, CountsUpToEachBound) {
  DurationHistogram durations;
  durations.add(0ns);
  durations.add(1ms);  // At the bound: within it.
  durations.add(2ms);
  durations.add(3h);
  const DurationHistogram::Counts counts = durations.counts();
  EXPECT_EQ(counts.in.front(), 2u);
  EXPECT_EQ(counts.in[1], 1u);
  EXPECT_EQ(counts.in.back(), 1u);
  EXPECT_EQ(counts.all, 4u);
  EXPECT_DOUBLE_EQ(counts.sum_s, 10800.003);
}

TEST(MetricsTest, ManyThreadsCount) {
  Metrics metrics;
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&metrics, i] {
      for (int round = 0; round < 1000; ++round) {
        metrics.calls.add("SliceRange", i % 2 == 0 ? "OK" : "SERVER_BUSY");
        metrics.seconds_in_all.add(1ms);
        ++metrics.layers;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(metrics.calls.counts().at({"SliceRange", "OK"}), 2000u);
  EXPECT_EQ(metrics.calls.counts().at({"SliceRange", "SERVER_BUSY"}), 2000u);
  EXPECT_EQ(metrics.seconds_in_all.counts().all, 4000u);
  EXPECT_EQ(metrics.layers, 4000u);
}

}  // namespace
}  // namespace ccslice::server
