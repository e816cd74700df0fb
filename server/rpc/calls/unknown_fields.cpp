// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/calls/unknown_fields.h"

#include <google/protobuf/unknown_field_set.h>

#include <vector>

#include "server/service/base/service_error.h"

namespace ccslice::server {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

/// The first unknown field in the messages that one field holds; empty if there is none.
std::string first_within(const Message& message, const FieldDescriptor& field) {
  const auto& reflection = *message.GetReflection();
  if (!field.is_repeated()) {
    const std::string path = first_unknown_field(reflection.GetMessage(message, &field));
    return path.empty() ? path : field.name() + "." + path;
  }
  for (int i = 0; i < reflection.FieldSize(message, &field); ++i) {
    const std::string path = first_unknown_field(reflection.GetRepeatedMessage(message, &field, i));
    if (!path.empty()) return field.name() + "[" + std::to_string(i) + "]." + path;
  }
  return "";
}

}  // namespace

std::string first_unknown_field(const Message& message) {
  const auto& reflection = *message.GetReflection();
  const auto& unknown = reflection.GetUnknownFields(message);
  if (!unknown.empty()) return std::to_string(unknown.field(0).number());
  std::vector<const FieldDescriptor*> fields;
  reflection.ListFields(message, &fields);
  for (const FieldDescriptor* field : fields) {
    if (field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) continue;
    const std::string path = first_within(message, *field);
    if (!path.empty()) return path;
  }
  return "";
}

void require_known_fields(const Message& request) {
  const std::string path = first_unknown_field(request);
  if (path.empty()) return;
  throw ServiceError(ServiceErrorCode::kRequestUnknownField,
                     "field number " + path.substr(path.rfind('.') + 1) + " (" + path + " of " +
                         request.GetDescriptor()->name() +
                         ") is unknown to this server: use a newer server, or leave the field out",
                     path);
}

}  // namespace ccslice::server
