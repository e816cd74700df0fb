// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/beside_task.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <stdexcept>
#include <thread>

namespace ccslice {
namespace {

TEST(BesideTask, IsDoneAfterTheWait) {
  tbb::task_arena(2).execute([] {
    BesideTask task;
    int done = 0;
    for (int i = 1; i <= 100; ++i) {
      task.run([&] { ++done; });
      task.wait();
      EXPECT_EQ(done, i);
    }
  });
}

TEST(BesideTask, ThrowsOnTheThreadThatWaits) {
  tbb::task_arena(2).execute([] {
    BesideTask task;
    task.run([] { throw std::runtime_error("beside"); });
    EXPECT_THROW(task.wait(), std::runtime_error);
    task.run([] {});
    EXPECT_NO_THROW(task.wait()) << "what was thrown is thrown once";
  });
}

// As where both are cancelled: the caller leaves with its own error, and the work's is forgotten.
TEST(BesideTask, EndsWithItsCallerIfBothThrow) {
  for (int i = 0; i < 1000; ++i) {
    std::atomic<bool> began{false};
    const auto both_throw = [&] {
      BesideTask task;
      task.run([&] {
        began = true;
        throw std::runtime_error("beside");
      });
      for (int spin = 0; spin < 100 * (i % 8) && !began; ++spin) std::this_thread::yield();
      throw std::logic_error("own");
    };
    EXPECT_THROW(tbb::task_arena(2).execute(both_throw), std::logic_error);
    EXPECT_TRUE(began) << "it ended before its caller";
  }
}

}  // namespace
}  // namespace ccslice
