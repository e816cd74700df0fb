// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Evaluation of one patch at four parameters at once, a lane each. The patch's polynomials may be evaluated beyond
// [0,1]^3. Private to the core.

#pragma once

#include <array>
#include <cstddef>

#include "core/base/lanes.h"
#include "core/limit/patch.h"

namespace ccslice {

/// Values of the cubic uniform B-splines at four parameters along each axis.
struct LaneBasis {
  std::array<std::array<Lanes, 4>, 3> value;

  explicit LaneBasis(const std::array<Lanes, 3>& uvw) noexcept;
};

/// x, y, z in mm, mesh frame.
std::array<Lanes, 3> patch_positions(const Patch& patch, const LaneBasis& basis) noexcept;

/// One of the patch's `channel_count` channels.
Lanes patch_channel(const Patch& patch, std::size_t channel, std::size_t channel_count,
                    const LaneBasis& basis) noexcept;

}  // namespace ccslice
