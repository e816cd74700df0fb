// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <vector>

namespace ccslice::bench {

/// Errors voxel by voxel.
class ErrorStatistics {
 public:
  void add(double error) { errors_.push_back(static_cast<float>(error)); }
  void add(const ErrorStatistics& other);

  std::uint64_t count() const { return errors_.size(); }
  double mean() const;
  double largest() const;
  /// The smallest error that this share of all errors doesn't exceed.
  double quantile(double share) const;
  /// By powers of ten, `bins_a_decade` to each, from 10^first_decade on; what is below is in the first, what is beyond
  /// in the last.
  std::vector<std::uint64_t> histogram(int first_decade, int decades, int bins_a_decade) const;

 private:
  std::vector<float> errors_;
};

}  // namespace ccslice::bench
