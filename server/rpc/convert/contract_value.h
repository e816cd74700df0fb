// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Enums of the contract by their values' names. The core's tables have them without the enum's own name in front.

#pragma once

#include <google/protobuf/descriptor.h>
#include <google/protobuf/generated_enum_reflection.h>

#include <string>
#include <string_view>

namespace ccslice::server {

/// The value `prefix` + `name`, such as PLANE_ENCODING_ + PNG; UNSPECIFIED if there is none.
template <typename Value>
Value contract_value(std::string_view prefix, std::string_view name) {
  const auto* found = google::protobuf::GetEnumDescriptor<Value>()->FindValueByName(std::string(prefix).append(name));
  return static_cast<Value>(found == nullptr ? 0 : found->number());
}

/// The row of a core table that the value stands for, or null.
template <typename Rows, typename Value>
auto* find_contract_row(const Rows& rows, std::string_view prefix, Value value) {
  for (const auto& row : rows) {
    if (contract_value<Value>(prefix, row.name) == value) return &row;
  }
  return static_cast<decltype(&rows[0])>(nullptr);
}

}  // namespace ccslice::server
