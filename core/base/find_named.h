// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What jobs name: channels, cell regions, materials.

#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/echo.h"
#include "core/base/error.h"
#include "core/base/similar_name.h"

namespace ccslice {

/// The index of the first item of that name. Throws Error{code}: "FIELD: COMPLAINT "NAME"; HOLDER has "A", "B"", and
/// "; did you mean "A"?" behind it where a name is like it.
template <typename Named>
std::uint32_t find_named(const std::vector<Named>& all, const std::string& name, ErrorCode code,
                         const std::string& complaint, const std::string& holder, const std::string& field) {
  const auto found = std::ranges::find(all, name, &Named::name);
  if (found != all.end()) return static_cast<std::uint32_t>(found - all.begin());
  throw Error(code,
              field + ": " + complaint + " \"" + echoed(name) + "\"; " + holder + " has " +
                  (all.empty() ? "none" : echoed_names(all, '"')) + hint_of_name(all, name, '"'),
              field);
}

}  // namespace ccslice
