// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Requests as they came. Parsing is our own, not gRPC's: it happens when it is the call's turn, so that a call that
// waits holds no more than it sent; its failure has a reason; and what comes of it is bounded. Empty sub-messages take
// two bytes each to send and fifty and more once they are parsed.

#pragma once

#include <google/protobuf/message.h>
#include <grpcpp/support/byte_buffer.h>

namespace ccslice::server {

/// Throws ServiceError{kBatchTooLarge} if it's more than a request of this type may take, Error{kCancelled} if none
/// came: of calls that end while their request arrives gRPC tells, too.
void require_request_size(const grpc::ByteBuffer& bytes, const google::protobuf::Descriptor& type);

/// Fills `request`. Throws ServiceError{kRequestMalformed} if that isn't what the bytes are, kBatchTooLarge if it would
/// take too much.
void parse_request(const grpc::ByteBuffer& bytes, google::protobuf::Message& request);

}  // namespace ccslice::server
