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

void Admission::request(Place& place, Decision decision, bool is_long) {
  place.is_long_ = is_long;
  enter(place, Place::Turn::kIsNew, {}, std::move(decision));
}

void Admission::request_memory(Place& place, Memory memory, Decision decision) {
  enter(place, Place::Turn::kHasBegun, std::move(memory), std::move(decision));
}

void Admission::resume(Place& place, Memory memory, Decision decision) {
  enter(place, Place::Turn::kResumes, std::move(memory), std::move(decision));
}

void Admission::enter(Place& place, Place::Turn turn, Memory memory, Decision decision) {
  std::exception_ptr refusal;
  std::vector<Decision> admitted;
  bool waits = false;
  {
    const std::lock_guard lock(mutex_);
    const bool had_place = place.state_ == Place::State::kRunning;
    if (had_place) stop_running(place);
    if (memory.reserve) place.is_long_ = !memory.is_short;
    const bool is_refused = draining_ && !is_under_way(place, turn);
    const bool has_place = (had_place || !is_refused) && has_place_for(place);
    if (has_place && has_memory_for(turn, memory)) {
      run(place);
    } else if (!is_refused && (turn == Place::Turn::kResumes || expiring_ < limits_.waiting)) {
      waits = true;
      insert(place, turn, std::move(memory), std::move(decision), /*lacks_memory=*/has_place);
      if (had_place) admit(admitted);  // To the place that it had.
    } else {
      refusal = is_refused ? draining() : busy(/*for_memory=*/has_place);
      if (had_place) {
        place.is_long_ = false;
        run(place);
      }
    }
  }
  if (!waits) decision(refusal);
  for (Decision& next : admitted) run_in_turn([next = std::move(next)] { next(nullptr); });
}

/// Such a call may end in its own time when calls drain.
bool Admission::is_under_way(const Place& place, Place::Turn turn) {
  return turn == Place::Turn::kResumes || (turn == Place::Turn::kIsNew && place.has_run_);
}

/// REQUIRES: the lock.
bool Admission::has_place_for(const Place& place) const {
  return running_ < limits_.running + limits_.short_more && (!place.is_long_ || long_running_ < limits_.running);
}

/// Takes it if so. REQUIRES: the lock.
bool Admission::has_memory_for(Place::Turn turn, const Memory& memory) const {
  if (!memory.reserve) return true;
  const bool others_come_first = std::ranges::any_of(queue_, [&](const Place* other) {
    return other->turn_ <= turn && other->lacks_memory_ && (other->memory_.is_short || !memory.is_short);
  });
  return !others_come_first && memory.reserve();
}

/// REQUIRES: the lock.
void Admission::run(Place& place) {
  place.state_ = Place::State::kRunning;
  place.has_run_ = true;
  ++running_;
  if (place.is_long_) ++long_running_;
}

/// REQUIRES: the lock.
void Admission::stop_running(Place& place) {
  place.state_ = Place::State::kNone;
  --running_;
  if (place.is_long_) --long_running_;
}

/// REQUIRES: the lock.
void Admission::insert(Place& place, Place::Turn turn, Memory memory, Decision decision, bool lacks_memory) {
  place.state_ = Place::State::kWaiting;
  place.turn_ = turn;
  place.memory_ = std::move(memory);
  place.decision_ = std::move(decision);
  place.since_ = Clock::now();
  auto behind = queue_.end();
  if (turn != Place::Turn::kIsNew) {
    // Short ones before long ones: else these would take turns with the memory that one of those needs.
    const bool goes_first = turn == Place::Turn::kHasBegun && place.memory_.is_short;
    behind = std::ranges::find_if(queue_, [&](const Place* other) {
      return other->turn_ > turn || (goes_first && other->turn_ == turn && !other->memory_.is_short);
    });
  }
  place.position_ = queue_.insert(behind, &place);
  note_lack_of_memory(place, lacks_memory);
  if (queue_.size() == 1) last_end_ = place.since_;  // What ended while nobody waited says nothing of the pace.
  if (turn != Place::Turn::kResumes && ++expiring_ == 1) changed_.notify_all();
}

/// REQUIRES: the lock.
void Admission::note_lack_of_memory(Place& place, bool lacks) {
  if (place.lacks_memory_ == lacks) return;
  place.lacks_memory_ = lacks;
  if (lacks) {
    ++memory_waiters_;
  } else {
    --memory_waiters_;
  }
}

bool Admission::leave_queue(Place& place) { return leave(place, /*is_new=*/true); }

bool Admission::leave_memory_queue(Place& place) { return leave(place, /*is_new=*/false); }

