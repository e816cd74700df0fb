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
//     read -> (on a worker) parse -> accept -> begin -> (on a worker) answer -> write -> ...
//
// All but parsing and answering happens under the call's mutex, in go_on(), whoever comes there. A call waits for a
// message if there are no batches, for its reader while a write is under way, and else for a place or for its own
// workers.
//
// Most of the time such a call does nothing. So it has a place among the running ones only while there is a batch to be
// computed, and asks for another one when the next batch has come. Where its client doesn't read for a while it SHEDS:
// it begins no batch until the client reads on, and gives back all but the answer that is being sent, which counts
// nowhere, and the requests behind. Their answers are computed anew, to the same bytes.
//
// A batch of hard points takes minutes. So the call GIVES WAY (admission.h): it stops the batches that are worked on,
// gives back its place and their memory, and begins them anew in its client's next turn, as a long call.
//
// Batches and solvers hold memory for scratch. What is read ahead, and each solver beside the first, needs room before;
// one batch at a time can go on always, or waits for memory: while others wait for some, it does so for each batch.
// Whoever has several batches worked on leaves others some of it.

#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "server/rpc/calls/call.h"
#include "server/rpc/calls/solver_benches.h"
#include "server/rpc/calls/unknown_fields.h"
#include "server/service/base/limits.h"

namespace ccslice::server {

/// `Solver`, of one thread at a time, has the types Request, Response and Setting, and
///
///     Solver(MeshPtr);
///     static std::vector<std::string> volume_ids(const Request&);                            // Throws.
///     static void accept(const Request&, const std::shared_ptr<const LimitSolid>&, const Volumes&,
///                        const SliceLimits&, Setting&);                                      // Throws.
///     void answer(const Setting&, const Request&, Response&, const CancellationToken&);      // Throws.
///     static constexpr std::uint64_t kBytes;                                                 // What it holds, about.
///     static std::size_t points(const Request&);
///     static std::uint64_t answer_bytes(std::size_t points, std::size_t channels, const Setting&);
///
/// An answer follows from its batch and its setting, whichever solver gives it.
template <class Solver>
class BatchCall final : public Call<grpc::ServerBidiReactor<grpc::ByteBuffer, typename Solver::Response>> {
  using Base = Call<grpc::ServerBidiReactor<grpc::ByteBuffer, typename Solver::Response>>;

 public:
  BatchCall(ServiceState& state, grpc::CallbackServerContext& context, const char* method)
      : Base(state, context, method),
        lane_(this->make_lane(Pieces::kInteractive)),
        benches_(state.scratch, std::min(kMostSolvers, state.executor.threads())),
        read_share_(state.scratch) {}

  /// From here on the call keeps itself alive until gRPC is done with it.
  void begin() {
    if (const auto refused = this->open_call()) return this->end(*refused);
    this->watch();
    Hold hold(mutex_);
    go_on(hold);
  }

 private:
  static constexpr std::size_t kMostSolvers = 8;
  static constexpr std::size_t kBatchesAhead = 2;  // Read beside those that are worked on.

  struct Batch {
    explicit Batch(MemoryBudget& scratch) : share(scratch) {}

    MemoryBudget::Share share;  // For its request and its answer. Goes after them.
    grpc::ByteBuffer raw;       // Until it is accepted, then the request.
    typename Solver::Request request;
    typename Solver::Response response;
    typename Solver::Setting setting;
    std::exception_ptr failure;
    bool is_accepted = false, is_begun = false, is_done = false;
  };
  using BatchPtr = std::shared_ptr<Batch>;
  using Bench = typename SolverBenches<Solver>::Bench;
  using BenchPtr = typename SolverBenches<Solver>::BenchPtr;
  using Clock = std::chrono::steady_clock;
  enum class Has { kNoPlace, kAskedForPlace, kAskedForMemory, kPlace };

  /// The call's mutex, held. What the call has no use for any more goes when it isn't any longer: whoever waits for
  /// that memory may begin on this thread.
  struct Hold {
    explicit Hold(std::mutex& mutex) : lock(mutex) {}

    std::vector<MemoryBudget::Share> shares;
    std::vector<BenchPtr> benches;
    BatchPtr batch;
    std::unique_lock<std::mutex> lock;  // Goes first.
  };

  // What follows down to the workers' part holds the mutex.

