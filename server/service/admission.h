// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Who may compute, and who waits for it. So many calls RUN; so many more WAIT, in the order in which they came, for at
// most so long; further ones are refused and told when to come again. A call that waits holds no thread and nothing of
// the server's but its request.

#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <functional>
#include <list>
#include <mutex>
#include <thread>

namespace ccslice::server {

struct AdmissionLimits {
  std::size_t running = 32;
  std::size_t waiting = 0;
  std::chrono::milliseconds longest_wait{10'000};
};

/// Thread-safe. Must outlive its places.
class Admission {
 public:
  /// Runs once: with nothing if there is a place, with a ServiceError{kServerBusy, kServerDraining} if not. On the
  /// thread that asked, or later on any other one.
  using Decision = std::function<void(std::exception_ptr refusal)>;

  /// A call's place, once. Gives it back when it goes.
  class Place {
   public:
    explicit Place(Admission& admission) : admission_(admission) {}
    ~Place() { admission_.give_back(*this); }
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;

   private:
    friend class Admission;
    enum class State { kNone, kWaiting, kRunning };

    Admission& admission_;
    State state_ = State::kNone;
    Decision decision_;  // While it waits.
    std::chrono::steady_clock::time_point since_;
    std::list<Place*>::iterator position_;  // In the queue, while it waits.
  };

  explicit Admission(const AdmissionLimits& limits);
  ~Admission();
  Admission(const Admission&) = delete;
  Admission& operator=(const Admission&) = delete;

  /// REQUIRES: the first time for this place.
  void request(Place& place, Decision decision);
  /// Whether the call was waiting. Then it doesn't any more, and its decision never runs.
  bool leave_queue(Place& place);
  /// Ends a run, and begins that of a call that waits. Does nothing for a place that isn't running. A run that ends
  /// while this begins it is followed by the next one only after its decision has returned.
  void give_back(Place& place);
  /// Refuses those who wait, and all who come from now on.
  void drain();

  std::size_t running() const;
  std::size_t waiting() const;

 private:
  using Clock = std::chrono::steady_clock;

  void expire_waits();
  std::exception_ptr busy() const;
  std::chrono::seconds retry_delay() const;
  void take_out(Place& place, Place::State state);

  const AdmissionLimits limits_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::list<Place*> queue_;
  std::size_t running_ = 0;
  bool draining_ = false, over_ = false;
  Clock::time_point last_end_ = Clock::now();  // Of a run while calls wait, or when the first one began to.
  double pace_s_ = 1;                          // Between the ends of runs while calls wait, smoothed.
  std::thread clock_;
};

}  // namespace ccslice::server
