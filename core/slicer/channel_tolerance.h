// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>

namespace ccslice {

/// A channel to interpolate, and by how much a voxel's value may be off.
struct ChannelTolerance {
  std::uint32_t channel = 0;
  double tolerance = 0;  // > 0, in the channel's own unit.
};

}  // namespace ccslice
