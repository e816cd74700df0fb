// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Failures of the service itself, as opposed to those of the mesh or of the slicing request, which are the core's
// ccslice::Error. Numbers and names are those of ccslice.v1.ErrorReason.

#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

namespace ccslice::server {

enum class ServiceErrorCode : int {
  kMeshMissing = 500,           // Not in the cache: the client uploads it.
  kMeshIdInvalid = 501,         // Not "sha256:" and 64 lower-case hexadecimal digits.
  kRequestMalformed = 502,      // Not protobuf; arrays that don't fit together, messages at the wrong place.
  kUploadSizeInvalid = 503,     // Zero, or above the limit.
  kUploadTruncated = 504,       // The stream ended too early.
  kUploadOverrun = 505,         // More bytes than announced.
  kUploadDigestMismatch = 506,  // The bytes aren't those of the id.
  kMeshExceedsCache = 507,      // Larger than the whole cache.
  kCacheFull = 508,             // Everything in the cache is in use.
  kServerBusy = 509,            // All calls or all memory that the server has for them are in use.
  kServerDraining = 510,        // Shutting down: takes no new calls.
  kBatchTooLarge = 511,         // More points, ids or bytes in one message than the limit.
  kChunkSizeInvalid = 512,      // max_chunk_bytes out of its range.
  kOutOfMemory = 513,           // An allocation failed.
  kStreamIdle = 514,            // The client sent nothing for too long.
  kMeshExceedsMemory = 515,     // Preparing it takes more than the server has for that.
  kRequestUnknownField = 516,   // A field that this version doesn't know.
  kPageInvalid = 517,           // A page size out of its range, or a page token of someone else.
  kDeadlineExceeded = 518,      // The call's deadline passed.
  kServerShuttingDown = 519,    // Shutting down: cuts calls that were running.
  kStreamStalled = 520,         // The client read nothing for too long.
  kPrinterUnknown = 521,        // A printer profile that isn't there.
  kPrinterInvalid = 522,        // A printer profile that can't be.
  kUploadTooSlow = 523,         // Fewer bytes a second than the least.
  kJobExceedsMemory = 524,      // Slicing takes more than the server has for that.
  kStoreUnavailable = 525,      // The mesh store that servers share can't be asked.
  kTokenMissing = 526,          // The call needs a token and brings none.
  kTokenUnknown = 527,          // A token that the server doesn't know, or that has expired.
  kRoleMissing = 528,           // The token is good, but not for this call.
  kClientLimit = 529,           // As many calls of this client are open as may be.
};

inline constexpr std::array kServiceErrorCodes = {
    ServiceErrorCode::kMeshMissing,
    ServiceErrorCode::kMeshIdInvalid,
    ServiceErrorCode::kRequestMalformed,
    ServiceErrorCode::kUploadSizeInvalid,
    ServiceErrorCode::kUploadTruncated,
    ServiceErrorCode::kUploadOverrun,
    ServiceErrorCode::kUploadDigestMismatch,
    ServiceErrorCode::kMeshExceedsCache,
    ServiceErrorCode::kCacheFull,
    ServiceErrorCode::kServerBusy,
    ServiceErrorCode::kServerDraining,
    ServiceErrorCode::kBatchTooLarge,
    ServiceErrorCode::kChunkSizeInvalid,
    ServiceErrorCode::kOutOfMemory,
    ServiceErrorCode::kStreamIdle,
    ServiceErrorCode::kMeshExceedsMemory,
    ServiceErrorCode::kRequestUnknownField,
    ServiceErrorCode::kPageInvalid,
    ServiceErrorCode::kDeadlineExceeded,
    ServiceErrorCode::kServerShuttingDown,
    ServiceErrorCode::kStreamStalled,
    ServiceErrorCode::kPrinterUnknown,
    ServiceErrorCode::kPrinterInvalid,
    ServiceErrorCode::kUploadTooSlow,
    ServiceErrorCode::kJobExceedsMemory,
    ServiceErrorCode::kStoreUnavailable,
    ServiceErrorCode::kTokenMissing,
    ServiceErrorCode::kTokenUnknown,
    ServiceErrorCode::kRoleMissing,
    ServiceErrorCode::kClientLimit,
};

/// Upper-case snake-case name, e.g. "MESH_MISSING". Stable.
std::string_view reason(ServiceErrorCode code);

class ServiceError : public std::runtime_error {
 public:
  /// `field`: the request field at fault ("" if none). `mesh_id`: the mesh that is the matter ("" if none).
  ServiceError(ServiceErrorCode code, const std::string& message, std::string field = {}, std::string mesh_id = {})
      : std::runtime_error(message), code_(code), field_(std::move(field)), mesh_id_(std::move(mesh_id)) {}
  /// A shortage that passes.
  ServiceError(ServiceErrorCode code, const std::string& message, std::chrono::seconds retry_delay)
      : std::runtime_error(message), code_(code), retry_delay_(retry_delay) {}

  ServiceErrorCode code() const noexcept { return code_; }
  const std::string& field() const noexcept { return field_; }
  const std::string& mesh_id() const noexcept { return mesh_id_; }
  /// After which the client may try again, if that is known.
  std::optional<std::chrono::seconds> retry_delay() const noexcept { return retry_delay_; }

 private:
  ServiceErrorCode code_;
  std::string field_;
  std::string mesh_id_;
  std::optional<std::chrono::seconds> retry_delay_;
};

/// JOB_EXCEEDS_MEMORY: `what` takes so much, and the server has so much for that, whoever else is there. `remedy`:
/// what helps beside raising the option.
[[nodiscard]] ServiceError job_exceeds_memory(const std::string& what, std::uint64_t bytes,
                                              std::uint64_t capacity_bytes, const std::string& remedy,
                                              const std::string& option);

}  // namespace ccslice::server