  /// Does what there is to be done. May unlock: last.
  void go_on(Hold& hold) {
    if (is_over_) return;
    const bool answered = !batches_.empty() && batches_.front()->is_done;
    if (!is_writing_) {
      if (answered && batches_.front()->failure) return finish(hold, status_of(batches_.front()->failure));
      if (cancel_.cancelled()) return finish(hold, this->status_of_stop());
      if (batches_.empty() && reads_done_) return finish(hold, grpc::Status::OK);
      if (batches_.empty()) return wait_for_batch(hold);
      if (answered) write();
    }
    if (cancel_.cancelled()) return;
    if (gives_way_ && working_ == 0) stop_for_others(hold);
    begin_batches();
    read_on();
    if (working_ > 0 || has_ == Has::kAskedForPlace || has_ == Has::kAskedForMemory) return;
    const BatchPtr next = has_shed_ ? nullptr : batch_to_begin();
    if (!next) return give_place_back();
    if (has_ == Has::kPlace || resumes_ || gave_way_) return ask_for_memory(hold, next);
    ask_for_place(hold);
  }

  void wait_for_batch(Hold& hold) {
    give_place_back();
    hold.shares.push_back(read_share_.split_off_beyond(0));
    is_waiting_ = true;
    this->wait_for_message([this] { read_on(); });
  }

  /// Sends the first batch, whose request isn't needed any more.
  void write() {
    Batch& first = *batches_.front();
    first.request = typename Solver::Request();
    is_writing_ = true;
    this->wait_for_reader([this, &first] { this->StartWrite(&first.response); });
  }

  /// Until the mesh is known, one message is enough, and while it can't be worked on. What is read ahead has room; one
  /// alone waits for it when it has come.
  void read_on() {
    const std::size_t window = mesh_ ? benches_.most() + kBatchesAhead : 1;
    if (is_reading_ || reads_done_ || batches_.size() >= window) return;
    if (has_shed_ || (has_ != Has::kPlace && batch_to_begin())) return;
    if (!batches_.empty() && (others_wait() || !read_share_.resize(largest_batch_bytes()))) return;
    is_reading_ = true;
    this->StartRead(&raw_);
  }

  bool others_wait() const { return state_.admission.wants_memory(); }

  /// No budget is too small for one batch and one solver.
  std::uint64_t within_half(std::uint64_t bytes) const { return std::min(bytes, state_.scratch.capacity_bytes() / 2); }
  std::size_t channels() const { return mesh_->solid()->channel_count(); }
  std::uint64_t largest_batch_bytes() const {
    return within_half(Solver::answer_bytes(kMaxPointsPerMessage, channels(), setting_) + kMaxRequestBytes);
  }
  std::uint64_t bytes_of(const Batch& batch) const {
    if (!batch.is_accepted) return largest_batch_bytes();
    const std::size_t points = std::min<std::size_t>(Solver::points(batch.request), kMaxPointsPerMessage);
    return within_half(Solver::answer_bytes(points, channels(), batch.setting) + batch.request.SpaceUsedLong());
  }

  /// The first batch that isn't begun. Nothing, if one before it has failed: the call ends with that.
  BatchPtr batch_to_begin() const {
    for (const BatchPtr& batch : batches_) {
      if (batch->failure) return nullptr;
      if (!batch->is_begun) return batch;
    }
    return nullptr;
  }

  /// Not while the lock is held: the place may be there at once.
  void ask_for_place(Hold& hold) {
    has_ = Has::kAskedForPlace;
    hold.lock.unlock();
    Base::ask_for_place(
        [this, self = this->shared_from_this(), since = Clock::now()](const std::exception_ptr& refusal) {
          Hold held(mutex_);
          if (!is_over_ && !std::exchange(had_place_, true)) log_.note_wait(Awaited::kPlace, Clock::now() - since);
          decided(held, refusal);
        });
    if (cancel_.cancelled()) leave_queue();  // Cancelled before there was anything to leave.
  }

