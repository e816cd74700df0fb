// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/scheduling/idle_watch.h"

#include <algorithm>
#include <utility>

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

bool IdleCall::end_wait_begun_before(std::chrono::steady_clock::time_point time) {
  WaitBegin since = since_.load();
  if (since <= 0 || since >= time.time_since_epoch().count()) return false;
  if (!since_.compare_exchange_strong(since, kNotWaiting)) return false;
  idle();
  return true;
}

void IdleCall::note_wait_begun_before(std::chrono::steady_clock::time_point time) {
  const WaitBegin since = since_.load();
  if (since > 0 && since < time.time_since_epoch().count()) lag();
}

void IdleWatch::add(const std::shared_ptr<IdleCall>& call) {
  std::lock_guard lock(mutex_);
  calls_.push_back(call);
}

std::vector<std::shared_ptr<IdleCall>> IdleWatch::open_calls() {
  std::vector<std::shared_ptr<IdleCall>> open;
  const std::lock_guard lock(mutex_);
  std::erase_if(calls_, [&](const std::weak_ptr<IdleCall>& weak) {
    std::shared_ptr<IdleCall> call = weak.lock();
    if (call) open.push_back(std::move(call));
    return weak.expired();
  });
  return open;
}

void IdleWatch::sweep(bool in_need) {
  const std::vector<std::shared_ptr<IdleCall>> open = open_calls();
  const auto now = std::chrono::steady_clock::now();
  for (const auto& call : open) {
    if (patience_.count() > 0) (void)call->end_wait_begun_before(now - patience_);
    call->note_wait_begun_before(now - (in_need ? lag_.in_need : lag_.usual));
  }
}

std::size_t IdleWatch::end_longest(std::size_t most) {
  const std::vector<std::shared_ptr<IdleCall>> open = open_calls();
  const auto lagging_since = std::chrono::steady_clock::now() - lag_.in_need;
  std::vector<std::pair<std::int64_t, IdleCall*>> lagging;
  for (const auto& call : open) {
    const std::int64_t since = call->waits_since();
    if (since <= 0 || since >= lagging_since.time_since_epoch().count() || !call->keeps_message()) continue;
    lagging.emplace_back(since, call.get());
  }
  std::ranges::sort(lagging);
  if (lagging.size() > most) lagging.resize(most);
  std::size_t ended = 0;
  for (const auto& call : lagging) ended += call.second->end_wait_begun_before(lagging_since) ? 1 : 0;
  return ended;
}

}  // namespace ccslice::server
