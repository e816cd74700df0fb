// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/bench/error_statistics.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace ccslice::bench {

void ErrorStatistics::add(const ErrorStatistics& other) {
  errors_.insert(errors_.end(), other.errors_.begin(), other.errors_.end());
}

double ErrorStatistics::mean() const {
  if (errors_.empty()) return 0;
  return std::accumulate(errors_.begin(), errors_.end(), 0.0) / static_cast<double>(errors_.size());
}

double ErrorStatistics::largest() const {
  return errors_.empty() ? 0 : *std::max_element(errors_.begin(), errors_.end());
}

double ErrorStatistics::quantile(double share) const {
  if (errors_.empty()) return 0;
  std::vector<float> sorted = errors_;
  const auto rank = static_cast<std::ptrdiff_t>(std::ceil(share * static_cast<double>(sorted.size()))) - 1;
  const auto at = sorted.begin() + std::max<std::ptrdiff_t>(rank, 0);
  std::nth_element(sorted.begin(), at, sorted.end());
  return *at;
}

std::vector<std::uint64_t> ErrorStatistics::histogram(int first_decade, int decades, int bins_a_decade) const {
  std::vector<std::uint64_t> bins(static_cast<std::size_t>(decades * bins_a_decade));
  for (const float error : errors_) {
    const double place = error > 0 ? (std::log10(error) - first_decade) * bins_a_decade : 0;
    const double last = static_cast<double>(bins.size() - 1);
    ++bins[static_cast<std::size_t>(std::clamp(std::floor(place), 0.0, last))];
  }
  return bins;
}

}  // namespace ccslice::bench
