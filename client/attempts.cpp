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
  if (!error.is_passing() || ++used_ >= policy_.max_attempts) throw error;
  const std::chrono::milliseconds pause = next_pause(error);
  if (call_.deadline && std::chrono::system_clock::now() + pause >= *call_.deadline) throw error;
  if (!call_.cancellation) {
    std::this_thread::sleep_for(pause);
  } else if (call_.cancellation->wait_for(pause)) {
    throw_cancelled_here();
  }
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
