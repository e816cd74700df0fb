// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Collects the bytes of one upload: an id and a size are announced, then chunks come, then the end. Memory grows with
// the bytes that came, never with the size that was claimed, and all uploads together stay within a budget. The bytes
// are hashed as they come, a chunk at a time, so nothing long is left to do at the end.

#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/service/base/service_error.h"
#include "server/service/meshes/mesh_id.h"
#include "server/service/scheduling/memory_budget.h"

namespace ccslice::server {

/// The bytes of an upload. Blocks, rather than one string, because growing that one would copy and hold them twice.
class UploadedBytes {
 public:
  /// The budget outlives the bytes. `client`: as in MemoryBudget::Share.
  explicit UploadedBytes(MemoryBudget& budget, std::string client = {}) : share_(budget, std::move(client)) {}

  std::uint64_t size() const noexcept { return size_; }
  /// False if the budget is used up, or the client's part of it.
  [[nodiscard]] bool append(std::string_view bytes);
  const std::vector<std::string>& blocks() const noexcept { return blocks_; }
  /// Frees the bytes and gives them back to the budget.
  void release() noexcept;
  /// Keeps the bytes, while they count elsewhere.
  void leave_budget();
  /// Has them count here again. False if there is no room for them.
  [[nodiscard]] bool enter_budget() noexcept;
  /// Whether they count here. Any thread.
  bool is_in_budget() const noexcept { return is_in_budget_.load(); }

 private:
  MemoryBudget::Share share_;
  std::uint64_t size_ = 0;
  std::atomic<bool> is_in_budget_{true};
  std::vector<std::string> blocks_;  // All but the last hold at least kBlockBytes.
};

/// SERVER_BUSY.
[[nodiscard]] ServiceError too_many_upload_bytes(const std::string& mesh_id);

/// One upload. Not thread-safe. Errors are ServiceErrors and end the upload.
class Upload {
 public:
  /// The budget outlives the upload. `client`: as in MemoryBudget::Share.
  Upload(MemoryBudget& budget, std::uint64_t max_bytes, std::string client = {})
      : max_bytes_(max_bytes), bytes_(budget, std::move(client)) {}

  bool started() const noexcept { return !mesh_id_.empty(); }
  const std::string& mesh_id() const noexcept { return mesh_id_; }

  /// Throws kMeshIdInvalid, kUploadSizeInvalid, kRequestMalformed (started already).
  void start(const std::string& mesh_id, std::uint64_t size_bytes);
  /// Throws kRequestMalformed (not started), kUploadOverrun, kServerBusy (the budget is used up, or the client's part
  /// of it).
  void append(std::string_view chunk);
  /// Checks that all bytes came, and their digest. Throws kRequestMalformed (not started), kUploadTruncated,
  /// kUploadDigestMismatch.
  void finish();

  UploadedBytes& bytes() noexcept { return bytes_; }

 private:
  std::uint64_t max_bytes_;
  std::string mesh_id_;
  std::uint64_t size_bytes_ = 0;
  UploadedBytes bytes_;
  MeshIdHasher hasher_;
};

/// Whether the bytes of an upload come fast enough: over each while of 10 s.
class UploadPace {
 public:
  using Clock = std::chrono::steady_clock;

  /// 0: any pace will do.
  explicit UploadPace(std::uint64_t least_bytes_a_second, Clock::time_point begin = Clock::now())
      : least_(least_bytes_a_second), begin_(begin) {}

  /// Bytes that have come. Throws ServiceError{kUploadTooSlow}.
  void count(std::uint64_t bytes, Clock::time_point now);

 private:
  std::uint64_t least_;
  Clock::time_point begin_;  // Of this while.
  std::uint64_t bytes_ = 0;  // In it.
};

}  // namespace ccslice::server
