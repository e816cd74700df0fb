// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/scheduling/call_registry.h"

#include <string>

#include "server/service/base/limits.h"
#include "server/service/base/service_error.h"

namespace ccslice::server {

/// REQUIRES: the lock.
bool CallRegistry::has_room(const std::string& client, std::size_t more) const {
  constexpr std::size_t kMany = 8;
  if (counted_ + more > most_) return false;
  const auto own = counted_of_.find(client);
  return most_ < kMany || (own == counted_of_.end() ? 0 : own->second) + more <= most_ - most_ / 4;
}

/// REQUIRES: the lock.
void CallRegistry::count(const std::string& client, std::size_t more) {
  counted_ += more;
  counted_of_[client] += more;
}

CallRegistry::Ticket CallRegistry::open_call(std::function<void()> cut_off, const std::string& client,
                                             std::function<void()> check) {
  std::lock_guard lock(mutex_);
  if (draining_) {
    throw ServiceError(ServiceErrorCode::kServerDraining, "the server is shutting down: use another one");
  }
  if (!has_room(client, 1)) {
    throw ServiceError(ServiceErrorCode::kServerBusy,
                       std::to_string(calls_.size()) +
                           " calls are open, as many as the server has memory for, or for one client: end some of them",
                       kRetryDelay);
  }
  count(client, 1);
  calls_.emplace(++opened_, Call{std::move(cut_off), std::move(check), client});
  return Ticket(*this, opened_);
}

bool CallRegistry::hold(std::uint64_t number, std::uint64_t bytes) {
  constexpr std::uint64_t kBytesOfOne = 16 << 10;
  const auto more = static_cast<std::size_t>(bytes / kBytesOfOne);
  std::lock_guard lock(mutex_);
  Call& call = calls_.at(number);
  if (!has_room(call.client, more)) return false;
  count(call.client, more);
  call.counts += more;
  return true;
}

void CallRegistry::drain() {
  std::lock_guard lock(mutex_);
  draining_ = true;
}

bool CallRegistry::wait_idle(std::chrono::steady_clock::time_point deadline) {
  std::unique_lock lock(mutex_);
  return idle_.wait_until(lock, deadline, [this] { return calls_.empty(); });
}

void CallRegistry::cut_off_all() {
  cutting_off_ = true;
  run_all(&Call::cut_off);
}

void CallRegistry::check_all() { run_all(&Call::check); }

void CallRegistry::run_all(std::function<void()> Call::*function) {
  std::map<std::uint64_t, Call> calls;
  {
    std::lock_guard lock(mutex_);
    calls = calls_;
  }
  for (const auto& [number, call] : calls) {
    if (call.*function) (call.*function)();
  }
}

std::size_t CallRegistry::open() {
  std::lock_guard lock(mutex_);
  return calls_.size();
}

void CallRegistry::close(std::uint64_t number) {
  std::lock_guard lock(mutex_);
  const auto call = calls_.find(number);
  counted_ -= call->second.counts;
  const auto own = counted_of_.find(call->second.client);
  own->second -= call->second.counts;
  if (own->second == 0) counted_of_.erase(own);
  calls_.erase(call);
  if (calls_.empty()) idle_.notify_all();
}

}  // namespace ccslice::server
