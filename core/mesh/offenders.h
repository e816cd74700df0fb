// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Errors about many ids: one message for all that break a rule, however many there are.
//
// Messages name ids by a noun and a list: "cell 3", "vertices 3, 17 and 5 more", "edges 4-13, 5-14", with an edge's two
// vertices. Whoever knows other numbers for the same things finds them there and puts those in (renumber_text.h).

#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/echo.h"
#include "core/base/error.h"

namespace ccslice {

/// What the ids number.
struct Noun {
  const char* one;
  const char* many;
};
inline constexpr Noun kVertices{"vertex", "vertices"};
inline constexpr Noun kCells{"cell", "cells"};
inline constexpr Noun kMidNodes{"mid-node", "mid-nodes"};
inline constexpr Noun kEdges{"edge", "edges"};
inline constexpr Noun kSharpEdges{"sharp edge", "sharp edges"};
inline constexpr Noun kSharpVertices{"sharp vertex", "sharp vertices"};

/// "NOUN 3", "NOUNS 3, 17", "NOUNS 3, 17 and 5 more" of `total` things by name.
inline std::string named_things(const Noun& noun, const std::vector<std::string>& names, std::size_t total) {
  return std::string(total == 1 ? noun.one : noun.many) + " " + echoed_list(names, total);
}
inline std::string named_ids(const Noun& noun, const std::vector<std::int64_t>& ids, std::size_t total) {
  std::vector<std::string> names;
  for (const std::int64_t id : ids) names.push_back(std::to_string(id));
  return named_things(noun, names, total);
}
inline std::string named_ids(const Noun& noun, const std::vector<std::int64_t>& ids) {
  return named_ids(noun, ids, ids.size());
}

/// Collects what breaks one rule, and throws one error that names the first few ids and the place of the first.
class Offenders {
 public:
  /// In ascending order of ids. `index`: where in the field's array the fault is, if it is in one place.
  void add(std::int64_t id, std::optional<std::size_t> index = {}) {
    if (total_++ == 0) index_ = index;
    if (ids_.size() < kMaxEchoItems) ids_.push_back(id);
  }

  /// "WHAT cells 3, 17 and 5 more: REMEDY", field "FIELD[index]".
  void throw_if_any(ErrorCode code, const std::string& what, const Noun& noun, const std::string& remedy,
                    const std::string& field) const {
    if (total_ == 0) return;
    const std::string place = index_ ? "[" + std::to_string(*index_) + "]" : "";
    throw Error(code, what + " " + named_ids(noun, ids_, total_) + ": " + remedy, field + place, ids_);
  }

 private:
  std::vector<std::int64_t> ids_;
  std::size_t total_ = 0;
  std::optional<std::size_t> index_;  // Index of the first offender.
};

}  // namespace ccslice
