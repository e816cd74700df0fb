// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/memory_budget.h"

#include <algorithm>

namespace ccslice::server {

bool MemoryBudget::Share::resize(std::uint64_t bytes, std::uint64_t left_bytes) noexcept {
  if (bytes > bytes_) {
    if (!budget_->try_take(bytes - bytes_, left_bytes)) return false;
  } else if (bytes < bytes_) {
    budget_->give_back(bytes_ - bytes);
  }
  bytes_ = bytes;
  return true;
}

MemoryBudget::Share MemoryBudget::Share::split_off_beyond(std::uint64_t bytes) noexcept {
  Share rest;
  rest.budget_ = budget_;
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

}  // namespace ccslice::server
