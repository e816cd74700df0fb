// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Retries of a call: how often, after which pauses, and what else an attempt needs.

#pragma once

#include <chrono>
#include <random>

#include "client/client.h"

namespace ccslice::client {

/// Counts the attempts of one call and makes the pauses between them.
class Attempts {
 public:
  /// `channel` and `call` outlive this.
  Attempts(const RetryPolicy& policy, const CallOptions& call, grpc::ChannelInterface& channel)
      : policy_(policy), call_(call), channel_(channel) {}

  /// The call got somewhere: what failed before doesn't count any more.
  void progress() noexcept {
    used_ = reuploads_ = 0;
    connected_ = {};
  }
  /// The server has lost a mesh that is at hand. That isn't charged to the attempts, but throws `error` if it comes too
  /// often without progress.
  void count_reupload(const ClientError& error);
  /// One more attempt has failed: waits before the next one. Throws `error` if it was the last one allowed, if it won't
  /// pass, or if patience, which begins with the first failure, or the deadline end before.
  void pause_after(const ClientError& error);

 private:
  using Clock = std::chrono::system_clock;

  std::chrono::milliseconds next_pause(const ClientError& error);
  /// Throws `error` if the pause doesn't end before `end`.
  void pause_until(Clock::time_point then, Clock::time_point end, const ClientError& error) const;
  /// Sleeps, unless cancelled.
  void wait_for(std::chrono::milliseconds pause) const;
  /// Waits until somebody answers, but not beyond `end`. Whether somebody does.
  bool wait_for_connection(Clock::time_point end) const;

  const RetryPolicy policy_;
  const CallOptions& call_;
  grpc::ChannelInterface& channel_;
  Clock::time_point since_;      // The first failure since there was progress.
  Clock::time_point connected_;  // When somebody last answered who had been waited for, since there was progress.
  int used_ = 0;
  int reuploads_ = 0;
  std::minstd_rand random_{std::random_device{}()};
};

/// Runs `body` until it succeeds, as long as its errors pass. Where the server misses a mesh that we remember, it is
/// uploaded again before the next attempt.
template <typename Body>
auto Client::with_retries(const CallOptions& call, Attempts& attempts, int& reuploads, Body&& body) {
  std::shared_ptr<const MeshBytes> missing;
  for (;;) {
    try {
      if (missing) {
        upload_once(*missing, {}, call);
        missing = nullptr;
      }
      return body();
    } catch (const ClientError& error) {
      const std::shared_ptr<const MeshBytes> mesh = remembered(error.missing_mesh_id());
      if (mesh) {
        attempts.count_reupload(error);
        missing = mesh;
        ++reuploads;
      } else {
        attempts.pause_after(error);
      }
    }
  }
}

template <typename Body>
auto Client::with_retries(const CallOptions& call, Body&& body) {
  Attempts attempts(call.retry.value_or(retry_), call, *channel_);
  int reuploads = 0;
  return with_retries(call, attempts, reuploads, body);
}

}  // namespace ccslice::client
