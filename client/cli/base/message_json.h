// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Messages of proto/ccslice/cli/v1 as JSON: what --json prints, and files that we read again. form.proto says what they
// look like. Unlike in protobuf's own mapping, numbers of 64 bits are numbers, and zeros are there.

#pragma once

#include <google/protobuf/message.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "client/cli/base/messages.h"

namespace ccslice::cli {

std::string json_of(const google::protobuf::Message& message);

/// An array.
template <class Messages>
std::string json_list_of(const Messages& messages) {
  std::string text;
  for (const auto& message : messages) text += (text.empty() ? "" : ",") + json_of(message);
  return "[" + text + "]";
}

/// Whether brackets of the text are nested deeper than those of any file of ours: protobuf takes long over such.
[[nodiscard]] bool is_nested_too_deep(std::string_view json);

/// Reads what json_of() wrote, unless the message has a Vector3. Members that the message lacks are left out; returns
/// false if others don't fit it, or if the text isn't an object.
[[nodiscard]] bool read_json(const std::string& text, google::protobuf::Message& message);

/// The message in protobuf's own JSON, with names as in the contract. `zeros`: of fields without presence, too.
std::string protobuf_json(const google::protobuf::Message& message, bool zeros = false);

/// Copies what `from` has under the same names into `to`, which loses all else. Throws Error{kInternal} if something of
/// the same name has another form.
void take_fields(const google::protobuf::Message& from, google::protobuf::Message& to);

template <class To>
To with_fields_of(const google::protobuf::Message& from) {
  To to;
  take_fields(from, to);
  return to;
}

/// "#c8d2dcff" of 0xRRGGBBAA.
std::string colour_text(std::uint32_t rgba);
/// 0xRRGGBBAA of "#c8d2dcff"; nothing of any other text.
std::optional<std::uint32_t> colour_of_text(const std::string& text);

}  // namespace ccslice::cli
