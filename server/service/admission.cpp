// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/admission.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "server/service/service_error.h"

namespace ccslice::server {
namespace {

std::exception_ptr draining() {
  return std::make_exception_ptr(
      ServiceError(ServiceErrorCode::kServerDraining, "the server is shutting down: use another one"));
}

/// Runs decisions one after the other, those too that come up while one of them runs: calls that end as soon as they
/// begin would otherwise be stacked on one another, as many as wait.
void run_in_turn(std::function<void()> decision) {
  thread_local std::vector<std::function<void()>>* to_come = nullptr;
  if (to_come != nullptr) return to_come->push_back(std::move(decision));
  std::vector<std::function<void()>> decisions;
  decisions.push_back(std::move(decision));
  to_come = &decisions;
  while (!decisions.empty()) {
    const std::function<void()> next = std::move(decisions.back());
    decisions.pop_back();
    next();
  }
  to_come = nullptr;
}

}  // namespace

Admission::Admission(const AdmissionLimits& limits) : limits_(limits), clock_([this] { expire_waits(); }) {}

Admission::~Admission() {
  {
    const std::lock_guard lock(mutex_);
    over_ = true;
  }
  changed_.notify_all();
  clock_.join();
}

void Admission::request(Place& place, Decision decision) {
  std::exception_ptr refusal;
  {
    const std::lock_guard lock(mutex_);
    if (draining_) {
      refusal = draining();
    } else if (running_ < limits_.running) {
      ++running_;
      place.state_ = Place::State::kRunning;
    } else if (queue_.size() < limits_.waiting) {
      place.state_ = Place::State::kWaiting;
      place.decision_ = std::move(decision);
      place.since_ = Clock::now();
      place.position_ = queue_.insert(queue_.end(), &place);
      if (queue_.size() > 1) return;
      last_end_ = place.since_;  // What ended while nobody waited says nothing of the pace.
      changed_.notify_all();
      return;
    } else {
      refusal = busy();
    }
  }
  decision(refusal);
}

bool Admission::leave_queue(Place& place) {
  Decision dropped;  // It may hold the last reference to the call: it goes after the lock.
  const std::lock_guard lock(mutex_);
  if (place.state_ != Place::State::kWaiting) return false;
  dropped = std::move(place.decision_);
  take_out(place, Place::State::kNone);
  return true;
}

void Admission::give_back(Place& place) {
  Decision next;
  {
    const std::lock_guard lock(mutex_);
    if (place.state_ == Place::State::kWaiting) take_out(place, Place::State::kNone);
    if (place.state_ != Place::State::kRunning) return;
    place.state_ = Place::State::kNone;
    const Clock::time_point now = Clock::now();
    if (!queue_.empty()) {
      constexpr double kWeight = 0.1;
      pace_s_ += kWeight * (std::chrono::duration<double>(now - last_end_).count() - pace_s_);
      Place& first = *queue_.front();
      next = std::move(first.decision_);
      take_out(first, Place::State::kRunning);
      last_end_ = now;
    } else {
      --running_;
    }
  }
  if (next) run_in_turn([next = std::move(next)] { next(nullptr); });
}

void Admission::drain() {
  std::vector<Decision> refused;
  {
    const std::lock_guard lock(mutex_);
    draining_ = true;
    while (!queue_.empty()) {
      refused.push_back(std::move(queue_.front()->decision_));
      take_out(*queue_.front(), Place::State::kNone);
    }
  }
  for (const Decision& decision : refused) decision(draining());
}

std::size_t Admission::running() const {
  const std::lock_guard lock(mutex_);
  return running_;
}

std::size_t Admission::waiting() const {
  const std::lock_guard lock(mutex_);
  return queue_.size();
}

/// All wait for the same time, so the first one's ends first.
void Admission::expire_waits() {
  std::unique_lock lock(mutex_);
  while (!over_) {
    if (queue_.empty()) {
      changed_.wait(lock);
      continue;
    }
    Place& first = *queue_.front();
    const Clock::time_point end = first.since_ + limits_.longest_wait;
    if (Clock::now() < end) {
      changed_.wait_until(lock, end);
      continue;
    }
    Decision decision = std::move(first.decision_);
    take_out(first, Place::State::kNone);
    const std::exception_ptr refusal = busy();
    lock.unlock();
    decision(refusal);
    decision = nullptr;  // It may hold the last reference to the call, whose place comes here again.
    lock.lock();
  }
}

/// REQUIRES: the lock, and a place that waits.
void Admission::take_out(Place& place, Place::State state) {
  queue_.erase(place.position_);
  place.state_ = state;
}

std::exception_ptr Admission::busy() const {
  return std::make_exception_ptr(ServiceError(ServiceErrorCode::kServerBusy,
                                              "all " + std::to_string(limits_.running) +
                                                  " calls that the server takes are running, and " +
                                                  std::to_string(queue_.size()) + " wait: try again later",
                                              retry_delay()));
}

/// When those who wait will have been served, at the pace of late.
std::chrono::seconds Admission::retry_delay() const {
  constexpr double kShortest = 1, kLongest = 30;
  const double seconds = std::ceil(pace_s_ * static_cast<double>(queue_.size() + 1));
  return std::chrono::seconds(static_cast<long>(std::clamp(seconds, kShortest, kLongest)));
}

}  // namespace ccslice::server
