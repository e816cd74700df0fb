// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What all calls that compute have in common. A call takes a place among the running ones, keeps itself alive until
// gRPC is done with it, and ends once, with a line in the log.
//
// Where it waits for its client, for a message or for one to be read, the idle watch bounds the wait. A client that
// doesn't read can't be sent a status in the ordinary way, as that would have to queue behind what isn't read: its
// stream is reset instead, with a status code and a message, which overtake.

#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <atomic>
#include <exception>
#include <memory>
#include <optional>
#include <utility>

#include "server/rpc/call_log.h"
#include "server/rpc/service_state.h"
#include "server/rpc/status.h"

namespace ccslice::server {

/// `Reactor` is grpc::ServerUnaryReactor or one of its streaming variants.
template <class Reactor>
class Call : public Reactor, public IdleCall, public std::enable_shared_from_this<Call<Reactor>> {
 protected:
  Call(ServiceState& state, grpc::CallbackServerContext& context, const char* method)
      : state_(state), context_(context), log_(context, method) {}

  /// MUST be called first, once. If there is no place for the call, returns why; then the caller ends the call with it.
  [[nodiscard]] std::optional<grpc::Status> admit() {
    self_ = this->shared_from_this();
    try {
      admission_ = state_.calls.admit([weak = this->weak_from_this()] {
        if (const auto open = weak.lock()) open->cut_off();
      });
    } catch (...) {
      return to_status(std::current_exception());
    }
    return std::nullopt;
  }

  /// Stops the computing. Any thread, any number of times.
  virtual void stop() {}

  /// Bounds the waits that follow. REQUIRES: admitted.
  void watch() { state_.idle_watch.add(self_); }
  /// `start` starts a read. The call may be over when this returns.
  template <class Start>
  void wait_for_message(const Start& start) {
    wait(/*for_reader=*/false, start);
  }
  /// `start` starts a write. The call may be over when this returns.
  template <class Start>
  void wait_for_reader(const Start& start) {
    wait(/*for_reader=*/true, start);
  }

  /// Why the call was stopped from outside.
  grpc::Status status_of_stop() const { return stopped_status(state_.calls.cutting_off(), deadline_passed(context_)); }

  /// Ends the call; to be called once. The call may be gone afterwards, unless gRPC owes it an OnReadDone or
  /// OnWriteDone.
  void end(const grpc::Status& status) {
    admission_.end_run();
    log_.finish(status);
    this->Finish(status);
  }

  ServiceState& state_;
  grpc::CallbackServerContext& context_;
  CallLog log_;

 private:
  void OnDone() override { const std::shared_ptr<Call> last = std::move(self_); }

  template <class Start>
  void wait(bool for_reader, const Start& start) {
    const auto self = this->shared_from_this();
    for_reader_ = for_reader;
    const WaitBegin begin = begin_wait();
    start();
    arm_wait(begin);
    if (state_.calls.cutting_off()) end_wait_for_message();
  }

  /// Ends the call when a shutdown cuts it off. gRPC ends the waits of a call that the client cancels; here the call
  /// has to end them itself.
  void cut_off() {
    this->OnCancel();
    end_wait_for_message();
  }

  /// A client that doesn't read can't be told why, see above.
  void end_wait_for_message() {
    if (!for_reader_ && end_armed_wait()) end(status_of_stop());
  }

  void idle() override {
    stop();
    const grpc::Status status = for_reader_ ? stalled_status() : idle_status();
    if (for_reader_) reset_stream(context_, status);
    end(status);
  }

  std::shared_ptr<Call> self_;
  CallRegistry::Ticket admission_;
  std::atomic<bool> for_reader_{false};  // The wait under way, or the last one.
};

}  // namespace ccslice::server