  /// For one batch and a solver, likewise; after the call has shed or given way, for a place too. Whoever waits holds
  /// nothing that others could wait for.
  void ask_for_memory(Hold& hold, const BatchPtr& batch) {
    const bool has_place = has_ == Has::kPlace;
    has_ = Has::kAskedForMemory;
    benches_.move_idle_to(hold.benches);
    hold.shares.push_back(read_share_.split_off_beyond(0));
    for (const BatchPtr& read : batches_) {
      if (!read->is_begun) hold.shares.push_back(read->share.split_off_beyond(0));
    }
    const BenchPtr bench = benches_.take();
    const std::uint64_t bytes = bytes_of(*batch), left = bytes_left(bytes);
    const bool gave_way = gave_way_;
    hold.lock.unlock();
    hold.benches.clear();
    hold.shares.clear();
    Admission::Memory memory{
        .reserve = [this, on = batch.get(), at = bench.get(), bytes, left] { return reserve(*on, *at, bytes, left); },
        .is_short = !gave_way && left == 0,  // Else short ones would wait behind it for what it leaves them.
        .give_way = how_to_give_way()};
    const auto got_it = [this, self = this->shared_from_this(), batch, bench](const std::exception_ptr& refusal) {
      Hold held(mutex_);
      if (refusal) {
        held.benches.push_back(bench);
        benches_.note_gone();
      } else if (!is_over_) {
        batch->is_accepted ? begin(batch, bench) : benches_.put_back(bench);
      }
      decided(held, refusal);
    };
    if (has_place) {
      Base::ask_for_memory(std::move(memory), got_it);
    } else if (gave_way) {
      this->wait_again(std::move(memory), got_it);
    } else {
      this->resume(std::move(memory), got_it);
    }
    if (cancel_.cancelled()) leave_queue();
  }

  /// Both or nothing. Nobody else has anything to do with them at that time.
  bool reserve(Batch& batch, Bench& bench, std::uint64_t batch_bytes, std::uint64_t left_bytes) const {
    const std::uint64_t before = batch.share.bytes();
    if (!batch.share.resize(std::max(before, batch_bytes), left_bytes)) return false;
    if (bench.share.resize(within_half(Solver::kBytes), left_bytes)) return true;
    (void)batch.share.resize(before);
    return false;
  }

  /// To a small range of another client, where several of this one's calls have begun, or several batches of this one:
  /// half of what short work has. Else it would have to wait for one of them to give way. Nothing where the batch could
  /// never begin then.
  std::uint64_t bytes_left(std::uint64_t batch_bytes) const {
    constexpr std::size_t kSeveral = 4;
    if (working_ == 0 && state_.admission.begun_of(this->client_) < kSeveral) return 0;
    const std::uint64_t all = state_.scratch.capacity_bytes();
    return std::min(scratch_for_short(all) / 2, all - batch_bytes - within_half(Solver::kBytes));
  }

  std::function<void()> how_to_give_way() override {
    return [weak = this->weak_from_this()] {
      if (const auto call = weak.lock()) static_cast<BatchCall&>(*call).give_way();
    };
  }

  /// Once the workers have noticed.
  void stop_for_others(Hold& hold) {
    gives_way_ = false;
    gave_way_ = true;
    work_cancel_ = Executor::make_token();
    benches_.move_idle_to(hold.benches);
    give_place_back();
  }

  /// There is a place, and memory if that was asked for; or none.
  void decided(Hold& hold, const std::exception_ptr& refusal) {
    has_ = Has::kPlace;
    if (is_over_ || refusal) give_place_back();
    if (is_over_) return;
    resumes_ = has_shed_;
    gave_way_ = false;
    if (refusal) fail(*batch_to_begin(), refusal);
    go_on(hold);
  }

  void give_place_back() {
    if (has_ != Has::kPlace) return;
    has_ = Has::kNoPlace;
    Base::give_place_back();
  }

  void begin_batches() {
    if (has_ != Has::kPlace || has_shed_ || gives_way_) return;
    for (const BatchPtr& batch : batches_) {
      if (batch->failure || is_taking_) return;
      if (batch->is_begun) continue;
      if (!batch->is_accepted) return take_later(batch);
      if (!benches_.has_idle() && (benches_.are_all_made() || others_wait())) return;
      if (batch->share.bytes() == 0 && others_wait()) return;
      const BenchPtr bench = benches_.take();
      const std::uint64_t bytes = bytes_of(*batch);
      if (!reserve(*batch, *bench, bytes, bytes_left(bytes))) return benches_.put_back(bench);
      begin(batch, bench);
    }
  }

  void begin(const BatchPtr& batch, const BenchPtr& bench) {
    batch->is_begun = true;
    ++working_;
    lane_.post(
        [this, self = this->shared_from_this(), batch, bench, cancel = work_cancel_] { answer(batch, bench, cancel); });
  }

