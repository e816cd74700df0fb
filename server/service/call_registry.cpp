// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/call_registry.h"

#include <string>

#include "server/service/limits.h"
#include "server/service/service_error.h"

namespace ccslice::server {

CallRegistry::Ticket CallRegistry::open_call(std::function<void()> cut_off) {
  std::lock_guard lock(mutex_);
  if (draining_) {
    throw ServiceError(ServiceErrorCode::kServerDraining, "the server is shutting down: use another one");
  }
  if (open_ >= most_) {
    throw ServiceError(
        ServiceErrorCode::kServerBusy,
        std::to_string(open_) + " calls are open, as many as the server has memory for: end some of them", kRetryDelay);
  }
  cut_offs_.emplace(++opened_, std::move(cut_off));
  ++open_;
  return Ticket(*this, opened_);
}

void CallRegistry::drain() {
  std::lock_guard lock(mutex_);
  draining_ = true;
}

bool CallRegistry::wait_idle(std::chrono::steady_clock::time_point deadline) {
  std::unique_lock lock(mutex_);
  return idle_.wait_until(lock, deadline, [this] { return open_ == 0; });
}

void CallRegistry::cut_off_all() {
  cutting_off_ = true;
  std::map<std::uint64_t, std::function<void()>> cut_offs;
  {
    std::lock_guard lock(mutex_);
    cut_offs = cut_offs_;
  }
  for (const auto& [number, cut_off] : cut_offs) {
    if (cut_off) cut_off();
  }
}

std::size_t CallRegistry::open() {
  std::lock_guard lock(mutex_);
  return open_;
}

void CallRegistry::close(std::uint64_t number) {
  std::lock_guard lock(mutex_);
  cut_offs_.erase(number);
  --open_;
  if (open_ == 0) idle_.notify_all();
}

}  // namespace ccslice::server
