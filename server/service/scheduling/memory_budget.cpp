// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/scheduling/memory_budget.h"

#include <algorithm>
#include <new>

namespace ccslice::server {

bool MemoryBudget::Share::resize(std::uint64_t bytes, std::uint64_t left_bytes) noexcept {
  if (bytes > bytes_) {
    if (!budget_->try_take(*this, bytes - bytes_, left_bytes)) return false;
  } else if (bytes < bytes_) {
    budget_->give_back(*this, bytes_ - bytes);
  }
  bytes_ = bytes;
  return true;
}

MemoryBudget::Share MemoryBudget::Share::split_off_beyond(std::uint64_t bytes) noexcept {
  Share rest;
  rest.budget_ = budget_;
  rest.client_ = client_;
  rest.bytes_ = bytes_ - bytes;
  bytes_ = bytes;
  return rest;
}

void MemoryBudget::Share::give_back() {
  if (bytes_ == 0) return;
  (void)resize(0);
  if (budget_->given_back_) budget_->given_back_();
}

std::optional<MemoryBudget::Share> MemoryBudget::take_between(std::uint64_t least, std::uint64_t most) {
  const std::uint64_t free = capacity_bytes_ - std::min(capacity_bytes_, used_bytes());
  Share share(*this);
  if (share.resize(std::clamp(free / 4, least, std::max(least, most))) || share.resize(least)) return share;
  return std::nullopt;
}

bool MemoryBudget::try_take(std::uint64_t bytes, std::uint64_t left_bytes) noexcept {
  const std::uint64_t most_used = capacity_bytes_ - std::min(capacity_bytes_, left_bytes);
  std::uint64_t used = used_bytes_.load();
  do {
    if (bytes > most_used || used > most_used - bytes) return false;
  } while (!used_bytes_.compare_exchange_weak(used, used + bytes));
  return true;
}

bool MemoryBudget::try_take(const Share& share, std::uint64_t bytes, std::uint64_t left_bytes) noexcept {
  const bool is_anybodys = share.client_ == nullptr;
  if (is_anybodys && try_take(bytes, left_bytes)) return true;
  const std::lock_guard lock(mutex_);
  if (is_anybodys) {
    if (loan_) loan_->is_wanted = true;
    return false;
  }
  try {
    const auto held = used_of_.try_emplace(*share.client_).first;
    const bool has_taken = try_take_of(share, held->second, bytes, left_bytes);
    if (held->second == 0) used_of_.erase(held);
    return has_taken;
  } catch (const std::bad_alloc&) {
    return false;
  }
}

/// `own`: what the client holds. REQUIRES: the lock.
bool MemoryBudget::try_take_of(const Share& share, std::uint64_t& own, std::uint64_t bytes,
                               std::uint64_t left_bytes) noexcept {
  const Clock::time_point now = Clock::now();
  if (!may_grow(share, own, bytes, now)) return false;
  if (!try_take(bytes, left_bytes)) {
    if (loan_ && *loan_->client != *share.client_) loan_->is_wanted = true;
    return false;
  }
  own += bytes;
  if (!loan_ && own > most_of_one_) loan_ = {.client = share.client_, .since = now};
  return true;
}

void MemoryBudget::give_back(const Share& share, std::uint64_t bytes) noexcept {
  used_bytes_.fetch_sub(bytes);
  given_back_bytes_.fetch_add(bytes);
  if (share.client_ == nullptr) return;
  const std::lock_guard lock(mutex_);
  const auto held = used_of_.find(*share.client_);
  held->second -= bytes;
  if (loan_ && *loan_->client == *share.client_ && held->second <= most_of_one_) loan_.reset();
  if (held->second == 0) used_of_.erase(held);
}

/// `own`: what the client holds. REQUIRES: the lock.
bool MemoryBudget::may_grow(const Share& share, std::uint64_t own, std::uint64_t bytes,
                            Clock::time_point now) noexcept {
  if (own <= most_of_one_ && bytes <= most_of_one_ - own) return true;
  if (own > share.bytes_ || now < lends_again_) return false;
  return !is_overdue_locked(*share.client_, now);
}

bool MemoryBudget::is_overdue_locked(const std::string& client, Clock::time_point now) noexcept {
  if (!loan_ || *loan_->client != client || !loan_->is_wanted || now - loan_->since < loan_time_) return false;
  lends_again_ = now + 2 * loan_time_;
  return true;
}

bool MemoryBudget::is_overdue(const std::string& client) noexcept {
  const std::lock_guard lock(mutex_);
  return is_overdue_locked(client, Clock::now());
}

std::size_t MemoryBudget::clients() const {
  const std::lock_guard lock(mutex_);
  return used_of_.size();
}

}  // namespace ccslice::server
