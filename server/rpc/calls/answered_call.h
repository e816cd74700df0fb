// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A call that ends with one answer. An answer that nobody reads stays in the server's memory: so it counts among the
// calls that are open (call_registry.h) until it has been read, and where that takes too long the stream is reset.
//
// The wait for a reader is none of those that Call has. Whoever ends one of them ends the call too, and this one has
// its status already.

#pragma once

#include <cstdint>
#include <memory>
#include <mutex>

#include "server/rpc/calls/call.h"
#include "server/rpc/calls/side_watch.h"

namespace ccslice::server {

/// `Reactor` is grpc::ServerUnaryReactor or grpc::ServerReadReactor.
template <class Reactor>
class AnsweredCall : public Call<Reactor> {
 protected:
  using Call<Reactor>::Call;

  /// Ends the call; once, in place of end(). `answer_bytes`: of the response. A server that keeps too many unread ones
  /// already is busy. The call MUST keep no mesh in use from here on: where the cache needs room it isn't ended.
  void answer(const grpc::Status& status, std::uint64_t answer_bytes) {
    const auto self = this->shared_from_this();
    const bool fits = !status.ok() || this->hold_answer(answer_bytes);
    reader_watch_ = std::make_shared<SideWatch>(
        [this, weak = this->weak_from_this()] {
          if (const auto call = weak.lock()) drop_answer();
        },
        [] {}, /*keeps_message=*/true);
    this->state_.idle_watch.add(reader_watch_);
    const std::shared_ptr<SideWatch> watch = reader_watch_;
    watch->start([&] { this->end(fits ? status : to_status(too_many_unread())); });
  }

  void OnDone() override {
    const auto self = this->shared_from_this();
    if (reader_watch_) (void)reader_watch_->end();
    {
      const std::lock_guard lock(mutex_);
      is_done_ = true;
    }
    Call<Reactor>::OnDone();
  }

 private:
  static ServiceError too_many_unread() {
    return {ServiceErrorCode::kServerBusy,
            "as many answers are unread as the server has memory for: read them, then try again", kRetryDelay};
  }

  void drop_answer() {
    const std::lock_guard lock(mutex_);
    if (!is_done_) reset_stream(this->context_, stalled_status());
  }

  std::shared_ptr<SideWatch> reader_watch_;
  std::mutex mutex_;
  bool is_done_ = false;  // Then gRPC's context is gone.
};

}  // namespace ccslice::server
