// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Our own JSON files read back: a field that is missing or of another kind is empty.

#pragma once

#include <google/protobuf/struct.pb.h>

#include <cstdint>
#include <optional>
#include <string>

namespace ccslice::cli {

/// The object that `json` holds, or nothing if it isn't an object.
[[nodiscard]] std::optional<google::protobuf::Struct> parse_object(const std::string& json);

const google::protobuf::Value& field(const google::protobuf::Struct& object, const char* name);
double number(const google::protobuf::Struct& object, const char* name);
/// The number, or 0 if it isn't a whole number from 0 to `most`.
std::uint64_t count(const google::protobuf::Struct& object, const char* name,
                    std::uint64_t most = std::uint64_t{1} << 53);
const std::string& text(const google::protobuf::Struct& object, const char* name);
/// The items of an array.
const google::protobuf::RepeatedPtrField<google::protobuf::Value>& items(const google::protobuf::Struct& object,
                                                                         const char* name);

}  // namespace ccslice::cli
