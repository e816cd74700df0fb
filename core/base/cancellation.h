// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Cooperative cancellation. Work polls the token at least every few milliseconds (per few hundred voxels, per few
// thousand items of a mesh); a cancelled piece of work throws Error{kCancelled} and leaves nothing half-made behind.

#pragma once

#include <atomic>
#include <memory>

#include "core/base/error.h"

namespace ccslice {

/// Copyable, thread-safe handle. A default-constructed token never cancels.
class CancellationToken {
 public:
  CancellationToken() = default;

  static CancellationToken make() {
    CancellationToken token;
    token.flag_ = std::make_shared<std::atomic<bool>>(false);
    return token;
  }

  /// REQUIRES: made by make().
  void cancel() const noexcept { flag_->store(true, std::memory_order_relaxed); }
  bool cancelled() const noexcept { return flag_ && flag_->load(std::memory_order_relaxed); }
  void throw_if_cancelled() const {
    if (cancelled()) throw Error(ErrorCode::kCancelled, "cancelled by the caller or by its deadline");
  }

 private:
  std::shared_ptr<std::atomic<bool>> flag_;
};

/// Polls a token once every `period` calls: for loops whose steps take well below a microsecond.
class PeriodicPoll {
 public:
  explicit PeriodicPoll(const CancellationToken& token, unsigned period = 4096) : token_(token), period_(period) {}

  void operator()() {
    if (++count_ % period_ == 0) token_.throw_if_cancelled();
  }

 private:
  const CancellationToken& token_;
  unsigned period_;
  unsigned count_ = 0;
};

}  // namespace ccslice
