// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// How another thread stops calls of the client.

#pragma once

#include <grpcpp/client_context.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <set>

namespace ccslice::client {

/// Stops calls from another thread: running ones are cancelled, waiting ones wake up, later ones fail at once, all with
/// ClientError{CANCELLED, CANCELLED_HERE}. Must outlive the calls that use it. Not for use in signal handlers.
class Cancellation {
 public:
  void cancel();
  bool cancelled() const;
  /// Sleeps, unless cancelled. True if cancelled.
  bool wait_for(std::chrono::milliseconds duration) const;

  /// Makes a call cancellable as long as the scope lasts. `cancellation` may be null.
  class [[nodiscard]] Scope {
   public:
    Scope(Cancellation* cancellation, grpc::ClientContext& context);
    ~Scope();
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    Cancellation* const cancellation_;
    grpc::ClientContext& context_;
  };

 private:
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  bool cancelled_ = false;
  std::set<grpc::ClientContext*> running_;
};

}  // namespace ccslice::client
