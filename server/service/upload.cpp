// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/upload.h"

#include "server/service/mesh_id.h"
#include "server/service/service_error.h"

namespace ccslice::server {

bool UploadBudget::try_take(std::uint64_t bytes) noexcept {
  std::uint64_t used = used_bytes_.load();
  do {
    if (bytes > capacity_bytes_ || used > capacity_bytes_ - bytes) return false;
  } while (!used_bytes_.compare_exchange_weak(used, used + bytes));
  return true;
}

Upload::~Upload() { release(); }

void Upload::start(const std::string& mesh_id, std::uint64_t size_bytes) {
  if (started()) {
    throw ServiceError(ServiceErrorCode::kRequestMalformed,
                       "a second start: only the first message of an upload has one", "start");
  }
  require_mesh_id(mesh_id, "start.mesh_id");
  if (size_bytes == 0 || size_bytes > max_bytes_) {
    throw ServiceError(ServiceErrorCode::kUploadSizeInvalid,
                       "start.size_bytes is " + std::to_string(size_bytes) + ": this server takes 1 to " +
                           std::to_string(max_bytes_) + " bytes",
                       "start.size_bytes", mesh_id);
  }
  mesh_id_ = mesh_id;
  size_bytes_ = size_bytes;
}

void Upload::append(std::string_view chunk) {
  if (!started()) {
    throw ServiceError(ServiceErrorCode::kRequestMalformed,
                       "a chunk before start: the first message announces the mesh", "start");
  }
  if (chunk.size() > size_bytes_ - bytes_.size()) {
    throw ServiceError(ServiceErrorCode::kUploadOverrun,
                       "more than the " + std::to_string(size_bytes_) + " bytes that start.size_bytes announced",
                       "chunk", mesh_id_);
  }
  if (!budget_->try_take(chunk.size())) {
    throw ServiceError(ServiceErrorCode::kServerBusy, "too many bytes of uploads at once: try again later", "",
                       mesh_id_);
  }
  try {
    bytes_.append(chunk);
  } catch (...) {
    budget_->give_back(chunk.size());
    throw;
  }
}

void Upload::finish() const {
  if (!started()) {
    throw ServiceError(ServiceErrorCode::kRequestMalformed,
                       "the upload has no start: the first message announces the mesh", "start");
  }
  if (bytes_.size() < size_bytes_) {
    throw ServiceError(ServiceErrorCode::kUploadTruncated,
                       "the stream ended after " + std::to_string(bytes_.size()) + " of " +
                           std::to_string(size_bytes_) + " bytes: upload again",
                       "chunk", mesh_id_);
  }
}

void Upload::verify_digest() const {
  const std::string actual = mesh_id_of(bytes_);
  if (actual == mesh_id_) return;
  throw ServiceError(ServiceErrorCode::kUploadDigestMismatch,
                     "the " + std::to_string(bytes_.size()) + " bytes received are those of " + actual + ", not of " +
                         mesh_id_ + ": upload again, with the digest of the bytes as sent",
                     "start.mesh_id", mesh_id_);
}

void Upload::release() noexcept {
  budget_->give_back(bytes_.size());
  std::string().swap(bytes_);
}

}  // namespace ccslice::server
