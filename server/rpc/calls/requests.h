// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What several calls check of their requests.

#pragma once

#include <cstdint>
#include <string>

#include "server/service/base/limits.h"
#include "server/service/base/service_error.h"

namespace ccslice::server {

/// Throws ServiceError{kChunkSizeInvalid}.
inline std::uint32_t chunk_bytes_or_default(std::uint32_t max_chunk_bytes) {
  if (max_chunk_bytes == 0) return kDefaultChunkBytes;
  if (max_chunk_bytes >= kMinChunkBytes && max_chunk_bytes <= kMaxChunkBytes) return max_chunk_bytes;
  throw ServiceError(ServiceErrorCode::kChunkSizeInvalid,
                     "max_chunk_bytes: " + std::to_string(max_chunk_bytes) + " is outside " +
                         std::to_string(kMinChunkBytes) + " to " + std::to_string(kMaxChunkBytes) + "; 0 takes " +
                         std::to_string(kDefaultChunkBytes),
                     "max_chunk_bytes");
}

inline ServiceError stream_memory_used_up() {
  return ServiceError(ServiceErrorCode::kServerBusy,
                      "other calls hold all memory for layers and triangles: read their answers, or try again later");
}

}  // namespace ccslice::server
