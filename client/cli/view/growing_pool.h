// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Threads for connections: as many as there are at once, so that those whose other end is slow keep nobody waiting.

#pragma once

#include <httplib.h>
#undef _res  // A macro of <resolv.h>, and a parameter's name in Eigen.

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace ccslice::cli {

class GrowingPool : public httplib::TaskQueue {
 public:
  /// Beyond `most` threads, tasks wait for one.
  explicit GrowingPool(std::size_t most) : most_(most) {}
  ~GrowingPool() override { shutdown(); }

  void enqueue(std::function<void()> task) override;
  /// Ends when all tasks are done.
  void shutdown() override;

 private:
  void work();

  const std::size_t most_;
  std::mutex mutex_;  // Guards what follows.
  std::condition_variable changed_;
  std::deque<std::function<void()>> tasks_;
  std::size_t idle_ = 0;  // Threads that wait for a task.
  bool over_ = false;
  std::vector<std::jthread> threads_;
};

}  // namespace ccslice::cli
