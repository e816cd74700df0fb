// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What every gRPC call of the client has in common: a deadline, cancellation, metadata, and errors as exceptions.

#pragma once

#include <grpcpp/client_context.h>

#include <string>

#include "client/client.h"
#include "client/endpoints.h"

namespace ccslice::client {

/// One gRPC call: its context with deadline, cancellation and metadata applied, and its status turned into an
/// exception.
class Call {
 public:
  /// Throws ClientError (CANCELLED_HERE) if cancelled already. `mesh_id` tells proxies which mesh the call is about;
  /// empty if about none.
  Call(const CallOptions& options, const Endpoint& endpoint, const std::string& mesh_id);

  grpc::ClientContext& context() { return context_; }
  /// Throws ClientError unless `status` is OK.
  void check(const grpc::Status& status) const;

 private:
  const CallOptions& options_;
  grpc::ClientContext context_;
  Cancellation::Scope scope_;
};

[[noreturn]] void throw_cancelled_here();

}  // namespace ccslice::client
