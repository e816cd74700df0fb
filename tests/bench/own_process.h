// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>
#include <vector>

namespace ccslice::bench {

struct ProcessCost {
  double wall_seconds = 0, cpu_seconds = 0;
  double peak_mib = 0;  // Largest resident set.
};

/// Runs this very program with other arguments, for its memory is its own then. What it prints goes to standard error.
/// Throws std::runtime_error unless it exits with 0.
ProcessCost run_own_process(const std::vector<std::string>& arguments);

}  // namespace ccslice::bench
