// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// How many of something there are, in messages for people.

#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace ccslice {

/// "layers" of "layer", "limit vertices" of "limit vertex", "tetrahedra" of "tetrahedron".
inline std::string plural_of(std::string_view noun) {
  struct Ending {
    std::string_view one, many;
  };
  for (const auto& [one, many] : {Ending{"vertex", "vertices"}, Ending{"hedron", "hedra"}, Ending{"sh", "shes"}}) {
    if (!noun.ends_with(one)) continue;
    noun.remove_suffix(one.size());
    return std::string(noun).append(many);
  }
  return std::string(noun) + "s";
}

/// "1 cell", "3 cells". `noun` is in the singular.
inline std::string count_text(std::uint64_t count, std::string_view noun) {
  return std::to_string(count) + " " + (count == 1 ? std::string(noun) : plural_of(noun));
}

}  // namespace ccslice
