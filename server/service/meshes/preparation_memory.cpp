// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/meshes/preparation_memory.h"

#include <algorithm>
#include <utility>

namespace ccslice::server {
namespace {

void run_all(const std::vector<std::function<void()>>& all) {
  for (const auto& each : all) each();
}

}  // namespace

PreparationMemory::Share::~Share() {
  std::vector<std::function<void()>> begun;
  std::function<void()> dropped;  // It may hold what others' locks guard: it goes after the lock.
  {
    const std::lock_guard lock(memory_.mutex_);
    dropped = std::move(begin_);
    memory_.waiting_.remove(this);
    (void)memory_.resize_locked(*this, 0);
    begun = memory_.begin_locked();
  }
  run_all(begun);
}

std::uint64_t PreparationMemory::Share::bytes() const {
  const std::lock_guard lock(memory_.mutex_);
  return held_.bytes();
}

bool PreparationMemory::Share::resize(std::uint64_t bytes) {
  std::vector<std::function<void()>> begun;
  {
    const std::lock_guard lock(memory_.mutex_);
    if (bytes > held_.bytes()) return memory_.resize_locked(*this, bytes);
    (void)memory_.resize_locked(*this, bytes);
    begun = memory_.begin_locked();
  }
  run_all(begun);
  return true;
}

void PreparationMemory::Share::wait(std::uint64_t bytes, std::function<void()> begin) {
  std::vector<std::function<void()>> begun;
  {
    const std::lock_guard lock(memory_.mutex_);
    (void)memory_.resize_locked(*this, 0);
    wanted_bytes_ = bytes;
    since_ = Clock::now();
    begin_ = std::move(begin);
    memory_.waiting_.push_back(this);
    begun = memory_.begin_locked();
  }
  run_all(begun);
}

std::size_t PreparationMemory::waiting() const {
  const std::lock_guard lock(mutex_);
  return waiting_.size();
}

/// Whether somebody comes first who has waited for long.
bool PreparationMemory::has_to_wait_locked(const Share& share, std::uint64_t bytes) const {
  const Clock::time_point long_ago = Clock::now() - long_wait_;
  for (const Share* const other : waiting_) {
    if (other == &share) return false;
    if (other->since_ > long_ago) continue;
    const bool is_like_it = is_large(other->wanted_bytes_) == is_large(bytes);
    if (is_like_it) return true;
    if (!is_large(bytes) && used_by_small_besides(share) + bytes > left_by(other->wanted_bytes_)) return true;
  }
  return false;
}

/// To small ones, by a large one.
std::uint64_t PreparationMemory::left_by(std::uint64_t bytes) const {
  return std::min(small_bytes(), budget_.capacity_bytes() - std::min(budget_.capacity_bytes(), bytes));
}

std::uint64_t PreparationMemory::used_by_small_besides(const Share& share) const {
  const std::uint64_t held = share.held_.bytes();
  return small_used_bytes_ - (is_large(held) ? 0 : held);
}

/// Who is large already passes nobody by growing.
bool PreparationMemory::resize_locked(Share& share, std::uint64_t bytes) {
  const std::uint64_t held = share.held_.bytes();
  if (bytes > held && !is_large(held) && has_to_wait_locked(share, bytes)) return false;
  const std::uint64_t left = is_large(bytes) ? left_by(bytes) : 0;
  if (!share.held_.resize(bytes, left - std::min(left, used_by_small_besides(share)))) return false;
  if (!is_large(held)) small_used_bytes_ -= held;
  if (!is_large(bytes)) small_used_bytes_ += bytes;
  return true;
}

/// What those are to run for whom there is memory now.
std::vector<std::function<void()>> PreparationMemory::begin_locked() {
  std::vector<std::function<void()>> begun;
  for (auto next = waiting_.begin(); next != waiting_.end();) {
    Share& share = **next;
    if (!resize_locked(share, share.wanted_bytes_)) {
      ++next;
      continue;
    }
    begun.push_back(std::exchange(share.begin_, nullptr));
    next = waiting_.erase(next);
  }
  return begun;
}

}  // namespace ccslice::server
