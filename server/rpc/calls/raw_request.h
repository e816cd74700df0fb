// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Requests as they came. Parsing is our own, not gRPC's: it happens when it is the call's turn, so that a call that
// waits holds no more than it sent; its failure has a reason; and what comes of it is bounded before anything comes of
// it (parsed_size.h).

#pragma once

#include <google/protobuf/message.h>
#include <grpcpp/support/byte_buffer.h>

namespace ccslice::server {

/// Throws ServiceError{kBatchTooLarge} if it's more than a request of this type may take, Error{kCancelled} if none
/// came: of calls that end while their request arrives gRPC tells, too.
void require_request_size(const grpc::ByteBuffer& bytes, const google::protobuf::Descriptor& type);

/// Fills `request`, one of the service's. Throws ServiceError{kRequestMalformed} if that isn't what the bytes are,
/// kBatchTooLarge if it would take too much. Within some tens of milliseconds, whatever the bytes are.
void parse_request(const grpc::ByteBuffer& bytes, google::protobuf::Message& request);

}  // namespace ccslice::server