  /// One after the other: what a message sets holds for those after it.
  void take_later(const BatchPtr& batch) {
    batch->is_begun = is_taking_ = true;
    ++working_;
    lane_.post([this, self = this->shared_from_this(), batch] { take(batch); });
  }

  void accept(Batch& batch, const Volumes& volumes) {
    if (!batch.request.mesh_id().empty() && batch.request.mesh_id() != mesh_->id()) {
      throw ServiceError(ServiceErrorCode::kRequestMalformed,
                         "mesh_id changes within the call: make another call for another mesh", "mesh_id");
    }
    Solver::accept(batch.request, mesh_->solid(), volumes, state_.slice_limits, setting_);
    batch.setting = setting_;
    batch.is_accepted = true;
  }

  /// The message that was read, as the last batch.
  void keep_message() {
    const auto batch = std::make_shared<Batch>(state_.scratch);
    std::swap(batch->share, read_share_);
    batch->raw.Swap(&raw_);
    batches_.push_back(batch);
  }

  /// Nothing after it counts.
  void fail(Batch& batch, const std::exception_ptr& failure) {
    batch.failure = failure;
    batch.is_begun = batch.is_done = true;
    batch.raw.Clear();
    batch.request = typename Solver::Request();
    reads_done_ = true;
  }

  grpc::Status status_of(const std::exception_ptr& failure) const {
    return cancel_.cancelled() ? this->status_of_stop() : to_status(failure);
  }

  void finish(Hold& hold, const grpc::Status& status) {
    is_over_ = true;
    cancel_.cancel();
    work_cancel_.cancel();
    hold.lock.unlock();
    this->end(status);
  }

  void OnReadDone(bool ok) override {
    const auto self = this->shared_from_this();
    Hold hold(mutex_);
    is_reading_ = false;
    if (is_over_) return;
    if (is_waiting_) {
      if (!this->end_wait()) return;
      is_waiting_ = false;
    }
    if (!ok) reads_done_ = true;
    if (!reads_done_) keep_message();
    go_on(hold);
  }

  void OnWriteDone(bool ok) override {
    const auto self = this->shared_from_this();
    Hold hold(mutex_);
    if (!this->end_wait() || is_over_) return;
    is_writing_ = has_shed_ = false;
    if (!ok) return finish(hold, this->status_of_stop());
    hold.batch = std::move(batches_.front());
    batches_.pop_front();
    go_on(hold);
  }

  void OnCancel() override {
    const auto self = this->shared_from_this();
    stop();
    leave_queue();
  }

  void give_way() {
    Hold hold(mutex_);
    if (is_over_ || gives_way_ || working_ == 0 || !mesh_) return;
    ++state_.metrics.gave_way;
    gives_way_ = true;
    work_cancel_.cancel();
  }

  /// A call that waits for a place or for memory does nothing else that would come to an end.
  void leave_queue() {
    if (!Base::leave_queue()) return;
    Hold hold(mutex_);
    has_ = Has::kNoPlace;
    go_on(hold);
  }

  void stop() override {
    {
      const std::lock_guard lock(mutex_);
      cancel_.cancel();
      work_cancel_.cancel();
    }
    this->stop_loading();
  }

  void shed() override {
    Hold hold(mutex_);
    if (is_over_) return;
    benches_.move_idle_to(hold.benches);
    if (!is_writing_) return;
    if (!has_shed_) ++state_.metrics.shed;
    has_shed_ = resumes_ = true;
    hold.shares.push_back(read_share_.split_off_beyond(0));
    hold.shares.push_back(batches_.front()->share.split_off_beyond(0));
    for (auto behind = batches_.begin() + 1; behind != batches_.end(); ++behind) {
      if ((**behind).is_done && !(**behind).failure) forget_answer(hold, **behind);
    }
    if (working_ == 0) give_place_back();
  }

  void forget_answer(Hold& hold, Batch& batch) {
    batch.response = typename Solver::Response();
    batch.is_begun = batch.is_done = false;
    hold.shares.push_back(batch.share.split_off_beyond(0));
  }

  // On workers, without the mutex.

