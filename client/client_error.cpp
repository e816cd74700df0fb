// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/client_error.h"

#include <google/protobuf/any.pb.h>

#include <algorithm>
#include <array>
#include <cstdint>

#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"

namespace ccslice::client {
namespace {

/// From none to an hour, whatever the server says: added to a time, more might overflow.
std::chrono::milliseconds pause_of(const google::protobuf::Duration& duration) {
  constexpr std::chrono::milliseconds kNone(0), kMost(std::chrono::hours(1));
  constexpr std::int64_t kMostSeconds = 3'600;
  const std::chrono::seconds seconds(std::clamp(std::int64_t{duration.seconds()}, -kMostSeconds, kMostSeconds));
  return std::clamp(seconds + std::chrono::milliseconds(duration.nanos() / 1'000'000), kNone, kMost);
}

/// Streams that stalled are reset: their reason comes without details, in front of the message.
std::string reason_in_message(const std::string& message) {
  static const std::string kStalled = "STREAM_STALLED";
  return message.starts_with(kStalled + ":") ? kStalled : "";
}

/// gRPC's servers reset new streams so while what arrives takes too much memory (RFC 9113, 7: ENHANCE_YOUR_CALM).
bool is_refused_by_transport(const grpc::Status& status) {
  return status.error_code() == grpc::StatusCode::RESOURCE_EXHAUSTED &&
         status.error_message() == "Received RST_STREAM with error code 11";
}

/// What gRPC itself says of answers that are compressed or don't parse. Servers give a reason.
bool is_of_no_message(const grpc::Status& status) {
  return status.error_code() == grpc::StatusCode::UNIMPLEMENTED && status.error_details().empty() &&
         (status.error_message().starts_with("Compression algorithm '") ||
          status.error_message() == "No message returned for unary request");
}

}  // namespace

ClientError::ClientError(const grpc::Status& status)
    : std::runtime_error(is_of_no_message(status)
                             ? "the server's answer is wrong: it is compressed, or no message of ccslice.v1"
                             : status.error_message()),
      code_(status.error_code()) {
  if (is_of_no_message(status)) {
    code_ = grpc::StatusCode::DATA_LOSS;
    reason_ = local_reason::kAnswerCorrupt;
    return;
  }
  google::rpc::Status details;
  reason_ = reason_in_message(status.error_message());
  refused_by_transport_ = is_refused_by_transport(status);
  if (!details.ParseFromString(status.error_details())) return;
  for (const google::protobuf::Any& detail : details.details()) {
    google::rpc::ErrorInfo info;
    google::rpc::RetryInfo retry;
    google::rpc::PreconditionFailure failure;
    if (detail.UnpackTo(&info)) {
      reason_ = info.reason();
      metadata_.insert(info.metadata().begin(), info.metadata().end());
    } else if (detail.UnpackTo(&retry)) {
      retry_delay_ = pause_of(retry.retry_delay());
    } else if (detail.UnpackTo(&failure)) {
      for (const auto& violation : failure.violations()) {
        if (violation.type() == "MISSING") missing_mesh_id_ = violation.subject();
      }
    }
  }
}

bool ClientError::is_passing() const noexcept {
  switch (code_) {
    case grpc::StatusCode::UNAVAILABLE: return true;
    case grpc::StatusCode::RESOURCE_EXHAUSTED:
      return retry_delay_.has_value() || reason_ == "OUT_OF_MEMORY" || refused_by_transport_;
    // Proxies and transports report a connection that broke in the middle of a call so; servers always give a reason.
    case grpc::StatusCode::CANCELLED:
    case grpc::StatusCode::INTERNAL:
    case grpc::StatusCode::UNKNOWN: return reason_.empty();
    default: return false;
  }
}

void answer_corrupt(const std::string& message) {
  throw ClientError(grpc::StatusCode::DATA_LOSS, local_reason::kAnswerCorrupt, message);
}

void require_answer(bool holds, const std::string& otherwise) {
  if (!holds) answer_corrupt("the server's answer is wrong: " + otherwise);
}

std::string status_code_name(grpc::StatusCode code) {
  static constexpr std::array<const char*, 17> kNames = {
      "OK",        "CANCELLED",      "UNKNOWN",           "INVALID_ARGUMENT",   "DEADLINE_EXCEEDED",
      "NOT_FOUND", "ALREADY_EXISTS", "PERMISSION_DENIED", "RESOURCE_EXHAUSTED", "FAILED_PRECONDITION",
      "ABORTED",   "OUT_OF_RANGE",   "UNIMPLEMENTED",     "INTERNAL",           "UNAVAILABLE",
      "DATA_LOSS", "UNAUTHENTICATED"};
  const auto index = static_cast<std::size_t>(code);
  return index < kNames.size() ? kNames[index] : "UNKNOWN";
}

}  // namespace ccslice::client
