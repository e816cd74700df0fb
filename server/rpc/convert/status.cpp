// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/convert/status.h"

#include <grpc/grpc.h>

#include <algorithm>
#include <new>

#include "core/base/echo.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "server/service/base/limits.h"

namespace ccslice::server {
namespace {

using grpc::StatusCode;

StatusCode code_of(ErrorCode code) {
  if (code == ErrorCode::kLayerRangeOutOfBounds) return StatusCode::OUT_OF_RANGE;
  if (code == ErrorCode::kCancelled) return StatusCode::CANCELLED;
  const int segment = static_cast<int>(code) / 100;
  if (segment == 1 || segment == 2) return StatusCode::INVALID_ARGUMENT;
  return StatusCode::INTERNAL;  // 4xx too: the server reads and writes no files.
}

StatusCode code_of(ServiceErrorCode code) {
  switch (code) {
    case ServiceErrorCode::kMeshMissing: return StatusCode::FAILED_PRECONDITION;
    case ServiceErrorCode::kMeshIdInvalid:
    case ServiceErrorCode::kRequestMalformed:
    case ServiceErrorCode::kRequestUnknownField:
    case ServiceErrorCode::kUploadSizeInvalid:
    case ServiceErrorCode::kUploadTruncated:
    case ServiceErrorCode::kUploadOverrun:
    case ServiceErrorCode::kUploadDigestMismatch:
    case ServiceErrorCode::kBatchTooLarge:
    case ServiceErrorCode::kPageInvalid:
    case ServiceErrorCode::kPrinterUnknown:
    case ServiceErrorCode::kPrinterInvalid:
    case ServiceErrorCode::kChunkSizeInvalid: return StatusCode::INVALID_ARGUMENT;
    case ServiceErrorCode::kMeshExceedsCache:
    case ServiceErrorCode::kCacheFull:
    case ServiceErrorCode::kMeshExceedsMemory:
    case ServiceErrorCode::kClientLimit:
    case ServiceErrorCode::kJobExceedsMemory:
    case ServiceErrorCode::kOutOfMemory: return StatusCode::RESOURCE_EXHAUSTED;
    case ServiceErrorCode::kServerBusy:
    case ServiceErrorCode::kStoreUnavailable:
    case ServiceErrorCode::kServerDraining:
    case ServiceErrorCode::kServerShuttingDown:
    case ServiceErrorCode::kStreamStalled: return StatusCode::UNAVAILABLE;
    case ServiceErrorCode::kTokenMissing:
    case ServiceErrorCode::kTokenUnknown: return StatusCode::UNAUTHENTICATED;
    case ServiceErrorCode::kRoleMissing: return StatusCode::PERMISSION_DENIED;
    case ServiceErrorCode::kUploadTooSlow:
    case ServiceErrorCode::kStreamIdle:
    case ServiceErrorCode::kDeadlineExceeded: return StatusCode::DEADLINE_EXCEEDED;
  }
  return StatusCode::INTERNAL;
}

/// Room that a message takes as an HTTP/2 trailer: `grpc-message` is percent-encoded.
std::size_t percent_encoded_bytes(const std::string& text) {
  std::size_t bytes = text.size();
  for (const char c : text) bytes += c < 0x20 || c > 0x7e || c == '%' ? 2 : 0;
  return bytes;
}

/// `grpc-status-details-bin` travels as base64.
std::size_t base64_bytes(std::size_t bytes) { return (bytes + 2) / 3 * 4; }

/// Collects a status and its details, and keeps them within kMaxStatusBytes: with more the client's transport would
/// drop the call with a status of its own. What is added first is what matters most, and goes last.
class StatusBuilder {
 public:
  StatusBuilder(StatusCode code, std::string_view reason, const std::string& message)
      : code_(code), message_(echoed(message, kMaxMessageBytes)) {
    info_.set_reason(std::string(reason));
    info_.set_domain(kErrorDomain);
  }

  void add_missing_mesh(const std::string& mesh_id) {
    google::rpc::PreconditionFailure failure;
    google::rpc::PreconditionFailure::Violation& violation = *failure.add_violations();
    violation.set_type("MISSING");
    violation.set_subject(echoed(mesh_id, kMaxNameBytes));
    violation.set_description(echoed(message_, kMaxNameBytes));
    details_.add_details()->PackFrom(failure);
  }

  void add_retry_delay(std::chrono::seconds delay) {
    google::rpc::RetryInfo retry;
    retry.mutable_retry_delay()->set_seconds(delay.count());
    details_.add_details()->PackFrom(retry);
  }

  void add_field(const std::string& field) {
    if (field.empty()) return;
    (*info_.mutable_metadata())["field"] = echoed(field, kMaxNameBytes);
    google::rpc::BadRequest bad_request;
    google::rpc::BadRequest::FieldViolation& violation = *bad_request.add_field_violations();
    violation.set_field(echoed(field, kMaxNameBytes));
    violation.set_description(echoed(message_, kMaxNameBytes));
    details_.add_details()->PackFrom(bad_request);
  }

  void add_ids(const std::vector<std::int64_t>& ids) {
    if (ids.empty()) return;
    std::string text;
    for (std::size_t i = 0; i < ids.size() && i < kMaxEchoItems; ++i) {
      text += (text.empty() ? "" : ",") + std::to_string(ids[i]);
    }
    (*info_.mutable_metadata())["ids"] = text;
  }

