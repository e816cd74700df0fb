// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/attempts.h"

#include <algorithm>
#include <cstddef>
#include <thread>

#include "client/call.h"

namespace ccslice::client {

Attempts::Attempts(const RetryPolicy& policy, const CallOptions& call, const Endpoints& endpoints,
                   std::vector<std::string> mesh_ids, std::size_t turn)
    : policy_(policy), call_(call), endpoints_(endpoints), mesh_ids_(std::move(mesh_ids)), turn_(turn) {
  endpoint_ = order().front();
}

EndpointList Attempts::order() const {
  EndpointList endpoints = endpoints_.in_order(mesh_ids_.empty() ? "" : mesh_ids_.front());
  const auto first = endpoints.begin() + static_cast<std::ptrdiff_t>(turn_ % endpoints.size());
  std::rotate(endpoints.begin(), first, endpoints.end());
  return endpoints;
}

void Attempts::progress() noexcept {
  used_ = 0;
  failed_.clear();
  reuploads_.clear();
  connected_ = {};
}

void Attempts::count_reupload(const ClientError& error) {
  constexpr int kMostInARow = 3;  // A server that keeps losing what it has just taken, or several behind one address.
  if (++reuploads_[endpoint_->address] <= kMostInARow) return;
  // No mesh is named as missing, or callers would upload it once more.
  throw ClientError(error.code(), error.reason(),
                    endpoint_->address + " was given the mesh " + std::to_string(kMostInARow) +
                        " times and doesn't hold it: if that is a proxy before several servers, have it choose one by "
                        "the header ccslice-mesh-id, or give the servers a common --mesh-store");
}

bool Attempts::choose_untried() {
  const EndpointList endpoints = order();
  // A name that stands for other servers at each look has always one that is untried.
  if (failed_.size() > endpoints.size() && Clock::now() >= since_ + policy_.patience) return false;
  for (const std::shared_ptr<const Endpoint>& endpoint : endpoints) {
    const auto is_it = [&](const auto& failed) { return failed.first == endpoint->address; };
    if (std::ranges::any_of(failed_, is_it)) continue;
    endpoint_ = endpoint;
    return true;
  }
  return false;
}

ClientError Attempts::failures() const {
  if (failed_.size() == 1) return failed_.front().second;
  // What won't pass isn't waited for. Who answers, if only to refuse, says more than who doesn't.
  const auto rank = [](const ClientError& error) { return error.is_passing() + error.reason().empty(); };
  const ClientError* telling = &failed_.front().second;
  std::string message = "none of " + std::to_string(failed_.size()) + " servers took the call";
  for (const auto& [address, error] : failed_) {
    if (rank(error) < rank(*telling)) telling = &error;
    message += (&error == &failed_.front().second ? ": " : "; ") + address + ": " + error.what();
  }
  return {*telling, message};
}

void Attempts::go_on_after(const ClientError& error) {
  // Another server may hold a mesh that isn't at hand, and be of the engine of the layers so far.
  const bool elsewhere = !error.missing_mesh_id().empty() || error.reason() == local_reason::kEngineMixed;
  if (!error.is_passing() && !elsewhere) throw error;
  if (used_ == 0 && failed_.empty()) since_ = Clock::now();
  failed_.emplace_back(endpoint_->address, error);
  endpoints_.look_up_soon();
  if (choose_untried()) return;
  const ClientError all = failures();
  if (!all.is_passing() || ++used_ == policy_.max_attempts) throw all;
  pause_after(all);
  failed_.clear();
  endpoint_ = order().front();
}

void Attempts::pause_after(const ClientError& error) {
  Clock::time_point end = since_ + policy_.patience;
  if (call_.deadline) end = std::min(end, *call_.deadline);
  // Where nobody answers, whoever comes back is used at once. A connection that stands while calls fail is a proxy's.
  const bool nobody = error.code() == grpc::StatusCode::UNAVAILABLE && error.reason().empty() && !anybody_connected();
  const std::chrono::milliseconds pause = next_pause(error);
  if (!nobody) return pause_until(Clock::now() + pause, end, error);
  pause_until(connected_ + pause, end, error);    // Who answers, and drops each call, isn't called without a pause.
  const bool counted = policy_.max_attempts > 0;  // Then each one has its turn, whether somebody answers or not.
  if (wait_for_connection(counted ? std::min(end, Clock::now() + pause) : end)) {
    connected_ = Clock::now();
  } else if (Clock::now() >= end) {
    throw error;
  }
}

bool Attempts::anybody_connected() const {
  bool connected = false;
  for (const std::shared_ptr<const Endpoint>& endpoint : order()) {
    connected |= endpoint->channel->GetState(/*try_to_connect=*/true) == GRPC_CHANNEL_READY;
  }
  return connected;
}

void Attempts::pause_until(Clock::time_point then, Clock::time_point end, const ClientError& error) const {
  const Clock::time_point now = Clock::now();
  if (std::max(then, now) >= end) throw error;
  if (then > now) wait_for(std::chrono::ceil<std::chrono::milliseconds>(then - now));
}

void Attempts::wait_for(std::chrono::milliseconds pause) const {
  if (!call_.cancellation) {
    std::this_thread::sleep_for(pause);
  } else if (call_.cancellation->wait_for(pause)) {
    throw_cancelled_here();
  }
}

bool Attempts::wait_for_connection(Clock::time_point end) const {
  constexpr std::chrono::milliseconds kLook(50);  // How often to look whether the call is cancelled.
  while (Clock::now() < end) {
    if (call_.cancellation && call_.cancellation->cancelled()) throw_cancelled_here();
    endpoints_.look_up_soon();
    const EndpointList endpoints = order();
    for (const std::shared_ptr<const Endpoint>& endpoint : endpoints) {
      const auto look = kLook / static_cast<int>(endpoints.size());
      if (endpoint->channel->WaitForConnected(std::min(end, Clock::now() + look))) return true;
    }
  }
  return false;
}

/// Between three and five quarters of the nominal pause, so that the clients of a server that comes back don't all call
/// at the same moment.
std::chrono::milliseconds Attempts::next_pause(const ClientError& error) {
  constexpr int kMostDoublings = 20;
  const double doubled = static_cast<double>(policy_.first_pause.count()) * (1 << std::min(used_ - 1, kMostDoublings));
  const double nominal = std::min(doubled, static_cast<double>(policy_.longest_pause.count()));
  std::uniform_real_distribution<double> spread(0.75, 1.25);
  const std::chrono::milliseconds pause(static_cast<std::chrono::milliseconds::rep>(nominal * spread(random_)));
  return std::max(pause, error.retry_delay().value_or(std::chrono::milliseconds(0)));
}

}  // namespace ccslice::client
