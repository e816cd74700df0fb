// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What all calls that compute have in common. A call takes a place among the running ones, or waits for one, keeps
// itself alive until gRPC is done with it, and ends once, with a line in the log.
//
// Where it waits for its client, for a message or for one to be read, the idle watch bounds the wait. A client that
// doesn't read can't be sent a status in the ordinary way, as that would have to queue behind what isn't read: its
// stream is reset instead, with a status code and a message, which overtake.

#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/rpc/calls/call_log.h"
#include "server/rpc/calls/caller.h"
#include "server/rpc/calls/load_mesh.h"
#include "server/rpc/calls/raw_request.h"
#include "server/rpc/calls/service_state.h"
#include "server/rpc/convert/status.h"
#include "server/service/base/service_error.h"

namespace ccslice::server {

/// `Reactor` is grpc::ServerUnaryReactor or one of its streaming variants.
template <class Reactor>
class Call : public Reactor, public IdleCall, public std::enable_shared_from_this<Call<Reactor>> {
 protected:
  Call(ServiceState& state, grpc::CallbackServerContext& context, const char* method)
      : state_(state),
        context_(context),
        log_(context, method, state.metrics),
        caller_(caller_of(state.access, context, method)),
        client_(caller_.identity.client),
        place_(state.admission, client_),
        request_bytes_(state.requests, client_) {
    log_.set_client(client_);
  }

  /// MUST be called first, once. If the server takes no more calls, returns why; then the caller ends the call with it.
  [[nodiscard]] std::optional<grpc::Status> open_call() {
    self_ = this->shared_from_this();
    try {
      if (caller_.refusal) std::rethrow_exception(caller_.refusal);
      if (is_limited()) client_share_ = state_.client_calls.open(caller_.identity);
      ticket_ = state_.calls.open_call(
          [weak = this->weak_from_this()] {
            if (const auto open = weak.lock()) open->cut_off();
          },
          client_,
          [weak = this->weak_from_this()] {
            if (const auto open = weak.lock()) open->check_caller();
          });
    } catch (...) {
      return to_status(std::current_exception());
    }
    return std::nullopt;
  }

  /// Counts a request among the bytes that the server has received for as long as the call lives. If there is no room
  /// for it, or it is too large, returns why.
  [[nodiscard]] std::optional<grpc::Status> hold_request(const grpc::ByteBuffer& request,
                                                         const google::protobuf::Descriptor& type) {
    try {
      require_request_size(request, type);
      hold_request_bytes(request.Length());
    } catch (...) {
      return to_status(std::current_exception());
    }
    return std::nullopt;
  }

  /// Counts so many bytes of requests, in place of those before: for a call that keeps something of them. Throws
  /// ServiceError{kServerBusy}.
  void hold_request_bytes(std::uint64_t bytes) {
    if (request_bytes_.resize(bytes)) return;
    throw ServiceError(ServiceErrorCode::kServerBusy,
                       "too many bytes of requests at once, in all or of one client: try again later");
  }

  /// Once the request has been taken to pieces nothing of it is needed any more: a call may last for hours.
  void drop_request(const grpc::ByteBuffer& request) {
    const_cast<grpc::ByteBuffer&>(request).Clear();  // gRPC keeps it until the call is done, and hands it out as const.
    (void)request_bytes_.resize(0);
  }

