// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/status.h"

#include <new>

#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "server/service/limits.h"

namespace ccslice::server {
namespace {

using grpc::StatusCode;

StatusCode code_of(ErrorCode code) {
  switch (code) {
    case ErrorCode::kMeshMalformed:
    case ErrorCode::kMeshEmpty:
    case ErrorCode::kMeshTooLarge:
    case ErrorCode::kMeshNonFinite:
    case ErrorCode::kMeshIndexOutOfRange:
    case ErrorCode::kMeshRepeatedVertex:
    case ErrorCode::kMeshUnsupportedCell:
    case ErrorCode::kMeshNonManifoldFace:
    case ErrorCode::kMeshNonManifoldEdge:
    case ErrorCode::kMeshNonManifoldVertex:
    case ErrorCode::kMeshSharedFaces:
    case ErrorCode::kMeshInvertedCell:
    case ErrorCode::kMeshIsolatedVertex:
    case ErrorCode::kMeshBadSharpFeature:
    case ErrorCode::kMeshBadChannel:
    case ErrorCode::kMeshValenceTooHigh:
    case ErrorCode::kPitchInvalid:
    case ErrorCode::kGridTooLarge:
    case ErrorCode::kPlacementSingular:
    case ErrorCode::kLayerRangeEmpty:
    case ErrorCode::kToleranceInvalid:
    case ErrorCode::kContentInvalid:
    case ErrorCode::kEncodingUnsupported:
    case ErrorCode::kParameterInvalid: return StatusCode::INVALID_ARGUMENT;
    case ErrorCode::kLayerRangeOutOfBounds: return StatusCode::OUT_OF_RANGE;
    case ErrorCode::kCancelled: return StatusCode::CANCELLED;
    case ErrorCode::kInternal:
    case ErrorCode::kFileUnreadable:  // The server reads and writes no files.
    case ErrorCode::kFileSyntax:
    case ErrorCode::kFileUnsupported:
    case ErrorCode::kFileUnwritable: return StatusCode::INTERNAL;
  }
  return StatusCode::INTERNAL;
}

StatusCode code_of(ServiceErrorCode code) {
  switch (code) {
    case ServiceErrorCode::kMeshMissing: return StatusCode::FAILED_PRECONDITION;
    case ServiceErrorCode::kMeshIdInvalid:
    case ServiceErrorCode::kRequestMalformed:
    case ServiceErrorCode::kUploadSizeInvalid:
    case ServiceErrorCode::kUploadTruncated:
    case ServiceErrorCode::kUploadOverrun:
    case ServiceErrorCode::kUploadDigestMismatch:
    case ServiceErrorCode::kBatchTooLarge:
    case ServiceErrorCode::kChunkSizeInvalid: return StatusCode::INVALID_ARGUMENT;
    case ServiceErrorCode::kMeshExceedsCache:
    case ServiceErrorCode::kCacheFull:
    case ServiceErrorCode::kOutOfMemory: return StatusCode::RESOURCE_EXHAUSTED;
    case ServiceErrorCode::kServerBusy:
    case ServiceErrorCode::kServerDraining: return StatusCode::UNAVAILABLE;
  }
  return StatusCode::INTERNAL;
}

/// Collects a status and its details.
class StatusBuilder {
 public:
  StatusBuilder(StatusCode code, std::string_view reason, std::string message)
      : code_(code), message_(std::move(message)) {
    info_.set_reason(std::string(reason));
    info_.set_domain(kErrorDomain);
  }

  void add_field(const std::string& field) {
    if (field.empty()) return;
    (*info_.mutable_metadata())["field"] = field;
    google::rpc::BadRequest bad_request;
    google::rpc::BadRequest::FieldViolation& violation = *bad_request.add_field_violations();
    violation.set_field(field);
    violation.set_description(message_);
    details_.add_details()->PackFrom(bad_request);
  }

  void add_ids(const std::vector<std::int64_t>& ids) {
    if (ids.empty()) return;
    std::string text;
    for (const std::int64_t id : ids) text += (text.empty() ? "" : ",") + std::to_string(id);
    (*info_.mutable_metadata())["ids"] = text;
  }

  void add_missing_mesh(const std::string& mesh_id) {
    google::rpc::PreconditionFailure failure;
    google::rpc::PreconditionFailure::Violation& violation = *failure.add_violations();
    violation.set_type("MISSING");
    violation.set_subject(mesh_id);
    violation.set_description(message_);
    details_.add_details()->PackFrom(failure);
  }

  void add_mesh(const std::string& mesh_id) {
    if (mesh_id.empty()) return;
    google::rpc::ResourceInfo resource;
    resource.set_resource_type("ccslice.v1.ControlMesh");
    resource.set_resource_name(mesh_id);
    details_.add_details()->PackFrom(resource);
  }

  void add_retry_delay() {
    google::rpc::RetryInfo retry;
    retry.mutable_retry_delay()->set_seconds(kRetryDelaySeconds);
    details_.add_details()->PackFrom(retry);
  }

  grpc::Status build() {
    google::rpc::Status all;
    all.set_code(code_);
    all.set_message(message_);
    all.add_details()->PackFrom(info_);
    all.MergeFrom(details_);
    return grpc::Status(code_, message_, all.SerializeAsString());
  }

 private:
  StatusCode code_;
  std::string message_;
  google::rpc::ErrorInfo info_;
  google::rpc::Status details_;
};

bool is_passing_shortage(ServiceErrorCode code) {
  return code == ServiceErrorCode::kServerBusy || code == ServiceErrorCode::kCacheFull;
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
  status.add_field(error.field());
  if (error.code() == ServiceErrorCode::kMeshMissing) status.add_missing_mesh(error.mesh_id());
  status.add_mesh(error.mesh_id());
  if (is_passing_shortage(error.code())) status.add_retry_delay();
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

grpc::Status stopped_status(bool deadline_passed) {
  const StatusCode code = deadline_passed ? StatusCode::DEADLINE_EXCEEDED : StatusCode::CANCELLED;
  const std::string message = deadline_passed ? "the call's deadline passed" : "the call was cancelled";
  return StatusBuilder(code, reason(ErrorCode::kCancelled), message).build();
}

std::string reason_of(const grpc::Status& status) {
  google::rpc::Status all;
  google::rpc::ErrorInfo info;
  if (!all.ParseFromString(status.error_details())) return "";
  for (const google::protobuf::Any& detail : all.details()) {
    if (detail.UnpackTo(&info)) return info.reason();
  }
  return "";
}

}  // namespace ccslice::server
