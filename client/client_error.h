// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The one exception of the client library: a call that failed for good (what could be retried has been), or an answer
// that can't be right. Compare code() and reason(), never messages.

#pragma once

#include <grpcpp/support/status.h>

#include <chrono>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace ccslice::client {

/// Reasons that this library gives itself; all others come from the server (ccslice/v1/errors.proto).
namespace local_reason {
inline constexpr const char* kAnswerCorrupt = "ANSWER_CORRUPT";     // Wrong size, checksum or order: DATA_LOSS.
inline constexpr const char* kEngineMixed = "ENGINE_MIXED";         // Another engine_version than pinned: ABORTED.
inline constexpr const char* kGridMixed = "GRID_MIXED";             // Another grid than pinned: ABORTED.
inline constexpr const char* kCancelledHere = "CANCELLED_HERE";     // Cancellation::cancel() was called: CANCELLED.
inline constexpr const char* kNotControlMesh = "NOT_CONTROL_MESH";  // Bytes that don't parse: INVALID_ARGUMENT.
inline constexpr const char* kAddressInvalid = "ADDRESS_INVALID";   // No address, or one twice: INVALID_ARGUMENT.
/// Files of certificates or of a token that can't be used: INVALID_ARGUMENT.
inline constexpr const char* kCredentialsInvalid = "CREDENTIALS_INVALID";
}  // namespace local_reason

class ClientError : public std::runtime_error {
 public:
  /// A failed call. `status` MUST NOT be OK. What gRPC couldn't read is an answer that can't be right.
  explicit ClientError(const grpc::Status& status);
  /// A failure found on this side.
  ClientError(grpc::StatusCode code, const std::string& reason, const std::string& message)
      : std::runtime_error(message), code_(code), reason_(reason) {}
  /// The same failure in other words.
  ClientError(const ClientError& failure, const std::string& message)
      : std::runtime_error(message),
        code_(failure.code_),
        reason_(failure.reason_),
        metadata_(failure.metadata_),
        retry_delay_(failure.retry_delay_),
        missing_mesh_id_(failure.missing_mesh_id_),
        refused_by_transport_(failure.refused_by_transport_) {}

  grpc::StatusCode code() const noexcept { return code_; }
  /// ErrorInfo.reason, or one of local_reason; empty if the call failed before a ccslice server saw it.
  const std::string& reason() const noexcept { return reason_; }
  /// ErrorInfo.metadata: "field" and "ids", where the server named them.
  const std::map<std::string, std::string>& metadata() const noexcept { return metadata_; }
  /// How long the server asks to wait before another attempt: an hour where it says more, none where it says less.
  std::optional<std::chrono::milliseconds> retry_delay() const noexcept { return retry_delay_; }
  /// The mesh that the server doesn't hold (FAILED_PRECONDITION with PreconditionFailure MISSING); else empty.
  const std::string& missing_mesh_id() const noexcept { return missing_mesh_id_; }

  /// Whether the same call may succeed later or elsewhere: the connection broke, the server is busy, shutting down or
  /// short of memory.
  bool is_passing() const noexcept;

 private:
  grpc::StatusCode code_;
  std::string reason_;
  std::map<std::string, std::string> metadata_;
  std::optional<std::chrono::milliseconds> retry_delay_;
  std::string missing_mesh_id_;
  bool refused_by_transport_ = false;  // The server had no memory for what arrives.
};

/// Throws ClientError{DATA_LOSS, ANSWER_CORRUPT}.
[[noreturn]] void answer_corrupt(const std::string& message);
/// Throws it unless `holds`, with what is wrong otherwise.
void require_answer(bool holds, const std::string& otherwise);

/// "UNAVAILABLE", "INVALID_ARGUMENT", ...
std::string status_code_name(grpc::StatusCode code);

}  // namespace ccslice::client
