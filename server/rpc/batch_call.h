// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A call of many messages, BATCHES, each of which is answered by one message, in order.
//
// Reading goes on while batches are worked on, as far as the window reaches, and as many of them are worked on at the
// same time as there are threads and memory for. What a message sets holds for those after it, so that messages are
// accepted one by one; a batch takes with it what holds for it. Answers are written as soon as all before them are, and
// the first batch that fails ends the call in its turn: those before it are answered.
//
//     read -> accept -> begin -> (on a worker) answer -> write -> ...
//
// All but the answering happens under the call's mutex, in go_on(), whoever comes there. A call waits for a message if
// there are no batches, for its reader while a write is under way, and else for a place or for its own workers.
//
// Most of the time such a call does nothing. So it has a place among the running ones only while there is a batch to be
// computed, and asks for another one when the next batch has come. Where its client doesn't read for a while it SHEDS:
// it begins no batch until the client reads on, and gives back what it holds for that.

#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "server/rpc/call.h"
#include "server/rpc/unknown_fields.h"

namespace ccslice::server {

/// `Solver`, of one thread at a time, has the types Request, Response and Setting, and
///
///     Solver(MeshPtr);
///     static void accept(const Request&, const LimitSolid&, const SliceLimits&, Setting&);   // Throws.
///     void answer(const Setting&, const Request&, Response&, const CancellationToken&);      // Throws.
///     static constexpr std::uint64_t kBytes;                                                 // What it holds, about.
///
/// An answer follows from its batch and its setting, whichever solver gives it.
template <class Solver>
class BatchCall final : public Call<grpc::ServerBidiReactor<grpc::ByteBuffer, typename Solver::Response>> {
  using Base = Call<grpc::ServerBidiReactor<grpc::ByteBuffer, typename Solver::Response>>;

 public:
  BatchCall(ServiceState& state, grpc::CallbackServerContext& context, const char* method)
      : Base(state, context, method),
        most_solvers_(std::min(kMostSolvers, state.executor.threads())),
        lane_(this->make_lane(Pieces::kInteractive)),
        share_(state.scratch) {}

  /// From here on the call keeps itself alive until gRPC is done with it.
  void begin() {
    if (const auto refused = this->open_call()) return this->end(*refused);
    this->watch();
    std::unique_lock lock(mutex_);
    go_on(lock);
  }

 private:
  static constexpr std::size_t kMostSolvers = 8;
  static constexpr std::size_t kBatchesAhead = 2;  // Read beside those that are worked on.

  struct Batch {
    typename Solver::Request request;
    typename Solver::Response response;
    typename Solver::Setting setting;
    std::exception_ptr failure;
    bool is_begun = false, is_done = false;
  };
  using BatchPtr = std::shared_ptr<Batch>;
  using SolverPtr = std::shared_ptr<Solver>;
  using Clock = std::chrono::steady_clock;
  enum class Has { kNoPlace, kAskedForPlace, kPlace };

  // What follows down to the workers' part holds the mutex.

  /// Does what there is to be done. May unlock: last.
  void go_on(std::unique_lock<std::mutex>& lock) {
    if (is_over_) return;
    const bool answered = !batches_.empty() && batches_.front()->is_done;
    if (!is_writing_) {
      if (answered && batches_.front()->failure) return fail_call(lock, batches_.front()->failure);
      if (cancel_.cancelled()) return finish(lock, this->status_of_stop());
      if (batches_.empty() && reads_done_) return finish(lock, grpc::Status::OK);
      if (batches_.empty()) return wait_for_batch();
      if (answered) {
        is_writing_ = true;
        this->wait_for_reader([this] { this->StartWrite(&batches_.front()->response); });
      }
    }
    if (cancel_.cancelled()) return;
    begin_batches();
    read_on();
    if (working_ > 0 || has_ == Has::kAskedForPlace) return;
    const bool has_work = !has_shed_ && has_batch_to_begin();
    if (has_work && has_ == Has::kNoPlace) return ask_for_place(lock);
    if (!has_work) give_place_back();
  }

  void wait_for_batch() {
    give_place_back();
    is_waiting_ = true;
    this->wait_for_message([this] { read_on(); });
  }

