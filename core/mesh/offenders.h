// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Errors about many ids: one message for all that break a rule, however many there are.

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
inline constexpr Noun kSharpEdges{"sharp edge", "sharp edges"};
inline constexpr Noun kSharpVertices{"sharp vertex", "sharp vertices"};

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
    std::vector<std::string> names;
    for (const std::int64_t id : ids_) names.push_back(std::to_string(id));
    const std::string place = index_ ? "[" + std::to_string(*index_) + "]" : "";
    const std::string which = std::string(total_ == 1 ? noun.one : noun.many) + " " + echoed_list(names, total_);
    throw Error(code, what + " " + which + ": " + remedy, field + place, ids_);
  }

 private:
  std::vector<std::int64_t> ids_;
  std::size_t total_ = 0;
  std::optional<std::size_t> index_;  // Index of the first offender.
};

}  // namespace ccslice
