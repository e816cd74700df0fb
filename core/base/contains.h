// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Membership in lists too short for a set.

#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

namespace ccslice {

/// For short lists of ids.
inline bool contains(std::span<const std::uint32_t> ids, std::uint32_t id) {
  return std::find(ids.begin(), ids.end(), id) != ids.end();
}

}  // namespace ccslice
