// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Messages of the contract as JSON for scripts. Unlike protobuf's own mapping, numbers are numbers, zeros are there,
// and a colour has the form that it has everywhere else.

#pragma once

#include <google/protobuf/message.h>

#include <cstdint>
#include <optional>
#include <string>

#include "client/cli/base/json.h"

namespace ccslice::cli {

/// "#c8d2dcff" of 0xRRGGBBAA.
std::string colour_text(std::uint32_t rgba);
/// 0xRRGGBBAA of "#c8d2dcff"; nothing of any other text.
std::optional<std::uint32_t> colour_of_text(const std::string& text);

/// The message as an object: its fields by their names in the contract, all that have no presence and those that are
/// set. Enumeration values have their names, and fields called rgba are colours. REQUIRES: what repeats are messages.
void add_message(const google::protobuf::Message& message, JsonWriter& json);

}  // namespace ccslice::cli
