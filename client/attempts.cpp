// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/attempts.h"

#include <algorithm>
#include <thread>

#include "client/call.h"

namespace ccslice::client {

void Attempts::count_reupload(const ClientError& error) {
  constexpr int kMostInARow = 3;  // A server that keeps losing what it has just taken.
  if (++reuploads_ > kMostInARow) throw error;
}

void Attempts::pause_after(const ClientError& error) {
  if (used_ == 0) since_ = Clock::now();
  if (!error.is_passing() || ++used_ == policy_.max_attempts) throw error;
  Clock::time_point end = since_ + policy_.patience;
  if (call_.deadline) end = std::min(end, *call_.deadline);
  // Where nobody answers, whoever comes back is used at once. A connection that stands while calls fail is a proxy's.
  const bool nobody = error.code() == grpc::StatusCode::UNAVAILABLE && error.reason().empty() &&
                      channel_.GetState(/*try_to_connect=*/true) != GRPC_CHANNEL_READY;
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

void Attempts::pause_until(Clock::time_point then, Clock::time_point end, const ClientError& error) const {
  const auto pause = std::chrono::duration_cast<std::chrono::milliseconds>(then - Clock::now());
  if (pause.count() <= 0) return;
  if (then >= end) throw error;
  wait_for(pause);
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
    if (channel_.WaitForConnected(std::min(end, Clock::now() + kLook))) return true;
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
