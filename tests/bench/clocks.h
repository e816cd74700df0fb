// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <chrono>
#include <ctime>
#include <utility>

namespace ccslice::bench {

/// CPU time of the calling thread: what a stage costs, however busy the machine is.
inline double thread_cpu_ns() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e9 * static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec);
}

/// Runs `work` and adds the calling thread's CPU time to `total_ns`.
template <class Work>
auto timed(double& total_ns, Work&& work) {
  struct Stop {
    double& total_ns;
    double begin_ns;
    ~Stop() { total_ns += thread_cpu_ns() - begin_ns; }
  } stop{total_ns, thread_cpu_ns()};
  return std::forward<Work>(work)();
}

/// Wall time.
class Stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count(); }

 private:
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace ccslice::bench
