// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Membership in lists too short for a set.

#pragma once

#include <algorithm>

namespace ccslice {

/// For short lists of ids or names.
template <typename Ids>
bool contains(const Ids& ids, typename Ids::value_type id) {
  return std::find(ids.begin(), ids.end(), id) != ids.end();
}

}  // namespace ccslice
