// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/idle_watch.h"

namespace ccslice::server {

IdleCall::WaitBegin IdleCall::begin_wait() {
  const WaitBegin now = std::chrono::steady_clock::now().time_since_epoch().count();
  since_.store(-now);
  return now;
}

void IdleCall::arm_wait(WaitBegin wait) {
  WaitBegin unarmed = -wait;
  since_.compare_exchange_strong(unarmed, wait);
}

bool IdleCall::end_armed_wait() {
  WaitBegin since = since_.load();
  return since > 0 && since_.compare_exchange_strong(since, kNotWaiting);
}

void IdleCall::end_wait_begun_before(std::chrono::steady_clock::time_point time) {
  WaitBegin since = since_.load();
  if (since <= 0 || since >= time.time_since_epoch().count()) return;
  if (since_.compare_exchange_strong(since, kNotWaiting)) idle();
}

void IdleCall::note_wait_begun_before(std::chrono::steady_clock::time_point time) {
  const WaitBegin since = since_.load();
  if (since > 0 && since < time.time_since_epoch().count()) lag();
}

void IdleWatch::add(const std::shared_ptr<IdleCall>& call) {
  std::lock_guard lock(mutex_);
  calls_.push_back(call);
}

void IdleWatch::sweep(bool in_need) {
  std::vector<std::shared_ptr<IdleCall>> open;
  {
    std::lock_guard lock(mutex_);
    std::erase_if(calls_, [&](const std::weak_ptr<IdleCall>& weak) {
      std::shared_ptr<IdleCall> call = weak.lock();
      if (call) open.push_back(std::move(call));
      return weak.expired();
    });
  }
  const auto now = std::chrono::steady_clock::now();
  for (const auto& call : open) {
    if (patience_.count() > 0) call->end_wait_begun_before(now - patience_);
    call->note_wait_begun_before(now - (in_need ? lag_.in_need : lag_.usual));
  }
}

}  // namespace ccslice::server
