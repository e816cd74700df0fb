// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/echo.h"
#include "core/base/error.h"

namespace ccslice {

/// Collects what breaks one rule, and throws one error that names the first few ids and the place of the first.
class Offenders {
 public:
  /// In ascending order of ids. `index`: where in the field's array the fault is, if it is in one place.
  void add(std::int64_t id, std::optional<std::size_t> index = {}) {
    if (total_++ == 0) index_ = index;
    if (ids_.size() < kMaxEchoItems) ids_.push_back(id);
  }

  /// "WHAT 3, 17 and 5 more: REMEDY", field "FIELD[index]".
  void throw_if_any(ErrorCode code, const std::string& what, const std::string& remedy,
                    const std::string& field) const {
    if (total_ == 0) return;
    std::vector<std::string> names;
    for (const std::int64_t id : ids_) names.push_back(std::to_string(id));
    const std::string place = index_ ? "[" + std::to_string(*index_) + "]" : "";
    throw Error(code, what + " " + echoed_list(names, total_) + ": " + remedy, field + place, ids_);
  }

 private:
  std::vector<std::int64_t> ids_;
  std::size_t total_ = 0;
  std::optional<std::size_t> index_;  // Of the first.
};

}  // namespace ccslice
