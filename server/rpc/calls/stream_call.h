// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A call that answers with a stream: gRPC's callbacks on one side, a source of messages that never blocks on the other.
//
//     started on a worker -> pump -> StartWrite -> OnWriteDone -> pump -> ... -> Finish -> OnDone
//
// At any time at most one thread PUMPS: the worker that prepares the call, the thread of OnWriteDone, or whoever woke a
// call that had run dry. A write in flight counts as pumping, so the next message goes out only after OnWriteDone, and
// a reader that stalls stops the stream right there without holding a thread, until the idle watch loses patience with
// it. Finish is called from the pump, or from the watch in its place, exactly once.

#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "server/rpc/calls/call.h"

namespace ccslice::server {

template <class Response>
class StreamCall : public Call<grpc::ServerWriteReactor<Response>> {
  using Base = Call<grpc::ServerWriteReactor<Response>>;

 public:
  /// Begins the call on a worker, once there is a place for it. The call keeps itself alive until gRPC is done with it.
  static grpc::ServerWriteReactor<Response>* begin(const std::shared_ptr<StreamCall>& call) {
    StreamCall* const reactor = call.get();
    auto refused = call->open_call();
    if (!refused) refused = call->hold_request(call->raw_request(), call->request_type());
    if (refused) {
      call->end(*refused);
      return reactor;
    }
    call->watch();
    call->when_admitted([reactor] {
      const Executor::Lane lane = reactor->make_lane(reactor->preparation_);
      lane.post([call = reactor->shared_from_this(), reactor, lane] { reactor->find_meshes_and_prepare(lane); });
    });
    return reactor;
  }

 protected:
  enum class Next { kMessage, kPending, kEnd };

  StreamCall(ServiceState& state, grpc::CallbackServerContext& context, const char* method,
             Pieces preparation = Pieces::kInteractive)
      : Base(state, context, method), preparation_(preparation) {}

  /// What the client sent. Dropped when the call is prepared.
  virtual const grpc::ByteBuffer& raw_request() const = 0;
  virtual const google::protobuf::Descriptor& request_type() const = 0;
  /// Parses the request; the ids of its meshes. On a worker, in a lane of the pieces that the call said. May throw.
  virtual std::vector<std::string> parse() = 0;
  /// Gives back what parse() made of the request, which may be far more than its bytes: these are counted. While the
  /// meshes come it isn't needed; it is parsed again then.
  virtual void forget() = 0;
  /// Once the meshes are there, and parsed again: the rest that comes before the first message. As parse().
  virtual void prepare(const std::vector<MeshPtr>& meshes) = 0;
  /// The next message, or kPending: then wake() follows. Never blocks. May throw.
  virtual Next next(Response& message) = 0;
  /// May be called before prepare() has ended, too.
  void stop() override = 0;

  /// Says that there may be something to pump.
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

  using Base::log_;
  using Base::state_;

 private:
  void OnWriteDone(bool ok) override {
    if (!this->end_wait()) return;
    if (!ok) stopped_ = true;  // The client is gone.
    pump_owned();
  }
  void OnCancel() override {
    stopped_ = true;
    stop();
    this->stop_loading();
    if (!this->end_if_waiting()) wake();
  }

  void find_meshes_and_prepare(const Executor::Lane& lane) {
    std::vector<std::string> mesh_ids;
    try {
      if (!stopped()) mesh_ids = parse();
      is_parsed_ =
          std::ranges::all_of(mesh_ids, [this](const std::string& id) { return state_.cache.peek(id).has_value(); });
      if (!is_parsed_) forget();
    } catch (...) {
      failure_ = std::current_exception();
    }
    if (stopped() || failure_) return pump_owned();
    this->with_meshes(
        lane, mesh_ids,
        [this](const std::vector<MeshPtr>& meshes, const std::exception_ptr& error) {
          failure_ = error;
          prepare_guarded(meshes);
          this->drop_request(raw_request());
          pump_owned();
        },
        Base::WhileMeshComes::kHasNoPlace);
    if (stopped()) this->stop_loading();  // Stopped before there was anything to stop.
  }

  void prepare_guarded(const std::vector<MeshPtr>& meshes) {
    if (stopped() || failure_) return;
    try {
      if (!is_parsed_) (void)parse();
      prepare(meshes);
      forget();
    } catch (...) {
      failure_ = std::current_exception();
    }
  }

  /// REQUIRES: this thread pumps.
  void pump_owned() {
    while (true) {
      if (stopped()) return stop_and_end(this->status_of_stop());
      switch (next_guarded()) {
        case Next::kMessage: return this->wait_for_reader([this] { this->StartWrite(&message_); });
        case Next::kEnd: return stop_and_end(failure_ ? to_status(failure_) : grpc::Status::OK);
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
  void stop_and_end(const grpc::Status& status) {
    stop();
    this->end(status);
  }

  const Pieces preparation_;
  Response message_;
  std::exception_ptr failure_;
  bool is_parsed_ = false;  // While the mesh comes, if that takes time, nothing is.
  std::atomic<bool> stopped_{false};
  std::mutex mutex_;
  bool pumping_ = true;  // The preparing worker begins.
  bool again_ = false;   // Somebody woke the call while it was pumping.
};

}  // namespace ccslice::server
