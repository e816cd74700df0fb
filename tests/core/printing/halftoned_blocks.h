// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Blocks halftoned at the pitch of a printer.

#pragma once

#include <array>
#include <vector>

#include "core/printing/halftone.h"
#include "tests/support/halftone_block.h"

namespace ccslice {

inline constexpr std::array<double, 3> kPitch = {25.4 / 600, 25.4 / 300, 0.027};  // mm.

inline HalftonePlan plan_of(const Printing& printing) {
  return HalftonePlan(printing, kPitch[0], kPitch[1], kPitch[2]);
}

inline HalftonedBlock constant_block(const Printing& printing, const std::vector<float>& values,
                                     const std::array<std::size_t, 3>& size) {
  return halftone_block(plan_of(printing), kPitch, size, [&](auto...) { return values; });
}

}  // namespace ccslice
