// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A call that is answered once. An answer that nobody reads stays in the server's memory: so it counts among the calls
// that are open (call_registry.h) until it has been read, and where that takes too long the stream is reset.

#pragma once

#include <grpcpp/support/server_callback.h>

#include <cstdint>
#include <mutex>

#include "server/rpc/call.h"

namespace ccslice::server {

class UnaryCall : public Call<grpc::ServerUnaryReactor> {
 protected:
  using Call::Call;

  /// Ends the call; once, in place of end(). `answer_bytes`: of the response. A server that keeps too many unread ones
  /// already is busy.
  void answer(const grpc::Status& status, std::uint64_t answer_bytes) {
    const auto self = shared_from_this();
    const bool fits = !status.ok() || hold_answer(answer_bytes);
    watch();
    wait_for_reader([&] { end(fits ? status : to_status(too_many_unread())); });
  }

  /// May throw. The request's bytes count nowhere, and a call may wait for a mesh, or for its answer's reader.
  template <class Request>
  void parse_and_drop(const grpc::ByteBuffer& raw, Request& request) {
    try {
      parse_request(raw, request);
    } catch (...) {
      drop_request(raw);
      throw;
    }
    drop_request(raw);
  }

 private:
  static ServiceError too_many_unread() {
    return {ServiceErrorCode::kServerBusy,
            "as many answers are unread as the server has memory for: read them, then try again", kRetryDelay};
  }

  void idle() override {
    const std::lock_guard lock(mutex_);
    if (!is_done_) reset_stream(context_, stalled_status());
  }

  void OnDone() override {
    const auto self = shared_from_this();
    (void)end_wait();
    {
      const std::lock_guard lock(mutex_);
      is_done_ = true;
    }
    Call::OnDone();
  }

  std::mutex mutex_;
  bool is_done_ = false;  // Then gRPC's context is gone.
};

}  // namespace ccslice::server
