// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// How often encoders poll for cancellation: a few milliseconds of work each.

#pragma once

#include <cstddef>
#include <cstdint>

namespace ccslice {

inline constexpr std::uint32_t kRowsPerPoll = 64;
inline constexpr std::size_t kBytesPerPoll = 1 << 20;

}  // namespace ccslice