  /// Until the mesh is known, one message is enough, and while it can't be worked on.
  void read_on() {
    const std::size_t window = mesh_ ? most_solvers_ + kBatchesAhead : 1;
    if (is_reading_ || reads_done_ || batches_.size() >= window) return;
    if (has_shed_ || (has_ != Has::kPlace && has_batch_to_begin())) return;
    is_reading_ = true;
    this->StartRead(&raw_);
  }

  /// Those behind one that failed aren't worth it.
  bool has_batch_to_begin() const {
    for (const BatchPtr& batch : batches_) {
      if (batch->failure) return false;
      if (!batch->is_begun) return true;
    }
    return false;
  }

  /// Not while the lock is held: the place may be there at once.
  void ask_for_place(std::unique_lock<std::mutex>& lock) {
    has_ = Has::kAskedForPlace;
    lock.unlock();
    Base::ask_for_place(
        [this, self = this->shared_from_this(), since = Clock::now()](const std::exception_ptr& refusal) {
          std::unique_lock held(mutex_);
          take_place(held, refusal, Clock::now() - since);
        });
    if (cancel_.cancelled()) leave_queue();  // Cancelled before there was anything to leave.
  }

  void take_place(std::unique_lock<std::mutex>& lock, const std::exception_ptr& refusal, Clock::duration waited) {
    has_ = refusal ? Has::kNoPlace : Has::kPlace;
    if (is_over_) return give_place_back();
    if (!refusal && !std::exchange(had_place_, true)) log_.note_place(waited);
    if (refusal) {
      const auto first = std::ranges::find_if(batches_, [](const BatchPtr& batch) { return !batch->is_begun; });
      fail(**first, refusal);
    }
    go_on(lock);
  }

  void give_place_back() {
    if (has_ != Has::kPlace) return;
    has_ = Has::kNoPlace;
    Base::give_place_back();
  }

  void begin_batches() {
    if (has_ != Has::kPlace || has_shed_) return;
    for (const BatchPtr& batch : batches_) {
      if (batch->failure) return;
      if (batch->is_begun) continue;
      if (idle_solvers_.empty() && !may_add_solver()) return;
      SolverPtr solver;  // None yet: it is made on the worker.
      if (idle_solvers_.empty()) {
        ++solvers_;
      } else {
        solver = std::move(idle_solvers_.back());
        idle_solvers_.pop_back();
      }
      batch->is_begun = true;
      ++working_;
      lane_.post([this, self = this->shared_from_this(), batch, solver] { work(batch, solver); });
    }
  }

  /// One solver is always there, as it is for calls that have but one thread.
  bool may_add_solver() {
    if (solvers_ == 0) return true;
    return mesh_ && solvers_ < most_solvers_ && share_.resize(solvers_ * Solver::kBytes);
  }

  /// Takes them off the count; what they occupied is given back when the result goes, which MUST be without the lock.
  [[nodiscard]] MemoryBudget::Share forget_solvers(std::size_t count) {
    solvers_ -= count;
    return share_.split_off_beyond(solvers_ > 1 ? (solvers_ - 1) * Solver::kBytes : 0);
  }

  void accept(Batch& batch) {
    if (!batch.request.mesh_id().empty() && batch.request.mesh_id() != mesh_->id()) {
      throw ServiceError(ServiceErrorCode::kRequestMalformed,
                         "mesh_id changes within the call: make another call for another mesh", "mesh_id");
    }
    Solver::accept(batch.request, *mesh_->solid(), state_.slice_limits, setting_);
    batch.setting = setting_;
  }

  /// The message that was read, as the last batch.
  void take_message() {
    const auto batch = std::make_shared<Batch>();
    batches_.push_back(batch);
    try {
      parse_request(raw_, batch->request);
      require_known_fields(batch->request);
      if (mesh_) accept(*batch);
    } catch (...) {
      fail(*batch, std::current_exception());
    }
  }

  /// Nothing after it counts.
  void fail(Batch& batch, const std::exception_ptr& failure) {
    batch.failure = failure;
    batch.is_begun = batch.is_done = true;
    reads_done_ = true;
  }

  grpc::Status status_of(const std::exception_ptr& failure) const {
    return cancel_.cancelled() ? this->status_of_stop() : to_status(failure);
  }

  void fail_call(std::unique_lock<std::mutex>& lock, const std::exception_ptr& failure) {
    this->add_pushback(failure);
    finish(lock, status_of(failure));
  }

  void finish(std::unique_lock<std::mutex>& lock, const grpc::Status& status) {
    is_over_ = true;
    cancel_.cancel();  // For batches that are worked on.
    lock.unlock();
    this->end(status);
  }

