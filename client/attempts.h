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
  Attempts(const RetryPolicy& policy, const CallOptions& call) : policy_(policy), call_(call) {}

  /// The call got somewhere: what failed before doesn't count any more.
  void progress() noexcept { used_ = reuploads_ = 0; }
  /// The server has lost a mesh that is at hand. That isn't charged to the attempts, but throws `error` if it comes too
  /// often without progress.
  void count_reupload(const ClientError& error);
  /// One more attempt has failed: waits before the next one. Throws `error` if it was the last one allowed, if it won't
  /// pass, or if the deadline is too near.
  void pause_after(const ClientError& error);

 private:
  std::chrono::milliseconds next_pause(const ClientError& error);

  const RetryPolicy policy_;
  const CallOptions& call_;
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
  Attempts attempts(call.retry.value_or(retry_), call);
  int reuploads = 0;
  return with_retries(call, attempts, reuploads, body);
}

}  // namespace ccslice::client