  void add_mesh(const std::string& mesh_id) {
    if (mesh_id.empty()) return;
    google::rpc::ResourceInfo resource;
    resource.set_resource_type("ccslice.v1.ControlMesh");
    resource.set_resource_name(echoed(mesh_id, kMaxNameBytes));
    details_.add_details()->PackFrom(resource);
  }

  grpc::Status build() {
    std::string serialized = serialize();
    while (percent_encoded_bytes(message_) + base64_bytes(serialized.size()) >= kMaxStatusBytes &&
           details_.details_size() > 0) {
      details_.mutable_details()->RemoveLast();
      serialized = serialize();
    }
    return grpc::Status(code_, message_, serialized);
  }

 private:
  // One message alone, three bytes an escaped byte, and its copy in the details stay below kMaxStatusBytes together.
  static constexpr std::size_t kMaxMessageBytes = 1000;
  static constexpr std::size_t kMaxNameBytes = 256;
  static_assert(3 * kMaxMessageBytes + 4 * (kMaxMessageBytes + 2 * kMaxNameBytes) / 3 + 200 < kMaxStatusBytes);

  std::string serialize() const {
    google::rpc::Status all;
    all.set_code(code_);
    all.set_message(message_);
    all.add_details()->PackFrom(info_);
    all.MergeFrom(details_);
    return all.SerializeAsString();
  }

  StatusCode code_;
  std::string message_;
  google::rpc::ErrorInfo info_;
  google::rpc::Status details_;
};

bool is_passing_shortage(ServiceErrorCode code) {
  return code == ServiceErrorCode::kServerBusy || code == ServiceErrorCode::kCacheFull ||
         code == ServiceErrorCode::kStoreUnavailable || code == ServiceErrorCode::kClientLimit;
}

template <class Detail>
bool find_detail(const grpc::Status& status, Detail& detail) {
  google::rpc::Status all;
  if (!all.ParseFromString(status.error_details())) return false;
  return std::ranges::any_of(all.details(), [&](const google::protobuf::Any& any) { return any.UnpackTo(&detail); });
}

}  // namespace

grpc::Status to_status(const Error& error) {
  StatusBuilder status(code_of(error.code()), reason(error.code()), error.what());
  status.add_field(error.field());
  status.add_ids(error.ids());
  return status.build();
}

grpc::Status to_status(const ServiceError& error) {
  StatusBuilder status(code_of(error.code()), reason(error.code()), error.what());
  if (error.code() == ServiceErrorCode::kMeshMissing) status.add_missing_mesh(error.mesh_id());
  if (is_passing_shortage(error.code())) status.add_retry_delay(error.retry_delay().value_or(kRetryDelay));
  status.add_field(error.field());
  status.add_mesh(error.mesh_id());
  return status.build();
}

grpc::Status to_status(const std::exception_ptr& error) {
  try {
    std::rethrow_exception(error);
  } catch (const Error& core_error) {
    return to_status(core_error);
  } catch (const ServiceError& service_error) {
    return to_status(service_error);
  } catch (const std::bad_alloc&) {
    return to_status(ServiceError(ServiceErrorCode::kOutOfMemory, "the server is out of memory: try again later"));
  } catch (const std::exception& other) {
    return to_status(Error(ErrorCode::kInternal, std::string("unforeseen: ") + other.what()));
  } catch (...) {
    return to_status(Error(ErrorCode::kInternal, "unforeseen"));
  }
}

grpc::Status stopped_status(bool cut_off, bool deadline_passed) {
  if (cut_off) {
    return to_status(ServiceError(ServiceErrorCode::kServerShuttingDown,
                                  "the server is shutting down and has cut the call: go on with another server"));
  }
  if (deadline_passed)
    return to_status(ServiceError(ServiceErrorCode::kDeadlineExceeded, "the call's deadline passed"));
  return to_status(Error(ErrorCode::kCancelled, "the call was cancelled"));
}

grpc::Status idle_status() {
  return to_status(ServiceError(ServiceErrorCode::kStreamIdle,
                                "the server waited too long for the next message: call again when there is one"));
}

grpc::Status stalled_status() {
  return to_status(
      ServiceError(ServiceErrorCode::kStreamStalled,
                   std::string(reason(ServiceErrorCode::kStreamStalled)) +
                       ": the client read nothing for too long: call again, and read messages as they come"));
}

void reset_stream(grpc::CallbackServerContext& context, const grpc::Status& status) {
  grpc_call_cancel_with_status(context.c_call(), static_cast<grpc_status_code>(status.error_code()),
                               status.error_message().c_str(), nullptr);
}

std::string reason_of(const grpc::Status& status) {
  google::rpc::ErrorInfo info;
  return find_detail(status, info) ? info.reason() : "";
}

void add_pushback(grpc::CallbackServerContext& context, const grpc::Status& status) {
  google::rpc::RetryInfo retry;
  if (!find_detail(status, retry)) return;
  context.AddTrailingMetadata("grpc-retry-pushback-ms", std::to_string(1000 * retry.retry_delay().seconds()));
}

}  // namespace ccslice::server
