// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Cooperative cancellation. Work polls the token at least every few milliseconds (per few hundred voxels, per few
// thousand items of a mesh); a cancelled piece of work throws Error{kCancelled} and leaves nothing half-made behind.
//
// A poll is also where work may GIVE WAY: whoever made the token may let other work go first on this processor, and the
// poll returns when the work's turn comes again. So nobody polls with a lock held that others wait for.

#pragma once

#include <atomic>
#include <memory>

#include "core/base/error.h"

namespace ccslice {

/// Copyable, thread-safe handle. A default-constructed token never cancels.
class CancellationToken {
 public:
  CancellationToken() = default;

  /// Called at every poll, on the thread that polls. Cheap where there is nothing to give way to.
  using GiveWay = void (*)() noexcept;

  static CancellationToken make(GiveWay give_way = nullptr) {
    CancellationToken token;
    token.state_ = std::make_shared<State>();
    token.state_->give_way = give_way;
    return token;
  }

  /// REQUIRES: made by make().
  void cancel() const noexcept { state_->cancelled.store(true, std::memory_order_relaxed); }
  bool cancelled() const noexcept { return state_ && state_->cancelled.load(std::memory_order_relaxed); }
  void throw_if_cancelled() const {
    if (state_ && state_->give_way != nullptr) state_->give_way();
    if (cancelled()) throw Error(ErrorCode::kCancelled, "cancelled by the caller or by its deadline");
  }

 private:
  struct State {
    std::atomic<bool> cancelled{false};
    GiveWay give_way = nullptr;
  };
  std::shared_ptr<State> state_;
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
