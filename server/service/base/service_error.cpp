// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/base/service_error.h"

namespace ccslice::server {

std::string_view reason(ServiceErrorCode code) {
  switch (code) {
    case ServiceErrorCode::kMeshMissing: return "MESH_MISSING";
    case ServiceErrorCode::kMeshIdInvalid: return "MESH_ID_INVALID";
    case ServiceErrorCode::kRequestMalformed: return "REQUEST_MALFORMED";
    case ServiceErrorCode::kUploadSizeInvalid: return "UPLOAD_SIZE_INVALID";
    case ServiceErrorCode::kUploadTruncated: return "UPLOAD_TRUNCATED";
    case ServiceErrorCode::kUploadOverrun: return "UPLOAD_OVERRUN";
    case ServiceErrorCode::kUploadDigestMismatch: return "UPLOAD_DIGEST_MISMATCH";
    case ServiceErrorCode::kMeshExceedsCache: return "MESH_EXCEEDS_CACHE";
    case ServiceErrorCode::kCacheFull: return "CACHE_FULL";
    case ServiceErrorCode::kServerBusy: return "SERVER_BUSY";
    case ServiceErrorCode::kUploadTooSlow: return "UPLOAD_TOO_SLOW";
    case ServiceErrorCode::kJobExceedsMemory: return "JOB_EXCEEDS_MEMORY";
    case ServiceErrorCode::kStoreUnavailable: return "STORE_UNAVAILABLE";
    case ServiceErrorCode::kTokenMissing: return "TOKEN_MISSING";
    case ServiceErrorCode::kTokenUnknown: return "TOKEN_UNKNOWN";
    case ServiceErrorCode::kRoleMissing: return "ROLE_MISSING";
    case ServiceErrorCode::kClientLimit: return "CLIENT_LIMIT";
    case ServiceErrorCode::kServerDraining: return "SERVER_DRAINING";
    case ServiceErrorCode::kBatchTooLarge: return "BATCH_TOO_LARGE";
    case ServiceErrorCode::kChunkSizeInvalid: return "CHUNK_SIZE_INVALID";
    case ServiceErrorCode::kOutOfMemory: return "OUT_OF_MEMORY";
    case ServiceErrorCode::kStreamIdle: return "STREAM_IDLE";
    case ServiceErrorCode::kMeshExceedsMemory: return "MESH_EXCEEDS_MEMORY";
    case ServiceErrorCode::kRequestUnknownField: return "REQUEST_UNKNOWN_FIELD";
    case ServiceErrorCode::kPageInvalid: return "PAGE_INVALID";
    case ServiceErrorCode::kDeadlineExceeded: return "DEADLINE_EXCEEDED";
    case ServiceErrorCode::kServerShuttingDown: return "SERVER_SHUTTING_DOWN";
    case ServiceErrorCode::kStreamStalled: return "STREAM_STALLED";
    case ServiceErrorCode::kPrinterUnknown: return "PRINTER_UNKNOWN";
    case ServiceErrorCode::kPrinterInvalid: return "PRINTER_INVALID";
  }
  return "INTERNAL";
}

ServiceError job_exceeds_memory(const std::string& what, std::uint64_t bytes, std::uint64_t capacity_bytes,
                                const std::string& remedy, const std::string& option) {
  const auto mib = [](std::uint64_t count) { return std::to_string((count + (1u << 20) - 1) >> 20) + " MiB"; };
  return ServiceError(ServiceErrorCode::kJobExceedsMemory, what + " takes about " + mib(bytes) +
                                                               ", and the server has " + mib(capacity_bytes) +
                                                               " for that: " + remedy + ", or raise " + option);
}

}  // namespace ccslice::server
