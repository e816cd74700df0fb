// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Work that goes on beside its caller's, on another thread of the caller's arena.
//
// A tbb::task_group alone would end the process where both throw at about the same time, as both do when they are
// cancelled: its destructor waits for the task while the stack is unwound, and throws what that threw.
//
// Private to core/limit.

#pragma once

#include <tbb/task_group.h>

#include <exception>
#include <utility>

namespace ccslice {

/// One thread; waits for the end of its work before it goes.
class BesideTask {
 public:
  BesideTask() = default;
  BesideTask(const BesideTask&) = delete;
  BesideTask& operator=(const BesideTask&) = delete;
  ~BesideTask() { group_.wait(); }

  /// REQUIRES: nothing that was run before goes on.
  template <typename Work>
  void run(Work work) {
    group_.run([this, work] {
      try {
        work();
      } catch (...) {
        thrown_ = std::current_exception();
      }
    });
  }
  /// Throws what the work threw.
  void wait() {
    group_.wait();
    if (std::exception_ptr thrown = std::exchange(thrown_, nullptr)) std::rethrow_exception(std::move(thrown));
  }

 private:
  tbb::task_group group_;
  std::exception_ptr thrown_;
};

}  // namespace ccslice