bool Admission::leave(Place& place, bool is_new) {
  Decision dropped;  // It may hold the last reference to the call: it goes after the lock.
  const std::lock_guard lock(mutex_);
  if (place.state_ != Place::State::kWaiting || (place.turn_ == Place::Turn::kIsNew) != is_new) return false;
  dropped = std::move(place.decision_);
  take_out(place);
  return true;
}

/// Begins what may begin. REQUIRES: the lock.
void Admission::admit(std::vector<Decision>& admitted) {
  bool is_awaited = false, is_awaited_by_short = false;  // Memory, by those before.
  for (auto at = queue_.begin(); at != queue_.end() && running_ < limits_.running + limits_.short_more;) {
    Place& place = **at++;
    if (!has_place_for(place)) continue;
    const Memory& memory = place.memory_;
    if (memory.reserve && ((memory.is_short ? is_awaited_by_short : is_awaited) || !memory.reserve())) {
      note_lack_of_memory(place, true);
      is_awaited = true;
      is_awaited_by_short = is_awaited_by_short || memory.is_short;
      continue;
    }
    admitted.push_back(std::move(place.decision_));
    take_out(place);
    run(place);
  }
}

void Admission::retry() {
  if (!wants_memory()) return;
  std::vector<Decision> admitted;
  {
    const std::lock_guard lock(mutex_);
    admit(admitted);
  }
  for (Decision& next : admitted) run_in_turn([next = std::move(next)] { next(nullptr); });
}

void Admission::give_back(Place& place) {
  Decision dropped;  // As in leave().
  std::vector<Decision> admitted;
  {
    const std::lock_guard lock(mutex_);
    if (place.state_ == Place::State::kWaiting) {
      dropped = std::move(place.decision_);
      take_out(place);
    }
    if (place.state_ != Place::State::kRunning) return;
    stop_running(place);
    const Clock::time_point now = Clock::now();
    if (!queue_.empty()) {
      constexpr double kWeight = 0.1;
      pace_s_ += kWeight * (std::chrono::duration<double>(now - last_end_).count() - pace_s_);
      last_end_ = now;
      admit(admitted);
    }
  }
  for (Decision& next : admitted) run_in_turn([next = std::move(next)] { next(nullptr); });
}

void Admission::drain() {
  std::vector<Decision> refused;
  {
    const std::lock_guard lock(mutex_);
    draining_ = true;
    for (auto at = queue_.begin(); at != queue_.end();) {
      Place& place = **at++;
      if (is_under_way(place, place.turn_)) continue;
      refused.push_back(std::move(place.decision_));
      take_out(place);
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

void Admission::expire_waits() {
  std::unique_lock lock(mutex_);
  while (!over_) {
    Place* const first = next_to_expire();
    if (first == nullptr) {
      changed_.wait(lock);
      continue;
    }
    const Clock::time_point end = first->since_ + limits_.longest_wait;
    if (Clock::now() < end) {
      changed_.wait_until(lock, end);
      continue;
    }
    Decision decision = std::move(first->decision_);
    const std::exception_ptr refusal = busy(first->lacks_memory_);
    take_out(*first);
    lock.unlock();
    decision(refusal);
    decision = nullptr;  // It may hold the last reference to the call, whose place comes here again.
    lock.lock();
  }
}

/// All wait for the same time, so of each turn the first one's ends first. REQUIRES: the lock.
Admission::Place* Admission::next_to_expire() const {
  Place* first = nullptr;
  for (Place* const place : queue_) {
    if (place->turn_ == Place::Turn::kResumes) continue;
    if (first == nullptr || place->since_ < first->since_) first = place;
    if (place->turn_ == Place::Turn::kIsNew) break;
  }
  return first;
}

/// REQUIRES: the lock, and a place that waits.
void Admission::take_out(Place& place) {
  queue_.erase(place.position_);
  place.state_ = Place::State::kNone;
  note_lack_of_memory(place, false);
  place.memory_ = {};
  if (place.turn_ != Place::Turn::kResumes) --expiring_;
}

std::exception_ptr Admission::busy(bool for_memory) const {
  const std::string all =
      for_memory ? "all memory that the server has for slicing is in use, and "
                 : "all " + std::to_string(limits_.running) + " calls that the server takes are running, and ";
  return std::make_exception_ptr(ServiceError(
      ServiceErrorCode::kServerBusy, all + std::to_string(queue_.size()) + " wait: try again later", retry_delay()));
}

/// When those who wait will have been served, at the pace of late.
std::chrono::seconds Admission::retry_delay() const {
  constexpr double kShortest = 1, kLongest = 30;
  const double seconds = std::ceil(pace_s_ * static_cast<double>(queue_.size() + 1));
  return std::chrono::seconds(static_cast<long>(std::clamp(seconds, kShortest, kLongest)));
}

}  // namespace ccslice::server
