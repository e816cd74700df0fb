// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

namespace ccslice {

/// All numbers from `low` to `high`, which may be infinite. REQUIRES: low <= high.
struct Interval {
  double low = 0, high = 0;

  bool contains(double value) const noexcept { return low <= value && value <= high; }

  bool operator==(const Interval&) const = default;
};

}  // namespace ccslice
