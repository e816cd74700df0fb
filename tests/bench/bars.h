// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Lines of a table of figures, each beside the bar that it has to keep.

#pragma once

#include <cstdio>
#include <string>

namespace ccslice::bench {

enum class Bound { kAtMost, kAtLeast };

class BarTable {
 public:
  BarTable() { std::printf("%-66s %12s %-10s %12s  %s\n", "figure", "measured", "unit", "bar", "verdict"); }

  void add(const std::string& figure, double value, const std::string& unit, Bound bound, double bar) {
    const bool kept = bound == Bound::kAtMost ? value <= bar : value >= bar;
    missed_ += !kept;
    std::printf("%-66s %12.4g %-10s %3s%9.4g  %s\n", figure.c_str(), value, unit.c_str(),
                bound == Bound::kAtMost ? "<= " : ">= ", bar, kept ? "kept" : "MISSED");
    std::fflush(stdout);
  }
  /// A figure without a bar.
  void note(const std::string& figure, double value, const std::string& unit) {
    std::printf("%-66s %12.4g %-10s\n", figure.c_str(), value, unit.c_str());
    std::fflush(stdout);
  }
  int missed() const { return missed_; }

 private:
  int missed_ = 0;
};

}  // namespace ccslice::bench
