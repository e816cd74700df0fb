// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Counts the calls that compute, so that there are never more than the server takes, and none new once it drains.
//
// A call RUNS until it has its status; it is OPEN until the status is on its way to the client, behind all messages.
// What is only open takes no part in the limit, but a drain waits for it.

#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <utility>

namespace ccslice::server {

/// Thread-safe.
class CallRegistry {
 public:
  /// An open call. Movable; the call is closed with it.
  class Ticket {
   public:
    Ticket() = default;
    explicit Ticket(CallRegistry& registry) : registry_(&registry), running_(true) {}
    Ticket(Ticket&& other) noexcept
        : registry_(std::exchange(other.registry_, nullptr)), running_(std::exchange(other.running_, false)) {}
    Ticket& operator=(Ticket&& other) noexcept {
      std::swap(registry_, other.registry_);
      std::swap(running_, other.running_);
      return *this;
    }
    ~Ticket() {
      end_run();
      if (registry_ != nullptr) registry_->close();
    }

    /// The call has its status. Any number of times, but by one thread at a time.
    void end_run() {
      if (std::exchange(running_, false)) registry_->end_run();
    }

   private:
    CallRegistry* registry_ = nullptr;
    bool running_ = false;
  };

  explicit CallRegistry(std::size_t max_calls) : max_calls_(max_calls) {}

  /// Throws ServiceError{kServerBusy, kServerDraining}.
  Ticket admit();
  /// From now on nothing is admitted.
  void drain();
  /// Waits until no call is open, but not beyond `deadline`. Whether none is.
  bool wait_idle(std::chrono::steady_clock::time_point deadline);
  std::size_t running();
  std::size_t open();

 private:
  void end_run();
  void close();

  const std::size_t max_calls_;
  std::mutex mutex_;
  std::condition_variable idle_;
  std::size_t running_ = 0;
  std::size_t open_ = 0;
  bool draining_ = false;
};

}  // namespace ccslice::server