  /// `begin` runs once there is a place for the call, on this thread or another one. Where there is none, or the call
  /// is stopped before there is one, refuse() ends the call. Once.
  template <class Begin>
  void when_admitted(Begin begin, bool is_long = false) {
    const auto decided = [self = this->shared_from_this(), begin](const std::exception_ptr& refusal) {
      self->log_.note_wait(Awaited::kPlace, self->log_.elapsed());
      if (!refusal) return begin();
      self->refuse(to_status(refusal));
    };
    state_.admission.request(place_, decided, is_long);
  }
  /// For a call that does nothing most of the time: a place for what there is to do now, and for that alone.
  void ask_for_place(Admission::Decision decided) {
    state_.admission.request(place_, std::move(decided), /*is_long=*/false, how_to_give_way());
  }
  /// Memory for a call that runs, for one that shed its own, and for one that gave way: admission.h. `decided` keeps
  /// the call alive.
  void ask_for_memory(Admission::Memory memory, Admission::Decision decided) {
    state_.admission.request_memory(place_, std::move(memory), noting(Awaited::kMemory, std::move(decided)));
  }
  void resume(Admission::Memory memory, Admission::Decision decided) {
    state_.admission.resume(place_, std::move(memory), noting(Awaited::kMemory, std::move(decided)));
  }
  void wait_again(Admission::Memory memory, Admission::Decision decided) {
    state_.admission.wait_again(place_, std::move(memory), noting(Awaited::kMemory, std::move(decided)));
  }
  /// `decided`, and a note of how long it was waited for.
  Admission::Decision noting(Awaited awaited, Admission::Decision decided) {
    return [self = this->shared_from_this(), awaited, decided = std::move(decided),
            since = std::chrono::steady_clock::now()](const std::exception_ptr& refusal) {
      self->log_.note_wait(awaited, std::chrono::steady_clock::now() - since);
      decided(refusal);
    };
  }
  /// Stops waiting for memory.
  void leave_memory_queue() { state_.admission.leave_memory_queue(place_); }
  /// Whether the call was waiting, for a place or for memory. Then `decided` never runs.
  [[nodiscard]] bool leave_queue() {
    return state_.admission.leave_queue(place_) || state_.admission.leave_memory_queue(place_);
  }
  void give_place_back() { state_.admission.give_back(place_); }

  /// From here on the call may keep them. Several count as the first one does, with the bytes of all.
  void note_meshes(const std::vector<MeshPtr>& meshes) {
    std::uint64_t bytes = 0;
    for (auto mesh = meshes.begin(); mesh != meshes.end(); ++mesh) {
      if (std::find(meshes.begin(), mesh, *mesh) == mesh) bytes += (*mesh)->prepared().memory_bytes;
    }
    kept_bytes_ = bytes;
    kept_mesh_ = meshes.front().get();
  }

  /// `then` runs once with the meshes, in the order of the ids, or with why there are none: now if the cache holds all,
  /// else in the lane when they have come from the store. While they come, which may take minutes, others may have the
  /// call's place if `place` says so; then the call asks for one again, and may be refused.
  enum class WhileMeshComes { kKeepsPlace, kHasNoPlace };
  template <class Then>
  void with_meshes(const Executor::Lane& lane, const std::vector<std::string>& mesh_ids, Then then,
                   WhileMeshComes place = WhileMeshComes::kKeepsPlace) {
    const std::vector<MeshPtr> none;
    std::vector<MeshPtr> meshes;
    try {
      meshes = find_meshes(state_, mesh_ids);
    } catch (...) {
      return then(none, std::current_exception());
    }
    if (!meshes.empty()) {
      note_meshes(meshes);
      return then(meshes, std::exception_ptr());
    }
    const bool asks_again = place == WhileMeshComes::kHasNoPlace;
    if (asks_again) give_place_back();
    const auto load = std::make_shared<MeshSetLoad>(
        state_, mesh_ids, client_,
        [lane, then, asks_again, self = this->shared_from_this()](const std::vector<MeshPtr>& loaded,
                                                                  const std::exception_ptr& error) {
          const auto go_on = [lane, then, self, loaded, error](const std::exception_ptr& refusal) {
            lane.post([then, self, loaded, error, refusal] {
              refusal ? then(std::vector<MeshPtr>(), refusal) : then(loaded, error);
            });
          };
          if (!loaded.empty()) self->note_meshes(loaded);
          if (error || !asks_again) return go_on(nullptr);
          self->ask_for_place(self->noting(Awaited::kPlace, go_on));
          // Stopped just when there was no longer anything to stop, and nothing to leave yet.
          if (self->stopped_loading_ && self->state_.admission.leave_queue(self->place_)) {
            go_on(std::make_exception_ptr(Error(ErrorCode::kCancelled, "")));
          }
        });
    {
      const std::lock_guard lock(load_mutex_);
      load_ = load;
    }
    load->begin();
  }
  /// The same of one mesh; null in place of none.
  template <class Then>
  void with_mesh(const Executor::Lane& lane, const std::string& mesh_id, Then then,
                 WhileMeshComes place = WhileMeshComes::kKeepsPlace) {
    with_meshes(
        lane, {mesh_id},
        [then](const std::vector<MeshPtr>& meshes, const std::exception_ptr& error) {
          then(meshes.empty() ? MeshPtr() : meshes.front(), error);
        },
        place);
  }
  /// For whoever stops the call: it doesn't wait for a mesh any longer.
  void stop_loading() {
    stopped_loading_ = true;
    std::shared_ptr<MeshSetLoad> load;
    {
      const std::lock_guard lock(load_mutex_);
      load = load_;
    }
    if (load) load->cancel();
  }

