// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A reader of Encoding::kRunsZstd for tests, voxel by voxel, straight from docs/runs.md.

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/output/plane.h"

namespace ccslice {

struct TinyRuns {
  int coding = -1;
  std::vector<std::uint8_t> inside;   // A byte a voxel.
  std::vector<std::uint8_t> samples;  // As kRaw has them.
};

/// Throws std::runtime_error for frames that aren't well-formed.
TinyRuns read_tiny_runs(std::span<const std::uint8_t> frame, SampleType type, std::uint32_t columns, std::uint32_t rows,
                        std::uint32_t channels);

}  // namespace ccslice
