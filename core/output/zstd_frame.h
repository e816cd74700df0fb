// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// One zstd frame, level 1, with its content size: a reader can allocate before it decodes.

#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/base/cancellation.h"

struct ZSTD_CCtx_s;

namespace ccslice {

enum class MatchSearch : std::uint8_t {
  kFull,
  kNone,  // Entropy coding alone, for noise: what matches by chance isn't worth the search.
};

/// One thread's encoder: keeps zstd's context and scratch memory from frame to frame.
class ZstdEncoder {
 public:
  /// Polls `cancel` every megabyte or so. Throws Error{kCancelled, kInternal}.
  [[nodiscard]] std::vector<std::uint8_t> frame(std::span<const std::uint8_t> bytes, const CancellationToken& cancel,
                                                MatchSearch search = MatchSearch::kFull);

 private:
  struct FreeContext {
    void operator()(ZSTD_CCtx_s* context) const;
  };

  std::unique_ptr<ZSTD_CCtx_s, FreeContext> context_;
  std::vector<std::uint8_t> scratch_;
};

}  // namespace ccslice
