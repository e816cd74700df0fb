// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Waits of a call beside the one that Call has: of a write, say, while a read is waited for as well.

#pragma once

#include <functional>
#include <memory>
#include <utility>

#include "server/service/scheduling/idle_watch.h"

namespace ccslice::server {

/// To be added to an IdleWatch.
class SideWatch final : public IdleCall {
 public:
  /// Called on the watch's thread, as idle() and lag() of a call are.
  SideWatch(std::function<void()> on_idle, std::function<void()> on_lag, bool keeps_message = false)
      : on_idle_(std::move(on_idle)), on_lag_(std::move(on_lag)), keeps_message_(keeps_message) {}

  /// Waits from the end of `start` on.
  template <typename Start>
  void start(const Start& start) {
    const WaitBegin wait = begin_wait();
    start();
    arm_wait(wait);
  }
  /// False if the wait has ended already.
  [[nodiscard]] bool end() { return end_wait(); }
  bool keeps_message() const override { return keeps_message_; }

 private:
  void idle() override { on_idle_(); }
  void lag() override { on_lag_(); }

  std::function<void()> on_idle_, on_lag_;
  const bool keeps_message_;
};

/// Does so to the call if it's still there.
template <typename Call>
std::function<void()> while_open(const std::shared_ptr<Call>& call, void (Call::*act)()) {
  return [weak = std::weak_ptr<Call>(call), act] {
    if (const auto open = weak.lock()) ((*open).*act)();
  };
}

}  // namespace ccslice::server
