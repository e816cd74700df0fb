// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A call of one request and one answer.

#pragma once

#include <grpcpp/support/server_callback.h>

#include "server/rpc/calls/answered_call.h"

namespace ccslice::server {

class UnaryCall : public AnsweredCall<grpc::ServerUnaryReactor> {
 protected:
  using AnsweredCall::AnsweredCall;

  /// May throw. The request's bytes count nowhere, and a call may wait for a mesh, or for its answer's reader.
  template <class Request>
  void parse_and_drop(const grpc::ByteBuffer& raw, Request& request) {
    try {
      parse_request(raw, request);
    } catch (...) {
      drop_request(raw);
      throw;
    }
    drop_request(raw);
  }
};

}  // namespace ccslice::server
