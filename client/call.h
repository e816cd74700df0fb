// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What every gRPC call of the client has in common: a deadline, cancellation, and errors as exceptions.

#pragma once

#include <grpcpp/client_context.h>

#include "client/client.h"

namespace ccslice::client {

/// One gRPC call: its context with deadline and cancellation applied, and its status turned into an exception.
class Call {
 public:
  /// Throws ClientError (CANCELLED_HERE) if cancelled already.
  explicit Call(const CallOptions& options);

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
