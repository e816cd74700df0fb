// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/scheduling/work_queue.h"

#include <algorithm>
#include <utility>

namespace ccslice::server {
namespace {

template <class Entry>
void move_to_back(std::vector<Entry>& entries, const Entry& entry) {
  const auto at = std::find(entries.begin(), entries.end(), entry);
  std::rotate(at, at + 1, entries.end());
}

}  // namespace

void WorkQueue::push(const CallPtr& call, Item item, Place place) {
  enter(call);
  call->items.insert(place == Place::kFront ? call->items.begin() : call->items.end(), std::move(item));
  ++size_;
}

/// Does nothing for an active call.
void WorkQueue::enter(const CallPtr& call) {
  if (call->account != nullptr) return;
  Class& work = class_of(*call);
  if (work.active.empty()) level_.enter(work.share);
  Client& client = work.clients[call->client];
  if (client.active.empty()) {
    work.level.enter(client.share);
    work.active.push_back(&client);
  }
  client.level.enter(call->share);
  client.active.push_back(call);
  call->account = &client;
}

void WorkQueue::leave_if_done(const CallPtr& call) {
  if (call->share.running > 0 || !call->items.empty()) return;
  Class& work = class_of(*call);
  Client& client = *std::exchange(call->account, nullptr);
  client.level.leave();
  std::erase(client.active, call);
  if (!client.active.empty()) return;
  work.level.leave();
  std::erase(work.active, &client);
  if (work.active.empty()) level_.leave();
  std::erase_if(work.clients, [&](const auto& entry) {
    const Client& known = entry.second;
    return known.active.empty() && (work.active.empty() || work.level.is_even(known.share));
  });
}

bool WorkQueue::is_ready(const Call& call) const {
  if (call.items.empty()) return false;
  return call.pieces != Pieces::kLong || call.items.front().parked != nullptr || may_begin_long(*call.account);
}

bool WorkQueue::may_begin_long(const Client& client) const {
  if (begun_long_ < max_long_) return true;
  return client.begun_long == 0 && begun_long_ < max_long_ + kLongOfOthers;
}

WorkQueue::CallPtr WorkQueue::next_of(const Client& client) const {
  CallPtr next;
  for (const CallPtr& call : client.active) {
    if (is_ready(*call) && (!next || call->share.had() < next->share.had())) next = call;
  }
  return next;
}

WorkQueue::Client* WorkQueue::next_client_of(const Class& work) const {
  Client* next = nullptr;
  for (Client* const client : work.active) {
    if (next != nullptr && client->share.had() >= next->share.had()) continue;
    if (next_of(*client)) next = client;
  }
  return next;
}

std::optional<WorkQueue::Taken> WorkQueue::take(bool interactive_only) {
  Class& interactive = classes_.front();
  Class& rest = classes_.back();
  Class* work = &interactive;
  Client* client = next_client_of(interactive);
  if (!interactive_only && (client == nullptr || rest.share.had() < interactive.share.had())) {
    if (Client* const other = next_client_of(rest)) {
      work = &rest;
      client = other;
    }
  }
  if (client == nullptr) return std::nullopt;
  CallPtr call = next_of(*client);
  move_to_back(client->active, call);
  move_to_back(work->active, client);
  Item item = std::move(call->items.front());
  call->items.pop_front();
  --size_;
  count_running(*call, +1);
  if (call->pieces == Pieces::kLong && item.parked == nullptr) count_begun_long(*call, +1);
  return Taken{std::move(call), std::move(item)};
}

/// REQUIRES: the call is active.
void WorkQueue::count_running(Call& call, int change) {
  for (FairShare* const share : {&call.share, &call.account->share, &class_of(call).share}) share->running += change;
}

/// REQUIRES: the call is active.
void WorkQueue::count_begun_long(Call& call, int change) {
  for (std::size_t* const begun : {&call.account->begun_long, &begun_long_}) *begun += change;
}

void WorkQueue::charge(Call& call, std::chrono::nanoseconds time) {
  Class& work = class_of(call);
  call.account->level.charge(call.share, time);
  work.level.charge(call.account->share, time);
  level_.charge(work.share, time);
}

void WorkQueue::end(const CallPtr& call) {
  count_running(*call, -1);
  if (call->pieces == Pieces::kLong) count_begun_long(*call, -1);
  leave_if_done(call);
}

void WorkQueue::park(const CallPtr& call, Worker& worker) {
  count_running(*call, -1);
  push(call, {.work = nullptr, .parked = &worker}, Place::kFront);
}

}  // namespace ccslice::server
