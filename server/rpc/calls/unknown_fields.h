// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Fields with numbers that this version doesn't know, sent by a newer client. Protobuf would keep quiet about them, but
// to slice something else than was asked for is a wrong print.

#pragma once

#include <google/protobuf/message.h>

#include <string>

namespace ccslice::server {

/// Path of the first unknown field in a message or in those that it holds, by number where there is no name:
/// "planes[2].9". Empty if there is none. Takes time in proportion to the messages, not to their numbers.
std::string first_unknown_field(const google::protobuf::Message& message);

/// Throws ServiceError{kRequestUnknownField} if there is one.
void require_known_fields(const google::protobuf::Message& request);

}  // namespace ccslice::server
