// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A volume as a file has it.

#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/types.h"
#include "core/volume/volume.h"

namespace ccslice {

/// Bytes of samples that are read at most.
inline constexpr std::uint64_t kMostVolumeBytes = std::uint64_t{8} << 30;

struct VolumeFile {
  VolumeShape shape;
  std::vector<std::byte> samples;  // In the order that Volume takes.
  /// The place of sample (i, j, k), mm, counted from 0 at its centre. Nothing: the file doesn't say.
  std::optional<Placement> mm_of_index;
  /// The place is a patient's: x to the left, y to the back, z to the head (LPS), whichever axes the file has.
  bool is_lps = false;
  double slope = 1, intercept = 0;  // A value is slope * sample + intercept.
  std::vector<std::string> notes;   // A sentence of each thing that was left out or changed.
};

}  // namespace ccslice
