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

/// One thread's encoder: keeps zstd's context and scratch memory from frame to frame.
class ZstdEncoder {
 public:
  /// Polls `cancel` every megabyte or so. Throws Error{kCancelled, kInternal}.
  [[nodiscard]] std::vector<std::uint8_t> frame(std::span<const std::uint8_t> bytes, const CancellationToken& cancel);

 private:
  struct FreeContext {
    void operator()(ZSTD_CCtx_s* context) const;
  };

  std::unique_ptr<ZSTD_CCtx_s, FreeContext> context_;
  std::vector<std::uint8_t> scratch_;
};

}  // namespace ccslice
