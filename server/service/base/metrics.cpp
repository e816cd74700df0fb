// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/base/metrics.h"

#include <algorithm>

namespace ccslice::server {

void DurationHistogram::add(std::chrono::nanoseconds duration) {
  const double seconds = std::chrono::duration<double>(duration).count();
  const auto bound = std::lower_bound(kBounds.begin(), kBounds.end(), seconds);
  ++in_[static_cast<std::size_t>(bound - kBounds.begin())];
  sum_ns_ += static_cast<std::uint64_t>(std::max<std::int64_t>(duration.count(), 0));
}

/// Durations that come meanwhile may be in some figures and not in others.
DurationHistogram::Counts DurationHistogram::counts() const {
  Counts counts;
  for (std::size_t i = 0; i < in_.size(); ++i) {
    counts.in[i] = in_[i].load();
    counts.all += counts.in[i];
  }
  counts.sum_s = static_cast<double>(sum_ns_.load()) / 1e9;
  return counts;
}

void CallCounts::add(const std::string& method, const std::string& reason) {
  const std::lock_guard lock(mutex_);
  ++counts_[{method, reason}];
}

std::map<CallCounts::Key, std::uint64_t> CallCounts::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

}  // namespace ccslice::server
