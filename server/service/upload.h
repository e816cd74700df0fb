// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Collects the bytes of one upload: an id and a size are announced, then chunks come, then the end. Memory grows with
// the bytes that came, never with the size that was claimed, and all uploads together stay within a budget.

#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <string_view>

namespace ccslice::server {

/// Bytes that all running uploads may hold together. Thread-safe.
class UploadBudget {
 public:
  explicit UploadBudget(std::uint64_t capacity_bytes) : capacity_bytes_(capacity_bytes) {}

  /// Takes `bytes` of the budget if they fit.
  bool try_take(std::uint64_t bytes) noexcept;
  void give_back(std::uint64_t bytes) noexcept { used_bytes_.fetch_sub(bytes); }
  std::uint64_t used_bytes() const noexcept { return used_bytes_.load(); }

 private:
  const std::uint64_t capacity_bytes_;
  std::atomic<std::uint64_t> used_bytes_{0};
};

/// One upload. Not thread-safe. Errors are ServiceErrors and end the upload.
class Upload {
 public:
  /// The budget outlives the upload.
  Upload(UploadBudget& budget, std::uint64_t max_bytes) : budget_(&budget), max_bytes_(max_bytes) {}
  ~Upload();
  Upload(const Upload&) = delete;
  Upload& operator=(const Upload&) = delete;

  bool started() const noexcept { return !mesh_id_.empty(); }
  const std::string& mesh_id() const noexcept { return mesh_id_; }

  /// Throws kMeshIdInvalid, kUploadSizeInvalid, kRequestMalformed (started already).
  void start(const std::string& mesh_id, std::uint64_t size_bytes);
  /// Throws kRequestMalformed (not started), kUploadOverrun, kServerBusy (the budget is used up).
  void append(std::string_view chunk);
  /// Checks that all bytes came. Throws kRequestMalformed (not started), kUploadTruncated.
  void finish() const;
  /// Checks the digest. Hashes everything: for a worker thread. REQUIRES: finish() passed. Throws
  /// kUploadDigestMismatch.
  void verify_digest() const;

  const std::string& bytes() const noexcept { return bytes_; }
  /// Frees the bytes and gives them back to the budget.
  void release() noexcept;

 private:
  UploadBudget* budget_;
  std::uint64_t max_bytes_;
  std::string mesh_id_;
  std::uint64_t size_bytes_ = 0;
  std::string bytes_;
};

}  // namespace ccslice::server
