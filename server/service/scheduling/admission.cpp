// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/scheduling/admission.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "server/service/base/service_error.h"

namespace ccslice::server {
namespace {

std::exception_ptr draining() {
  return std::make_exception_ptr(
      ServiceError(ServiceErrorCode::kServerDraining, "the server is shutting down: use another one"));
}

/// Runs decisions one after the other, those too that come up while one of them runs: calls that end as soon as they
/// begin would otherwise be stacked on one another, as many as wait.
void run_in_turn(std::function<void()> decision) {
  using Decisions = std::vector<std::function<void()>>;
  thread_local Decisions* to_come = nullptr;
  if (to_come != nullptr) return to_come->push_back(std::move(decision));
  Decisions decisions;
  decisions.push_back(std::move(decision));
  to_come = &decisions;
  struct End {
    ~End() { to_come = nullptr; }  // Also where a decision throws.
  } const end;
  while (!decisions.empty()) {
    const std::function<void()> next = std::move(decisions.back());
    decisions.pop_back();
    next();
  }
}

}  // namespace

Admission::Admission(const AdmissionLimits& limits) : limits_(limits), clock_([this] { watch_waits(); }) {}

Admission::~Admission() {
  {
    const std::lock_guard lock(mutex_);
    over_ = true;
  }
  changed_.notify_all();
  clock_.join();
}

void Admission::request(Place& place, Decision decision, bool is_long, std::function<void()> give_way) {
  place.is_long_ = is_long;
  enter(place, Place::Turn::kIsNew, {.reserve = {}, .give_way = std::move(give_way)}, std::move(decision));
}

void Admission::request_memory(Place& place, Memory memory, Decision decision) {
  enter(place, Place::Turn::kHasBegun, std::move(memory), std::move(decision));
}

void Admission::resume(Place& place, Memory memory, Decision decision) {
  enter(place, Place::Turn::kResumes, std::move(memory), std::move(decision));
}

void Admission::wait_again(Place& place, Memory memory, Decision decision) {
  enter(place, Place::Turn::kGaveWay, std::move(memory), std::move(decision));
}

void Admission::enter(Place& place, Place::Turn turn, Memory memory, Decision decision) {
  std::exception_ptr refusal;
  Refusal other;
  std::vector<Decision> admitted;
  bool waits = false;
  {
    const std::lock_guard lock(mutex_);
    const bool had_place = place.state_ == Place::State::kRunning;
    if (had_place) stop_running(place);
    if (memory.reserve) place.is_long_ = !memory.is_short;
    place.turn_ = turn;
    place.give_way_ = std::move(memory.give_way);
    place.memory_ = std::move(memory);
    const bool is_refused = draining_ && !is_under_way(place, turn);
    const bool has_place = (had_place || !is_refused) && has_place_for(place);
    if (has_place && has_memory_for(place)) {
      run(place);
    } else if (!is_refused && (waits_for_ever(turn) || make_room_in_queue(place, other))) {
      waits = true;
      insert(place, std::move(decision), /*lacks_memory=*/has_place);
      // To the place that it had. And memory may have come since it was asked for, but before anybody knew who waits.
      if (had_place || place.lacks_memory_) admit(admitted);
    } else {
      refusal = is_refused ? draining() : busy(/*for_memory=*/has_place);
      place.memory_ = {};
      place.give_way_ = nullptr;
      if (had_place) {
        place.is_long_ = false;
        run(place);
      }
    }
  }
  if (!waits) decision(refusal);
  if (other.decision) run_in_turn([other = std::move(other)] { other.decision(other.reason); });
  for (Decision& next : admitted) run_in_turn([next = std::move(next)] { next(nullptr); });
}

/// Such a call may end in its own time when calls drain.
bool Admission::is_under_way(const Place& place, Place::Turn turn) {
  return waits_for_ever(turn) || (turn == Place::Turn::kIsNew && place.has_run_);
}

/// What has begun to answer, and gave all back, is never refused.
bool Admission::waits_for_ever(Place::Turn turn) {
  return turn == Place::Turn::kResumes || turn == Place::Turn::kGaveWay;
}

/// REQUIRES: the lock.
bool Admission::has_place_for(const Place& place) const {
  constexpr std::size_t kMany = 8;
  const std::size_t all = limits_.running + limits_.short_more;
  if (running_ >= all || (place.is_long_ && long_running_ >= limits_.running)) return false;
  const auto client = clients_.find(place.client_);
  return all < kMany || client == clients_.end() || client->second.running < all - all / 4;
}

Admission::Rank Admission::rank_of(const Place& place) {
  switch (place.turn_) {
    case Place::Turn::kResumes:
      if (!place.memory_.is_short) return Rank::kResumes;
      [[fallthrough]];
    case Place::Turn::kGaveWay:
    case Place::Turn::kHasBegun: return place.memory_.is_short ? Rank::kHasBegunShort : Rank::kHasBegun;
    case Place::Turn::kIsNew: break;
  }
  return Rank::kIsNew;
}

std::size_t Admission::group_of(Rank rank) {
  return static_cast<std::size_t>(rank == Rank::kResumes ? Rank::kHasBegun : rank);
}

/// Whether the client of `a` comes before that of `b`, which came before it. REQUIRES: the lock.
bool Admission::comes_first(const Place& a, const Place& b) const {
  const auto turn_of = [this](const Place& place) {
    const auto found = clients_.find(place.client_);
    return found == clients_.end() ? std::pair<std::size_t, std::uint64_t>()
                                   : std::pair(found->second.running, found->second.served);
  };
  return turn_of(a) < turn_of(b);
}

/// Takes it if so. REQUIRES: the lock.
bool Admission::has_memory_for(const Place& place) const {
  const Memory& memory = place.memory_;
  if (!memory.reserve) return true;
  const Rank rank = rank_of(place);
  const Clock::time_point now = Clock::now();
  const bool others_come_first = std::ranges::any_of(queue_, [&](const Place* other) {
    if (!other->lacks_memory_ || (memory.is_short && !other->memory_.is_short)) return false;
    if (is_overdue(*other, clients_.at(other->client_), now)) return true;
    const bool is_own = other->client_ == place.client_;
    if (is_own || group_of(other->rank_) != group_of(rank)) return other->rank_ <= rank;
    return !comes_first(place, *other);
  });
  return !others_come_first && memory.reserve();
}

/// REQUIRES: the lock.
void Admission::run(Place& place) {
  place.state_ = Place::State::kRunning;
  place.has_run_ = true;
  place.since_ = Clock::now();
  place.memory_ = {};
  ++running_;
  if (place.is_long_) ++long_running_;
  Client& client = clients_[place.client_];
  ++client.running;
  client.served = ++served_;
  if (place.give_way_) client.giving.push_back(&place);
}

/// REQUIRES: the lock.
void Admission::stop_running(Place& place) {
  constexpr std::size_t kManyClients = 100;
  place.state_ = Place::State::kNone;
  --running_;
  if (place.is_long_) --long_running_;
  Client& client = clients_[place.client_];
  --client.running;
  if (place.give_way_) client.giving.remove(&place);
  if (clients_.size() > kManyClients) std::erase_if(clients_, [](const auto& each) { return each.second.is_idle(); });
}

/// Where the queue is full, takes out the newest call of the client with most calls there, among those that haven't run
/// yet. False if no client has more than the place's own would have. REQUIRES: the lock.
bool Admission::make_room_in_queue(const Place& place, Refusal& refused) {
  if (expiring_ < limits_.waiting) return true;
  const auto own = clients_.find(place.client_);
  std::size_t most = (own == clients_.end() ? 0 : own->second.expiring) + 2;
  Place* newest = nullptr;
  for (auto& [name, client] : clients_) {
    if (client.expiring < most) continue;
    const auto fresh = std::ranges::find(client.of(Rank::kIsNew).rbegin(), client.of(Rank::kIsNew).rend(), false,
                                         [](const Place* other) { return other->has_run_; });
    if (fresh == client.of(Rank::kIsNew).rend()) continue;
    most = client.expiring + 1;
    newest = *fresh;
  }
  if (newest == nullptr) return false;
  refused = {std::move(newest->decision_), busy(/*for_memory=*/false)};
  take_out(*newest);
  return true;
}

/// REQUIRES: the lock.
void Admission::insert(Place& place, Decision decision, bool lacks_memory) {
  place.state_ = Place::State::kWaiting;
  place.decision_ = std::move(decision);
  place.since_ = Clock::now();
  place.rank_ = rank_of(place);
  Client& client = clients_[place.client_];
  std::list<Place*>& of_client = client.of(place.rank_);
  const bool comes_first =
      place.turn_ == Place::Turn::kGaveWay || (place.turn_ == Place::Turn::kResumes && place.memory_.is_short);
  place.position_of_client_ = of_client.insert(comes_first ? of_client.begin() : of_client.end(), &place);
  place.position_ = queue_.insert(queue_.end(), &place);
  note_lack_of_memory(place, lacks_memory);
  if (queue_.size() == 1) last_end_ = place.since_;  // What ended while nobody waited says nothing of the pace.
  if (queue_.size() == 1) changed_.notify_all();
  if (waits_for_ever(place.turn_)) return;
  ++client.expiring;
  if (++expiring_ == 1) changed_.notify_all();
}

/// REQUIRES: the lock.
void Admission::note_lack_of_memory(Place& place, bool lacks) {
  if (place.lacks_memory_ == lacks) return;
  place.lacks_memory_ = lacks;
  const bool is_urgent = place.turn_ != Place::Turn::kGaveWay;
  if (lacks) {
    ++memory_waiters_;
    urgent_memory_waiters_ += is_urgent ? 1 : 0;
  } else {
    --memory_waiters_;
    urgent_memory_waiters_ -= is_urgent ? 1 : 0;
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
  note_left();
  return true;
}

/// Somebody has left the queue, behind whom others may have waited for memory. They are admitted on the clock's thread:
/// who leaves may hold locks of its call. REQUIRES: the lock.
void Admission::note_left() {
  if (queue_.empty()) return;
  has_left_ = true;
  changed_.notify_all();
}

/// Begins what may begin. REQUIRES: the lock.
void Admission::admit(std::vector<Decision>& admitted) {
  AwaitedMemory awaited;  // By those before.
  admit_overdue(awaited, admitted);
  admit_of_ranks(Rank::kHasBegunShort, Rank::kHasBegunShort, awaited, admitted);
  admit_of_ranks(Rank::kResumes, Rank::kHasBegun, awaited, admitted);
  admit_of_ranks(Rank::kIsNew, Rank::kIsNew, awaited, admitted);
}

/// Whether it comes before all others. REQUIRES: the lock.
bool Admission::is_overdue(const Place& place, const Client& client, Clock::time_point now) const {
  return place.turn_ == Place::Turn::kResumes && now - place.since_ >= limits_.longest_wait &&
         now - client.overdue_begun >= limits_.longest_wait;
}

/// The client's call that does; null if there is none. REQUIRES: the lock.
Admission::Place* Admission::overdue_of(Client& client, Clock::time_point now) {
  for (const Rank rank : {Rank::kResumes, Rank::kHasBegunShort}) {
    const auto found =
        std::ranges::find_if(client.of(rank), [&](const Place* place) { return is_overdue(*place, client, now); });
    if (found != client.of(rank).end()) return *found;
  }
  return nullptr;
}

/// REQUIRES: the lock.
void Admission::admit_overdue(AwaitedMemory& awaited, std::vector<Decision>& admitted) {
  const Clock::time_point now = Clock::now();
  std::vector<Place*> overdue;
  for (auto& [name, client] : clients_) {
    if (Place* const place = overdue_of(client, now)) overdue.push_back(place);
  }
  std::ranges::sort(overdue, {}, &Place::since_);
  for (Place* const place : overdue) {
    if (try_admit(*place, awaited, admitted)) clients_[place->client_].overdue_begun = now;
  }
}

/// A client's calls that wait, by rank, as far as the last one.
struct Admission::Waiting {
  Client* client;
  std::size_t rank, last_rank;
  std::list<Place*>::iterator next{};

  Waiting(Client& the_client, Rank first, Rank last)
      : client(&the_client), rank(static_cast<std::size_t>(first)), last_rank(static_cast<std::size_t>(last)) {
    next = client->waiting[rank].begin();
    skip_ends();
  }
  bool is_over() const { return next == client->waiting[rank].end(); }
  Place& take() {
    Place& place = **next++;
    skip_ends();
    return place;
  }
  void skip_ends() {
    while (is_over() && rank < last_rank) next = client->waiting[++rank].begin();
  }
  auto order() const { return std::tuple(client->running, client->served, (*next)->since_); }
};

/// Clients in turn, those of each by rank. REQUIRES: the lock, and ranks of one group.
void Admission::admit_of_ranks(Rank first, Rank last, AwaitedMemory& awaited, std::vector<Decision>& admitted) {
  if (running_ >= limits_.running + limits_.short_more) return;
  std::vector<Waiting> all;
  for (auto& [name, client] : clients_) {
    const Waiting waiting(client, first, last);
    if (!waiting.is_over()) all.push_back(waiting);
  }
  while (!all.empty() && running_ < limits_.running + limits_.short_more) {
    const auto next = std::ranges::min_element(all, {}, &Waiting::order);
    Place& place = next->take();
    if (next->is_over()) {
      *next = all.back();
      all.pop_back();
    }
    try_admit(place, awaited, admitted);
  }
}

/// REQUIRES: the lock, and a place that waits.
bool Admission::try_admit(Place& place, AwaitedMemory& awaited, std::vector<Decision>& admitted) {
  if (!has_place_for(place)) return false;
  const Memory& memory = place.memory_;
  if (memory.reserve) note_lack_of_memory(place, true);  // Before it is asked for, as above.
  if (memory.reserve && ((memory.is_short ? awaited.by_short : awaited.by_any) || !memory.reserve())) {
    awaited.by_any = true;
    awaited.by_short = awaited.by_short || memory.is_short;
    return false;
  }
  admitted.push_back(std::move(place.decision_));
  take_out(place);
  run(place);
  return true;
}

void Admission::retry() {
  if (memory_waiters_.load() == 0) return;
  std::vector<Decision> admitted;
  {
    const std::lock_guard lock(mutex_);
    admit(admitted);
  }
  for (Decision& next : admitted) run_in_turn([next = std::move(next)] { next(nullptr); });
}

void Admission::give_back(Place& place) {
  Decision dropped;  // It may hold the last reference to the call: it goes after the lock.
  std::vector<Decision> admitted;
  {
    const std::lock_guard lock(mutex_);
    if (place.state_ == Place::State::kWaiting) {
      dropped = std::move(place.decision_);
      take_out(place);
      note_left();
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
    note_left();
  }
  for (const Decision& decision : refused) decision(draining());
}

std::size_t Admission::running() const {
  const std::lock_guard lock(mutex_);
  return running_;
}

std::size_t Admission::begun_of(const std::string& client) const {
  const std::lock_guard lock(mutex_);
  const auto found = clients_.find(client);
  if (found == clients_.end()) return 0;
  std::size_t begun = found->second.running;
  for (const Rank rank : {Rank::kResumes, Rank::kHasBegunShort, Rank::kHasBegun}) {
    begun += found->second.waiting[static_cast<std::size_t>(rank)].size();
  }
  return begun;
}

std::size_t Admission::waiting() const {
  const std::lock_guard lock(mutex_);
  return queue_.size();
}

/// On a thread of its own.
void Admission::watch_waits() {
  std::unique_lock lock(mutex_);
  while (!over_) {
    const Clock::time_point now = Clock::now();
    Place* const first = next_to_expire();
    if (std::exchange(has_left_, false)) {
      admit_unlocked(lock);
    } else if (first != nullptr && now >= first->since_ + limits_.longest_wait) {
      Decision decision = std::move(first->decision_);
      const std::exception_ptr refusal = busy(first->lacks_memory_);
      take_out(*first);
      note_left();
      lock.unlock();
      decision(refusal);
      decision = nullptr;  // It may hold the last reference to the call, whose place comes here again.
      lock.lock();
    } else if (std::function<void()> give_way = next_to_give_way(now)) {
      lock.unlock();
      give_way();
      give_way = nullptr;  // It may hold the last reference to the call.
      lock.lock();
    } else if (queue_.empty()) {
      changed_.wait(lock);
    } else {
      const Clock::time_point look = now + limits_.give_way_after / 4;
      changed_.wait_until(lock, first == nullptr ? look : std::min(look, first->since_ + limits_.longest_wait));
    }
  }
}

/// Begins what may begin. Comes back with the lock, but gives it back meanwhile.
void Admission::admit_unlocked(std::unique_lock<std::mutex>& lock) {
  std::vector<Decision> admitted;
  admit(admitted);
  lock.unlock();
  for (Decision& next : admitted) run_in_turn([next = std::move(next)] { next(nullptr); });
  admitted.clear();  // They may hold the last references to their calls.
  lock.lock();
}

/// All wait for the same time, so it is the one that came first. REQUIRES: the lock.
Admission::Place* Admission::next_to_expire() const {
  const auto first = std::ranges::find_if(queue_, [](const Place* place) { return !waits_for_ever(place->turn_); });
  return first == queue_.end() ? nullptr : *first;
}

/// How to tell the run that should give way now; empty if none should. REQUIRES: the lock.
std::function<void()> Admission::next_to_give_way(Clock::time_point now) {
  constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max() / 2;
  const auto is_due = [&](Clock::time_point since) { return now - since >= limits_.give_way_after; };
  if (!is_due(told_)) return {};
  std::size_t fewest = kNone;  // Calls that run, of a client who waits.
  for (const Place* place : queue_) {
    if (is_due(place->since_)) fewest = std::min(fewest, clients_[place->client_].running);
  }
  Client* most = nullptr;
  std::list<Place*>::iterator latest;  // Of its runs that aren't over in a moment anyway.
  for (auto& [name, client] : clients_) {
    if (client.running < fewest + 2 || (most != nullptr && client.running <= most->running)) continue;
    const auto due = std::find_if(client.giving.rbegin(), client.giving.rend(),
                                  [&](const Place* place) { return is_due(place->since_); });
    if (due == client.giving.rend()) continue;
    most = &client;
    latest = std::prev(due.base());
  }
  if (most == nullptr) return {};
  most->giving.splice(most->giving.begin(), most->giving, latest);
  told_ = now;
  return most->giving.front()->give_way_;
}

/// REQUIRES: the lock, and a place that waits.
void Admission::take_out(Place& place) {
  Client& client = clients_[place.client_];
  client.of(place.rank_).erase(place.position_of_client_);
  queue_.erase(place.position_);
  place.state_ = Place::State::kNone;
  note_lack_of_memory(place, false);
  place.memory_ = {};
  if (!waits_for_ever(place.turn_)) {
    --client.expiring;
    --expiring_;
  }
  if (client.served == 0 && client.is_idle()) clients_.erase(place.client_);  // Nothing is known of it.
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
