// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Attempts of a call: which server gets it, who gets it next when that one fails, how often, after which pauses, and
// what else an attempt needs.

#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "client/client.h"
#include "client/endpoints.h"

namespace ccslice::client {

/// Counts the attempts of one call, each with all endpoints in turn, and makes the pauses between them.
class Attempts {
 public:
  /// `mesh_ids`: of the call; none stand for an empty one. `call` and `endpoints` outlive this. The order of the first
  /// mesh begins with its endpoint number `turn`.
  Attempts(const RetryPolicy& policy, const CallOptions& call, const Endpoints& endpoints,
           std::vector<std::string> mesh_ids, std::size_t turn = 0);

  const std::vector<std::string>& mesh_ids() const noexcept { return mesh_ids_; }

  /// Who gets the call now.
  const std::shared_ptr<const Endpoint>& endpoint() const noexcept { return endpoint_; }
  /// The call got somewhere: what failed before doesn't count any more.
  void progress() noexcept;
  /// The server has lost a mesh that is at hand. That isn't charged to the attempts, but throws `error`, with the
  /// remedy, if it comes too often of one endpoint without progress.
  void count_reupload(const ClientError& error);
  /// The endpoint has failed: another one gets the call, at once unless all have failed since the last pause. Throws
  /// what failed if this was the last attempt allowed, if it won't pass, or if patience, which begins with the first
  /// failure, or the deadline end before.
  void go_on_after(const ClientError& error);

 private:
  using Clock = std::chrono::system_clock;

  EndpointList order() const;
  /// Whether there is an endpoint that hasn't failed since the last pause. It gets the call.
  bool choose_untried();
  /// What has failed since the last pause, as one error.
  ClientError failures() const;
  void pause_after(const ClientError& error);
  /// Whether connections stand. Asks for them where they don't.
  bool anybody_connected() const;
  std::chrono::milliseconds next_pause(const ClientError& error);
  /// Throws `error` if the pause doesn't end before `end`.
  void pause_until(Clock::time_point then, Clock::time_point end, const ClientError& error) const;
  /// Sleeps, unless cancelled.
  void wait_for(std::chrono::milliseconds pause) const;
  /// Waits until somebody answers, but not beyond `end`. Whether somebody does.
  bool wait_for_connection(Clock::time_point end) const;

  const RetryPolicy policy_;
  const CallOptions& call_;
  const Endpoints& endpoints_;
  const std::vector<std::string> mesh_ids_;
  const std::size_t turn_;
  std::shared_ptr<const Endpoint> endpoint_;
  std::vector<std::pair<std::string, ClientError>> failed_;  // Addresses, since the last pause.
  Clock::time_point since_;                                  // The first failure since there was progress.
  Clock::time_point connected_;  // When somebody last answered who had been waited for, since there was progress.
  int used_ = 0;
  std::map<std::string, int> reuploads_;  // By address.
  std::minstd_rand random_{std::random_device{}()};
};

/// Runs `body(endpoint)` until it succeeds, as long as its errors pass. Where a server misses meshes that we remember,
/// they are uploaded there before the next attempt.
template <typename Body>
auto Client::with_retries(const CallOptions& call, Attempts& attempts, int& reuploads, Body&& body) {
  std::shared_ptr<const Endpoint> misses;
  for (;;) {
    try {
      if (misses && misses == attempts.endpoint()) upload_missing(*misses, attempts.mesh_ids(), call);
      misses = nullptr;
      return body(*attempts.endpoint());
    } catch (const ClientError& error) {
      if (remembered(error.missing_mesh_id())) {
        attempts.count_reupload(error);
        misses = attempts.endpoint();
        ++reuploads;
      } else {
        attempts.go_on_after(error);
      }
    }
  }
}

template <typename Body>
auto Client::with_retries(const CallOptions& call, const std::vector<std::string>& mesh_ids, Body&& body) {
  Attempts attempts(call.retry.value_or(retry_), call, *endpoints_, mesh_ids);
  int reuploads = 0;
  return with_retries(call, attempts, reuploads, body);
}

}  // namespace ccslice::client