  void OnReadDone(bool ok) override {
    const auto self = this->shared_from_this();
    std::unique_lock lock(mutex_);
    is_reading_ = false;
    if (is_over_) return;
    if (is_waiting_) {
      if (!this->end_wait()) return;
      is_waiting_ = false;
    }
    if (!ok) reads_done_ = true;
    if (!reads_done_) take_message();
    go_on(lock);
  }

  void OnWriteDone(bool ok) override {
    const auto self = this->shared_from_this();
    std::unique_lock lock(mutex_);
    if (!this->end_wait() || is_over_) return;
    is_writing_ = has_shed_ = false;
    if (!ok) return finish(lock, this->status_of_stop());
    batches_.pop_front();
    go_on(lock);
  }

  void OnCancel() override {
    const auto self = this->shared_from_this();
    stop();
    leave_queue();
  }

  /// A call that waits for its place does nothing else that would come to an end.
  void leave_queue() {
    if (!this->leave_place_queue()) return;
    std::unique_lock lock(mutex_);
    has_ = Has::kNoPlace;
    go_on(lock);
  }

  void stop() override {
    cancel_.cancel();
    this->stop_loading();
  }

  void shed() override {
    std::vector<SolverPtr> dropped;
    MemoryBudget::Share freed;
    const std::lock_guard lock(mutex_);
    dropped = std::move(idle_solvers_);
    idle_solvers_.clear();
    freed = forget_solvers(dropped.size());
    if (is_over_ || !is_writing_) return;
    has_shed_ = true;
    if (working_ == 0) give_place_back();
  }

  // On workers, without the mutex.

  void work(const BatchPtr& batch, const SolverPtr& solver) {
    if (mesh_) return answer(batch, solver, nullptr);
    // The call's first batch, and its only one until the mesh is there.
    this->with_mesh(lane_, batch->request.mesh_id(), [this, batch](const MeshPtr& mesh, std::exception_ptr error) {
      try {
        if (error) std::rethrow_exception(error);
        const std::lock_guard lock(mutex_);
        mesh_ = mesh;
        if (!is_over_) log_.note_mesh(mesh->id());
        accept(*batch);
        if (!is_over_ && !cancel_.cancelled()) read_on();
      } catch (...) {
        error = std::current_exception();
      }
      answer(batch, nullptr, error);
    });
    if (cancel_.cancelled()) this->stop_loading();  // Cancelled before there was anything to stop.
  }

  void answer(const BatchPtr& batch, SolverPtr solver, std::exception_ptr failure) {
    try {
      if (failure) std::rethrow_exception(failure);
      cancel_.throw_if_cancelled();
      if (!solver) solver = std::make_shared<Solver>(mesh_);
      solver->answer(batch->setting, batch->request, batch->response, cancel_);
    } catch (...) {
      failure = std::current_exception();
    }
    MemoryBudget::Share freed;
    SolverPtr dropped;
    std::unique_lock lock(mutex_);
    --working_;
    if (failure) {
      fail(*batch, failure);
    } else {
      batch->is_done = true;
    }
    if (solver && !is_over_ && (solvers_ == 1 || !state_.admission.wants_memory())) {
      idle_solvers_.push_back(std::move(solver));
    } else {
      dropped = std::move(solver);
      freed = forget_solvers(1);
    }
    go_on(lock);
  }

  const std::size_t most_solvers_;
  Executor::Lane lane_;
  const CancellationToken cancel_ = Executor::make_token();

  std::mutex mutex_;  // Guards what follows.
  bool is_over_ = false, is_waiting_ = false, is_reading_ = false, is_writing_ = false, reads_done_ = false;
  bool has_shed_ = false;  // The client hasn't read for a while.
  Has has_ = Has::kNoPlace;
  bool had_place_ = false;
  grpc::ByteBuffer raw_;  // The read's.
  MeshPtr mesh_;          // Once there, it stays.
  typename Solver::Setting setting_;
  std::deque<BatchPtr> batches_;  // Neither failed nor answered yet.
  std::size_t working_ = 0;       // Of those, that workers have.
  std::vector<SolverPtr> idle_solvers_;
  std::size_t solvers_ = 0;    // Those at work included.
  MemoryBudget::Share share_;  // For all of them but one.
  using Base::log_;
  using Base::state_;
};

}  // namespace ccslice::server
