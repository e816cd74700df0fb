// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What one check of one hostile job found.

#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "tests/oracle/hostile/hostile_truth.h"

namespace ccslice::oracle {

struct HostileFinding {
  std::uint64_t compared = 0, failed = 0;
  std::uint64_t excused = 0;     // Beyond the bound, but for a reason that the check knows.
  std::uint64_t overlapped = 0;  // Of these, where the solid's cells overlap, as its summary says.
  double worst = 0;              // Of the failed, or else of all: the largest error over what it may be.
  std::string where;             // The worst or the first that failed.
  std::array<std::uint64_t, kVoxelPlaces> failed_at{};  // By VoxelPlace, of checks that look at it.
};

}  // namespace ccslice::oracle
