// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/base/message_json.h"

#include <google/protobuf/descriptor.h>

#include <charconv>
#include <string_view>

namespace ccslice::cli {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

constexpr std::size_t kColourLength = 9;  // "#c8d2dcff".

void add_value(const Message& message, const FieldDescriptor& field, JsonWriter& json) {
  const google::protobuf::Reflection& fields = *message.GetReflection();
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT32: json.value(fields.GetInt32(message, &field)); break;
    case FieldDescriptor::CPPTYPE_INT64: json.value(fields.GetInt64(message, &field)); break;
    case FieldDescriptor::CPPTYPE_UINT64: json.value(fields.GetUInt64(message, &field)); break;
    case FieldDescriptor::CPPTYPE_DOUBLE: json.value(fields.GetDouble(message, &field)); break;
    case FieldDescriptor::CPPTYPE_FLOAT: json.raw(shortest(fields.GetFloat(message, &field))); break;
    case FieldDescriptor::CPPTYPE_BOOL: json.value(fields.GetBool(message, &field)); break;
    case FieldDescriptor::CPPTYPE_ENUM: json.value(fields.GetEnum(message, &field)->name()); break;
    case FieldDescriptor::CPPTYPE_STRING: json.value(fields.GetString(message, &field)); break;
    case FieldDescriptor::CPPTYPE_MESSAGE: add_message(fields.GetMessage(message, &field), json); break;
    case FieldDescriptor::CPPTYPE_UINT32: {
      const std::uint32_t number = fields.GetUInt32(message, &field);
      field.name().ends_with("rgba") ? json.value(colour_text(number)) : json.value(number);
    }
  }
}

}  // namespace

std::string colour_text(std::uint32_t rgba) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text = "#";
  for (int shift = 28; shift >= 0; shift -= 4) text += kDigits[rgba >> shift & 15];
  return text;
}

std::optional<std::uint32_t> colour_of_text(const std::string& text) {
  std::uint32_t colour = 0;
  const char* const end = text.data() + text.size();
  const bool whole =
      text.size() == kColourLength && text[0] == '#' && std::from_chars(text.data() + 1, end, colour, 16).ptr == end;
  return whole ? std::optional(colour) : std::nullopt;
}

void add_message(const Message& message, JsonWriter& json) {
  const google::protobuf::Descriptor& type = *message.GetDescriptor();
  const google::protobuf::Reflection& fields = *message.GetReflection();
  json.begin_object();
  for (int i = 0; i < type.field_count(); ++i) {
    const FieldDescriptor& field = *type.field(i);
    if (field.is_repeated()) {
      json.key(field.name()).begin_array();
      for (int at = 0; at < fields.FieldSize(message, &field); ++at) {
        add_message(fields.GetRepeatedMessage(message, &field, at), json);
      }
      json.end_array();
    } else if (!field.has_presence() || fields.HasField(message, &field)) {
      json.key(field.name());
      add_value(message, field, json);
    }
  }
  json.end_object();
}

}  // namespace ccslice::cli
