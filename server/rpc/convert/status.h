// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The one place where failures become gRPC statuses: code, message, and google.rpc details (see
// ccslice/v1/errors.proto).

#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/status.h>

#include <cstddef>
#include <exception>
#include <string>

#include "core/base/error.h"
#include "server/service/base/service_error.h"

namespace ccslice::server {

/// ErrorInfo.domain of everything that ccslice sends.
inline constexpr const char* kErrorDomain = "ccslice";

/// Bound of what a status takes in the trailers, as encoded there: message and details together. gRPC clients take 8
/// KiB of trailers by default, and turn more into a RESOURCE_EXHAUSTED without reason.
inline constexpr std::size_t kMaxStatusBytes = 6u << 10;

[[nodiscard]] grpc::Status to_status(const Error& error);
[[nodiscard]] grpc::Status to_status(const ServiceError& error);
/// The status of any exception: a core Error, a ServiceError, out of memory, or something unforeseen (INTERNAL).
[[nodiscard]] grpc::Status to_status(const std::exception_ptr& error);

/// The status of a call that was stopped: UNAVAILABLE if a shutdown cut it off, DEADLINE_EXCEEDED if its deadline has
/// passed, CANCELLED otherwise.
[[nodiscard]] grpc::Status stopped_status(bool cut_off, bool deadline_passed);

/// The status of a call whose client was silent for too long.
[[nodiscard]] grpc::Status idle_status();

/// The status of a call whose client has read nothing for too long. Details don't reach it, so the message has the
/// reason too.
[[nodiscard]] grpc::Status stalled_status();

/// Ends a call without regard to messages that its client hasn't read. Code and message reach it, details don't. The
/// call still has to be finished.
void reset_stream(grpc::CallbackServerContext& context, const grpc::Status& status);

/// ErrorInfo.reason of a status of ours; empty if it has none.
std::string reason_of(const grpc::Status& status);

/// Of a status with a RetryInfo, adds the trailer `grpc-retry-pushback-ms` too: clients of gRPC's that retry by
/// themselves look for that. Before Finish().
void add_pushback(grpc::CallbackServerContext& context, const grpc::Status& status);

}  // namespace ccslice::server