  /// How to have such a call give way before it has asked for memory: Admission::Memory::give_way.
  virtual std::function<void()> how_to_give_way() { return {}; }
  /// Counts an answer among what is open until the call is over. False if there is no room for it.
  [[nodiscard]] bool hold_answer(std::uint64_t bytes) { return ticket_.hold(bytes); }
  /// Whether the call counts among those of its client that may be open at the same time.
  virtual bool is_limited() const { return true; }
  virtual void refuse(const grpc::Status& status) { end(status); }
  /// For whoever stops the call: if it was still waiting for its place, it ends here.
  bool end_if_waiting() {
    const auto self = this->shared_from_this();
    if (!state_.admission.leave_queue(place_)) return false;
    refuse(status_of_stop());
    return true;
  }

  /// A lane for the work of this call. Work that goes on after its end, which gRPC's context and request don't outlive,
  /// leaves them alone.
  Executor::Lane make_lane(Pieces pieces) const { return state_.executor.make_lane(client_, pieces); }

  /// Stops the computing. Any thread, any number of times.
  virtual void stop() {}
  /// The client hasn't read for a while, or sent anything: what the call holds is given back as far as it can be had
  /// again. On the watch's thread; the client may go on at the same time.
  virtual void shed() {}

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
  grpc::Status status_of_stop() const {
    return lost_ ? to_status(refusal_) : stopped_status(state_.calls.cutting_off(), deadline_passed(context_));
  }

  /// Ends the call; to be called once. The call may be gone afterwards, unless gRPC owes it an OnReadDone or
  /// OnWriteDone.
  void end(const grpc::Status& status) {
    state_.admission.give_back(place_);  // Before the client knows: it may call again at once.
    client_share_ = {};
    log_.finish(status);
    add_pushback(context_, status);
    this->Finish(status);
  }

  void OnDone() override { const std::shared_ptr<Call> last = std::move(self_); }

  ServiceState& state_;
  grpc::CallbackServerContext& context_;
  CallLog log_;
  const Caller caller_;
  const std::string client_;  // Who makes the call: those who share time with each other.

 private:
  template <class Start>
  void wait(bool for_reader, const Start& start) {
    const auto self = this->shared_from_this();
    for_reader_ = for_reader;
    const WaitBegin begin = begin_wait();
    start();
    arm_wait(begin);
    if (state_.calls.cutting_off() || lost_) end_wait_for_message();
  }

  /// Ends the call when a shutdown cuts it off. gRPC ends the waits of a call that the client cancels; here the call
  /// has to end them itself.
  void cut_off() {
    const auto self = this->shared_from_this();
    this->OnCancel();
    end_wait_for_message();
  }

  /// Ends the call if its client may not make it any more.
  void check_caller() {
    if (lost_) return;
    refusal_ = refusal_by_now(state_.access, caller_, log_.method());
    if (!refusal_) return;
    lost_ = true;
    cut_off();
  }

  KeptMesh kept_mesh() const override { return {kept_mesh_, kept_bytes_, client_}; }

  /// A client that doesn't read can't be told why, see above. A shutdown cancels such calls anyway.
  void end_wait_for_message() {
    if ((for_reader_ && !lost_) || !end_armed_wait()) return;
    const grpc::Status status = status_of_stop();
    if (for_reader_) reset_stream(context_, status);
    end(status);
  }

  bool keeps_message() const override { return for_reader_; }
  void idle() override {
    stop();
    const grpc::Status status = for_reader_ ? stalled_status() : idle_status();
    if (for_reader_) reset_stream(context_, status);
    end(status);
  }

  void lag() override { shed(); }

  std::shared_ptr<Call> self_;
  CallRegistry::Ticket ticket_;
  Admission::Place place_;
  MemoryBudget::Share request_bytes_;
  ClientCalls::Share client_share_;
  std::mutex load_mutex_;
  std::shared_ptr<MeshSetLoad> load_;
  std::atomic<bool> stopped_loading_{false};
  std::exception_ptr refusal_;           // Why its client may not make it any more:
  std::atomic<bool> lost_{false};        // it is there.
  std::atomic<bool> for_reader_{false};  // The wait under way, or the last one.
  std::atomic<const void*> kept_mesh_{nullptr};
  std::atomic<std::uint64_t> kept_bytes_{0};
};

}  // namespace ccslice::server
