// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/call.h"

namespace ccslice::client {

void throw_cancelled_here() {
  throw ClientError(grpc::StatusCode::CANCELLED, local_reason::kCancelledHere, "cancelled");
}

Call::Call(const CallOptions& options) : options_(options), scope_(options.cancellation, context_) {
  if (options.cancellation && options.cancellation->cancelled()) throw_cancelled_here();
  if (options.deadline) context_.set_deadline(*options.deadline);
}

void Call::check(const grpc::Status& status) const {
  if (status.ok()) return;
  if (options_.cancellation && options_.cancellation->cancelled()) throw_cancelled_here();
  throw ClientError(status);
}

}  // namespace ccslice::client