  /// Parses a message, for which gRPC's threads have no time, and finds the mesh for the first one, and volumes.
  void take(const BatchPtr& batch) {
    std::vector<std::string> ids;
    try {
      parse_request(batch->raw, batch->request);
      require_known_fields(batch->request);
      ids = Solver::volume_ids(batch->request);
    } catch (...) {
      return taken(batch, {}, std::current_exception());
    }
    if (mesh_ && ids.empty()) return taken(batch, {mesh_}, nullptr);
    if (!mesh_) ids.insert(ids.begin(), batch->request.mesh_id());
    this->with_meshes(
        lane_, ids,
        [this, batch](const std::vector<MeshPtr>& loaded, const std::exception_ptr& error) {
          std::vector<MeshPtr> meshes = loaded;
          if (mesh_ && !error) {
            meshes.insert(meshes.begin(), mesh_);
            this->note_meshes(meshes);
          }
          taken(batch, meshes, error);
        },
        mesh_ ? Base::WhileMeshComes::kKeepsPlace : Base::WhileMeshComes::kHasNoPlace);  // Batches may be at work.
    if (cancel_.cancelled()) this->stop_loading();  // Cancelled before there was anything to stop.
  }

  /// `meshes`: the call's, then the volumes of the message.
  void taken(const BatchPtr& batch, const std::vector<MeshPtr>& meshes, const std::exception_ptr& error) {
    Hold hold(mutex_);
    --working_;
    batch->is_begun = is_taking_ = false;
    batch->raw.Clear();
    try {
      if (error) std::rethrow_exception(error);
      if (!mesh_) {
        (void)meshes.front()->solid();
        mesh_ = meshes.front();  // Once: workers read it.
        if (!is_over_) log_.note_mesh(mesh_->id());
      }
      accept(*batch, volumes_of(meshes));
    } catch (...) {
      fail(*batch, std::current_exception());
    }
    const std::uint64_t needed = batch->failure ? 0 : bytes_of(*batch);
    hold.shares.push_back(batch->share.split_off_beyond(std::min(needed, batch->share.bytes())));
    go_on(hold);
  }

  void answer(const BatchPtr& batch, const BenchPtr& bench, const CancellationToken& cancel) {
    std::exception_ptr failure;
    try {
      cancel.throw_if_cancelled();
      if (!bench->solver) bench->solver.emplace(mesh_);
      bench->solver->answer(batch->setting, batch->request, batch->response, cancel);
    } catch (...) {
      failure = std::current_exception();
    }
    Hold hold(mutex_);
    --working_;
    if (failure && gives_way_ && !cancel_.cancelled()) {
      forget_answer(hold, *batch);  // What was wrong with it will be so again.
    } else if (failure) {
      fail(*batch, failure);
    } else if (has_shed_ && batch != batches_.front()) {
      forget_answer(hold, *batch);
    } else {
      batch->is_done = true;
    }
    if (is_over_ || has_shed_ || gives_way_ || others_wait()) {
      bench->solver.reset();  // The lane keeps the bench until this returns.
      hold.shares.push_back(bench->share.split_off_beyond(0));
      benches_.note_gone();
    } else {
      benches_.put_back(bench);
    }
    go_on(hold);
  }

  Executor::Lane lane_;
  const CancellationToken cancel_ = Executor::make_token();

  std::mutex mutex_;                                        // Guards what follows.
  CancellationToken work_cancel_ = Executor::make_token();  // Of the batches that are worked on.
  bool is_over_ = false, is_waiting_ = false, is_reading_ = false, is_writing_ = false, reads_done_ = false;
  bool has_shed_ = false;                      // The client hasn't read for a while.
  bool resumes_ = false;                       // Nor has the call worked since.
  bool gives_way_ = false, gave_way_ = false;  // Others come first: as soon as it has stopped; until its next turn.
  Has has_ = Has::kNoPlace;
  bool had_place_ = false;
  grpc::ByteBuffer raw_;    // The read's.
  MeshPtr mesh_;            // Once there, it stays.
  bool is_taking_ = false;  // A batch is parsed, or its mesh comes.
  typename Solver::Setting setting_;
  std::deque<BatchPtr> batches_;  // Neither failed nor answered yet.
  std::size_t working_ = 0;       // Of those, that workers have.
  SolverBenches<Solver> benches_;
  MemoryBudget::Share read_share_;  // For the message that is being read.
  using Base::log_;
  using Base::state_;
};

}  // namespace ccslice::server
