// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/call.h"

namespace ccslice::client {

void throw_cancelled_here() {
  throw ClientError(grpc::StatusCode::CANCELLED, local_reason::kCancelledHere, "cancelled");
}

Call::Call(const CallOptions& options, const Endpoint& endpoint, const std::string& mesh_id)
    : options_(options), scope_(options.cancellation, context_) {
  if (options.cancellation && options.cancellation->cancelled()) throw_cancelled_here();
  if (options.deadline) context_.set_deadline(*options.deadline);
  // What isn't an id is refused by the server; in metadata it might not even be sent.
  if (is_mesh_id(mesh_id)) context_.AddMetadata("ccslice-mesh-id", mesh_id);
  if (endpoint.token) context_.AddMetadata("authorization", "Bearer " + endpoint.token->token());
}

void Call::check(const grpc::Status& status) const {
  if (status.ok()) return;
  if (options_.cancellation && options_.cancellation->cancelled()) throw_cancelled_here();
  throw ClientError(status);
}

}  // namespace ccslice::client
