// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Knows the calls that are OPEN: those whose status isn't on its way to the client yet, behind all messages, and those
// whose only answer isn't read yet. A drain waits for them, and may cut them off in the end.
//
// Each takes memory, and so many may be open as there is for them. A quarter of that is never one client's. An answer
// that isn't read yet counts as further calls, one for every 16 KiB.

#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <mutex>
#include <string>
#include <unordered_map>
#include <utility>

namespace ccslice::server {

/// Thread-safe.
class CallRegistry {
 public:
  /// `most`: may be open at the same time.
  explicit CallRegistry(std::size_t most = std::numeric_limits<std::size_t>::max()) : most_(most) {}

  /// An open call. Movable; the call is closed with it.
  class [[nodiscard]] Ticket {
   public:
    Ticket() = default;
    Ticket(CallRegistry& registry, std::uint64_t number) : registry_(&registry), number_(number) {}
    Ticket(Ticket&& other) noexcept : registry_(std::exchange(other.registry_, nullptr)), number_(other.number_) {}
    Ticket& operator=(Ticket&& other) noexcept {
      std::swap(registry_, other.registry_);
      std::swap(number_, other.number_);
      return *this;
    }
    /// Counts an answer, until the call is closed. False if there is no room for it.
    [[nodiscard]] bool hold(std::uint64_t bytes) { return registry_->hold(number_, bytes); }
    ~Ticket() {
      if (registry_ != nullptr) registry_->close(number_);
    }

   private:
    CallRegistry* registry_ = nullptr;
    std::uint64_t number_ = 0;
  };

  /// `cut_off` stops the call, for cut_off_all(): on any thread, perhaps when the call is over already, so it keeps
  /// alive what it needs or does without. `check`, likewise, stops it if its client may not make it any more. `client`:
  /// who makes the call (client_id.h). Throws ServiceError{kServerDraining, kServerBusy}.
  [[nodiscard]] Ticket open_call(std::function<void()> cut_off = {}, const std::string& client = {},
                                 std::function<void()> check = {});
  /// Opens no more calls from now on.
  void drain();
  /// Waits until no call is open, but not beyond `deadline`. Whether none is.
  [[nodiscard]] bool wait_idle(std::chrono::steady_clock::time_point deadline);
  /// Stops all open calls. Doesn't wait for them.
  void cut_off_all();
  /// Has all open calls look whether their clients may still make them.
  void check_all();
  /// Whether cut_off_all() has been called: then that is why calls stop.
  bool cutting_off() const noexcept { return cutting_off_.load(); }
  std::size_t open();

 private:
  struct Call {
    std::function<void()> cut_off, check;
    std::string client;
    std::size_t counts = 1;
  };

  /// Runs one of the functions of all, without the lock.
  void run_all(std::function<void()> Call::*function);
  bool hold(std::uint64_t number, std::uint64_t bytes);
  void close(std::uint64_t number);
  bool has_room(const std::string& client, std::size_t more) const;
  void count(const std::string& client, std::size_t more);

  const std::size_t most_;
  std::mutex mutex_;
  std::condition_variable idle_;
  bool draining_ = false;
  std::uint64_t opened_ = 0;
  std::map<std::uint64_t, Call> calls_;                      // Those that are open, by their numbers.
  std::size_t counted_ = 0;                                  // They, and their answers;
  std::unordered_map<std::string, std::size_t> counted_of_;  // of each client.
  std::atomic<bool> cutting_off_{false};
};

}  // namespace ccslice::server
