// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/base/message_json.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/util/json_util.h>

#include <charconv>
#include <cmath>
#include <map>
#include <string_view>
#include <utility>

#include "ccslice/cli/v1/form.pb.h"
#include "ccslice/v1/geometry.pb.h"
#include "client/cli/base/json.h"
#include "core/base/error.h"

namespace ccslice::cli {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

constexpr std::size_t kColourLength = 9;  // "#c8d2dcff".
constexpr int kAlone = -1;                // The place of a value that doesn't repeat.

void add_message(const Message& message, JsonWriter& json);

void add_real(double number, const FieldDescriptor& field, JsonWriter& json) {
  const bool as_text = std::isnan(number) && field.options().GetExtension(v1::or_nan);
  as_text ? json.value("NaN") : json.value(number);
}

void add_value(const Message& message, const FieldDescriptor& field, int at, JsonWriter& json) {
  const google::protobuf::Reflection& fields = *message.GetReflection();
  const bool alone = at == kAlone;
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_UINT32:
      json.value(alone ? fields.GetUInt32(message, &field) : fields.GetRepeatedUInt32(message, &field, at));
      break;
    case FieldDescriptor::CPPTYPE_UINT64:
      json.value(alone ? fields.GetUInt64(message, &field) : fields.GetRepeatedUInt64(message, &field, at));
      break;
    case FieldDescriptor::CPPTYPE_DOUBLE:
      add_real(alone ? fields.GetDouble(message, &field) : fields.GetRepeatedDouble(message, &field, at), field, json);
      break;
    case FieldDescriptor::CPPTYPE_STRING:
      json.value(alone ? fields.GetString(message, &field) : fields.GetRepeatedString(message, &field, at));
      break;
    case FieldDescriptor::CPPTYPE_MESSAGE:
      add_message(alone ? fields.GetMessage(message, &field) : fields.GetRepeatedMessage(message, &field, at), json);
      break;
    case FieldDescriptor::CPPTYPE_BOOL: json.value(fields.GetBool(message, &field)); break;
    case FieldDescriptor::CPPTYPE_ENUM: json.value(fields.GetEnum(message, &field)->name()); break;
    default: throw Error(ErrorCode::kInternal, "no document has a " + std::string(field.cpp_type_name()));
  }
}

/// By name, since maps have no order.
void add_map(const Message& message, const FieldDescriptor& field, JsonWriter& json) {
  const google::protobuf::Reflection& fields = *message.GetReflection();
  const FieldDescriptor& key = *field.message_type()->map_key();
  std::map<std::string, const Message*> entries;
  for (int at = 0; at < fields.FieldSize(message, &field); ++at) {
    const Message& entry = fields.GetRepeatedMessage(message, &field, at);
    entries.emplace(entry.GetReflection()->GetString(entry, &key), &entry);
  }
  json.begin_object();
  for (const auto& [name, entry] : entries) {
    add_value(*entry, *field.message_type()->map_value(), kAlone, json.key(name));
  }
  json.end_object();
}

bool is_there(const Message& message, const FieldDescriptor& field) {
  const google::protobuf::Reflection& fields = *message.GetReflection();
  if (!field.is_repeated()) return !field.has_presence() || fields.HasField(message, &field);
  return !field.options().GetExtension(v1::unless_empty) || fields.FieldSize(message, &field) > 0;
}

void add_field(const Message& message, const FieldDescriptor& field, JsonWriter& json) {
  json.key(field.name());
  if (field.options().GetExtension(v1::as_protobuf)) {
    json.raw(protobuf_json(message.GetReflection()->GetMessage(message, &field)));
    return;
  }
  if (field.is_map()) return add_map(message, field, json);
  if (!field.is_repeated()) return add_value(message, field, kAlone, json);
  const int size = message.GetReflection()->FieldSize(message, &field);
  json.begin_array();
  for (int at = 0; at < size; ++at) add_value(message, field, at, json);
  json.end_array();
}

void add_message(const Message& message, JsonWriter& json) {
  const google::protobuf::Descriptor& type = *message.GetDescriptor();
  if (&type == v1::Vector3::descriptor()) {
    json.begin_array();
    for (int i = 0; i < type.field_count(); ++i) add_value(message, *type.field(i), kAlone, json);
    json.end_array();
    return;
  }
  json.begin_object();
  for (int i = 0; i < type.field_count(); ++i) {
    if (is_there(message, *type.field(i))) add_field(message, *type.field(i), json);
  }
  json.end_object();
}

}  // namespace

std::string json_of(const Message& message) {
  JsonWriter json;
  add_message(message, json);
  return std::move(json).text();
}

bool is_nested_too_deep(std::string_view json) {
  constexpr int kDeepest = 64;
  int depth = 0;
  bool quoted = false;
  for (std::size_t at = 0; at < json.size() && depth <= kDeepest; ++at) {
    const char c = json[at];
    if (c == '"') quoted = !quoted;
    if (quoted && c == '\\') ++at;
    if (!quoted) depth += (c == '{' || c == '[') - (c == '}' || c == ']');
  }
  return depth > kDeepest;
}

bool read_json(const std::string& text, Message& message) {
  if (is_nested_too_deep(text)) return false;
  google::protobuf::util::JsonParseOptions options;
  options.ignore_unknown_fields = true;
  return google::protobuf::util::JsonStringToMessage(text, &message, options).ok();
}

std::string protobuf_json(const Message& message, bool zeros) {
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  options.always_print_primitive_fields = zeros;
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(message, &text, options);
  if (!status.ok()) throw Error(ErrorCode::kInternal, "a message can't be written: " + status.ToString());
  return text;
}

void take_fields(const Message& from, Message& to) {
  if (!read_json(protobuf_json(from, true), to)) {
    throw Error(ErrorCode::kInternal, from.GetTypeName() + " and " + to.GetTypeName() + " differ in form");
  }
}

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

}  // namespace ccslice::cli
