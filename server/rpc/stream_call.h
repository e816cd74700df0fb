// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A call that answers with a stream: gRPC's callbacks on one side, a source of messages that never blocks on the other.
//
//     started on a worker -> pump -> StartWrite -> OnWriteDone -> pump -> ... -> Finish -> OnDone
//
// At any time at most one thread PUMPS: the worker that prepares the call, the thread of OnWriteDone, or whoever woke a
// call that had run dry. A write in flight counts as pumping, so the next message goes out only after OnWriteDone, and
// a reader that stalls stops the stream right there without holding a thread. Finish is called from the pump alone,
// exactly once.

#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <atomic>
#include <exception>
#include <memory>
#include <mutex>
#include <utility>

#include "server/rpc/call_log.h"
#include "server/rpc/service_state.h"
#include "server/rpc/status.h"

namespace ccslice::server {

template <class Response>
class StreamCall : public grpc::ServerWriteReactor<Response>,
                   public std::enable_shared_from_this<StreamCall<Response>> {
 public:
  /// Admits the call and begins it on a worker. The call keeps itself alive until gRPC is done with it.
  static grpc::ServerWriteReactor<Response>* begin(const std::shared_ptr<StreamCall>& call) {
    call->self_ = call;
    try {
      call->admission_ = call->state_.calls.admit([weak = std::weak_ptr(call)] {
        if (const auto open = weak.lock()) open->OnCancel();
      });
    } catch (...) {
      call->end(to_status(std::current_exception()));
      return call.get();
    }
    call->state_.executor.make_lane(call->preparation_).post([call] {
      call->prepare_guarded();
      call->pump_owned();
    });
    return call.get();
  }

 protected:
  enum class Next { kMessage, kPending, kEnd };

  StreamCall(ServiceState& state, grpc::CallbackServerContext& context, const char* method,
             Executor::Pieces preparation = Executor::Pieces::kShort)
      : state_(state), context_(context), log_(context, method), preparation_(preparation) {}

  /// On a worker, once, before anything else; as a long piece of work if the call said so. May throw.
  virtual void prepare() = 0;
  /// The next message, or kPending: then wake() follows. Never blocks. May throw.
  virtual Next next(Response& message) = 0;
  /// Stops the computing. Any thread, any number of times, also before prepare() is through.
  virtual void stop() = 0;

  /// There is something to pump, perhaps.
  void wake() {
    {
      std::lock_guard lock(mutex_);
      if (pumping_) {
        again_ = true;
        return;
      }
      pumping_ = true;
    }
    pump_owned();
  }

  bool stopped() const { return stopped_.load(); }

  ServiceState& state_;
  grpc::CallbackServerContext& context_;
  CallLog log_;

 private:
  void OnWriteDone(bool ok) override {
    if (!ok) stopped_ = true;  // The client is gone.
    pump_owned();
  }
  void OnCancel() override {
    stopped_ = true;
    stop();
    wake();
  }
  void OnDone() override { const std::shared_ptr<StreamCall> last = std::move(self_); }

  void prepare_guarded() {
    if (stopped()) return;
    try {
      prepare();
    } catch (...) {
      failure_ = std::current_exception();
    }
  }

  /// REQUIRES: this thread pumps.
  void pump_owned() {
    while (true) {
      if (stopped()) return end(stopped_status(state_.calls.cutting_off(), deadline_passed(context_)));
      switch (next_guarded()) {
        case Next::kMessage: this->StartWrite(&message_); return;
        case Next::kEnd: return end(failure_ ? to_status(failure_) : grpc::Status::OK);
        case Next::kPending: break;
      }
      std::lock_guard lock(mutex_);
      if (!again_) {
        pumping_ = false;
        return;
      }
      again_ = false;
    }
  }

  Next next_guarded() {
    if (failure_) return Next::kEnd;
    try {
      return next(message_);
    } catch (...) {
      failure_ = std::current_exception();
      return Next::kEnd;
    }
  }

  /// Nothing pumps any more after this.
  void end(const grpc::Status& status) {
    stop();
    admission_.end_run();
    log_.finish(status);
    this->Finish(status);
  }

  const Executor::Pieces preparation_;
  std::shared_ptr<StreamCall> self_;
  CallRegistry::Ticket admission_;
  Response message_;
  std::exception_ptr failure_;
  std::atomic<bool> stopped_{false};
  std::mutex mutex_;
  bool pumping_ = true;  // The preparing worker begins.
  bool again_ = false;   // Somebody woke the call while it was pumping.
};

}  // namespace ccslice::server
