// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/base/json_fields.h"

#include <google/protobuf/util/json_util.h>

#include <cmath>

namespace ccslice::cli {

using google::protobuf::Struct;
using google::protobuf::Value;

std::optional<Struct> parse_object(const std::string& json) {
  Struct object;
  if (!google::protobuf::util::JsonStringToMessage(json, &object).ok()) return std::nullopt;
  return object;
}

const Value& field(const Struct& object, const char* name) {
  const auto found = object.fields().find(name);
  return found == object.fields().end() ? Value::default_instance() : found->second;
}

double number(const Struct& object, const char* name) { return field(object, name).number_value(); }

std::uint64_t count(const Struct& object, const char* name, std::uint64_t most) {
  const double value = number(object, name);
  const bool whole = value >= 0 && value <= static_cast<double>(most) && value == std::floor(value);
  return whole ? static_cast<std::uint64_t>(value) : 0;
}

const std::string& text(const Struct& object, const char* name) { return field(object, name).string_value(); }

const google::protobuf::RepeatedPtrField<Value>& items(const Struct& object, const char* name) {
  return field(object, name).list_value().values();
}

}  // namespace ccslice::cli
