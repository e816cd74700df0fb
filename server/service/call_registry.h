// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Counts the calls that compute, so that there are never more than the server takes, and none new once it drains.
//
// A call RUNS until it has its status; it is OPEN until the status is on its way to the client, behind all messages.
// What is only open takes no part in the limit, but a drain waits for it, and may cut it off in the end.

#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <utility>

namespace ccslice::server {

/// Thread-safe.
class CallRegistry {
 public:
  /// An open call. Movable; the call is closed with it.
  class [[nodiscard]] Ticket {
   public:
    Ticket() = default;
    Ticket(CallRegistry& registry, std::uint64_t number) : registry_(&registry), number_(number), running_(true) {}
    Ticket(Ticket&& other) noexcept
        : registry_(std::exchange(other.registry_, nullptr)),
          number_(other.number_),
          running_(std::exchange(other.running_, false)) {}
    Ticket& operator=(Ticket&& other) noexcept {
      std::swap(registry_, other.registry_);
      std::swap(number_, other.number_);
      std::swap(running_, other.running_);
      return *this;
    }
    ~Ticket() {
      end_run();
      if (registry_ != nullptr) registry_->close(number_);
    }

    /// Says that the call has its status. May be called any number of times, but by one thread at a time.
    void end_run() {
      if (std::exchange(running_, false)) registry_->end_run();
    }

   private:
    CallRegistry* registry_ = nullptr;
    std::uint64_t number_ = 0;
    bool running_ = false;
  };

  explicit CallRegistry(std::size_t max_calls) : max_calls_(max_calls) {}

  /// `cut_off` stops the call, for cut_off_all(): on any thread, perhaps when the call is over already, so it keeps
  /// alive what it needs or does without. Throws ServiceError{kServerBusy, kServerDraining}.
  [[nodiscard]] Ticket admit(std::function<void()> cut_off = {});
  /// Admits no more calls from now on.
  void drain();
  /// Waits until no call is open, but not beyond `deadline`. Whether none is.
  [[nodiscard]] bool wait_idle(std::chrono::steady_clock::time_point deadline);
  /// Stops all open calls. Doesn't wait for them.
  void cut_off_all();
  /// Whether cut_off_all() has been called: then that is why calls stop.
  bool cutting_off() const noexcept { return cutting_off_.load(); }
  std::size_t running();
  std::size_t open();

 private:
  void end_run();
  void close(std::uint64_t number);

  const std::size_t max_calls_;
  std::mutex mutex_;
  std::condition_variable idle_;
  std::size_t running_ = 0;
  std::size_t open_ = 0;
  bool draining_ = false;
  std::uint64_t admitted_ = 0;
  std::map<std::uint64_t, std::function<void()>> cut_offs_;  // How to cut off the open calls, by their numbers.
  std::atomic<bool> cutting_off_{false};
};

}  // namespace ccslice::server
