// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Lines of a table of figures, each beside the bar that it has to keep.

#pragma once

#include <cstdio>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace ccslice::bench {

enum class Bound { kAtMost, kAtLeast };

class BarTable {
 public:
  BarTable() { std::printf("%-66s %12s %-10s %12s  %s\n", "figure", "measured", "unit", "bar", "verdict"); }

  void add(const std::string& figure, double value, const std::string& unit, Bound bound, double bar) {
    const bool kept = bound == Bound::kAtMost ? value <= bar : value >= bar;
    missed_ += !kept;
    rows_.push_back({figure, unit, value, bar, kept ? "kept" : "MISSED"});
    std::printf("%-66s %12.4g %-10s %3s%9.4g  %s\n", figure.c_str(), value, unit.c_str(),
                bound == Bound::kAtMost ? "<= " : ">= ", bar, kept ? "kept" : "MISSED");
    std::fflush(stdout);
  }
  /// A figure without a bar.
  void note(const std::string& figure, double value, const std::string& unit) {
    rows_.push_back({figure, unit, value, std::nullopt, ""});
    std::printf("%-66s %12.4g %-10s\n", figure.c_str(), value, unit.c_str());
    std::fflush(stdout);
  }
  int missed() const { return missed_; }

  /// Writes all figures as an array of objects. Throws std::runtime_error.
  void write_json(const std::string& path) const {
    std::ofstream file(path);
    file << "[\n";
    for (const Row& row : rows_) {
      file << "  {\"figure\": \"" << row.figure << "\", \"value\": " << row.value << ", \"unit\": \"" << row.unit
           << '"';
      if (row.bar) file << ", \"bar\": " << *row.bar << ", \"verdict\": \"" << row.verdict << '"';
      file << (&row == &rows_.back() ? "}\n" : "},\n");
    }
    if (!(file << "]\n")) throw std::runtime_error("can't write " + path);
  }

 private:
  struct Row {
    std::string figure, unit;
    double value;
    std::optional<double> bar;
    std::string verdict;
  };

  std::vector<Row> rows_;
  int missed_ = 0;
};

}  // namespace ccslice::bench
