// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/meshes/upload.h"

namespace ccslice::server {
namespace {

/// Small chunks are put together up to here: a block of its own for each would cost more than the bytes.
constexpr std::size_t kBlockBytes = 256 << 10;

}  // namespace

bool UploadedBytes::append(std::string_view bytes) {
  if (!share_.resize(size_ + bytes.size())) return false;
  size_ += bytes.size();
  if (blocks_.empty() || blocks_.back().size() >= kBlockBytes) blocks_.emplace_back();
  blocks_.back().append(bytes);
  return true;
}

void UploadedBytes::release() noexcept {
  std::vector<std::string>().swap(blocks_);
  size_ = 0;
  leave_budget();
}

void UploadedBytes::leave_budget() {
  is_in_budget_ = false;
  share_.give_back();
}

bool UploadedBytes::enter_budget() noexcept {
  if (!share_.resize(size_)) return false;
  is_in_budget_ = true;
  return true;
}

ServiceError too_many_upload_bytes(const std::string& mesh_id) {
  return ServiceError(ServiceErrorCode::kServerBusy,
                      "too many bytes of uploads at once, in all or of one client: try again later", "", mesh_id);
}

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
  if (!bytes_.append(chunk)) throw too_many_upload_bytes(mesh_id_);
  hasher_.add(chunk);
}

void Upload::finish() {
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
  const std::string actual = hasher_.mesh_id();
  if (actual == mesh_id_) return;
  throw ServiceError(ServiceErrorCode::kUploadDigestMismatch,
                     "the " + std::to_string(bytes_.size()) + " bytes received are those of " + actual + ", not of " +
                         mesh_id_ + ": upload again, with the digest of the bytes as sent",
                     "start.mesh_id", mesh_id_);
}

void UploadPace::count(std::uint64_t bytes, Clock::time_point now) {
  constexpr double kWhileS = 10;
  bytes_ += bytes;
  const double seconds = std::chrono::duration<double>(now - begin_).count();
  if (seconds < kWhileS) return;
  if (static_cast<double>(bytes_) < static_cast<double>(least_) * seconds) {
    throw ServiceError(ServiceErrorCode::kUploadTooSlow, "an upload brought " + std::to_string(bytes_) + " bytes in " +
                                                             std::to_string(static_cast<int>(seconds)) +
                                                             " s, and the server wants " + std::to_string(least_) +
                                                             " a second: use a better line, or send larger chunks");
  }
  begin_ = now;
  bytes_ = 0;
}

}  // namespace ccslice::server
