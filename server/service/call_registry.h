// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Counts the calls that compute, so that there are never more than the server takes, and none once it drains.

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
  /// A running call. Movable; the call ends with it.
  class Ticket {
   public:
    Ticket() = default;
    explicit Ticket(CallRegistry& registry) : registry_(&registry) {}
    Ticket(Ticket&& other) noexcept : registry_(std::exchange(other.registry_, nullptr)) {}
    Ticket& operator=(Ticket&& other) noexcept {
      std::swap(registry_, other.registry_);
      return *this;
    }
    ~Ticket() {
      if (registry_ != nullptr) registry_->leave();
    }

   private:
    CallRegistry* registry_ = nullptr;
  };

  explicit CallRegistry(std::size_t max_calls) : max_calls_(max_calls) {}

  /// Throws ServiceError{kServerBusy, kServerDraining}.
  Ticket admit();
  /// From now on nothing is admitted.
  void drain();
  /// Waits until no call is running, but not beyond `deadline`. Whether none is.
  bool wait_idle(std::chrono::steady_clock::time_point deadline);
  std::size_t running();

 private:
  void leave();

  const std::size_t max_calls_;
  std::mutex mutex_;
  std::condition_variable idle_;
  std::size_t running_ = 0;
  bool draining_ = false;
};

}  // namespace ccslice::server
