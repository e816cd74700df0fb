// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The worker threads: all computing of the service happens here, never on gRPC's threads.
//
// Every call has a LANE, a queue of pieces of work. So many pieces run at the same time, one for each PROCESSOR that
// the server uses, and whose turn it is follows from the time that classes of work, clients and calls had
// (work_queue.h). One processor more takes interactive work and nothing else. Work never waits for a client: it is only
// queued when its result has room (see LayerStream).
//
// However long a piece is, it gives way wherever it polls its token (make_token()): after a turn, if it is somebody
// else's. Its thread then stays where it is, PARKED, while another one takes over its processor, until it gets one
// again. So there are more threads than processors, one for each piece that has begun, but no more of them run.
//
// Work of which too much must not be begun (preparing a mesh, which takes memory, tessellating) is queued in lanes of
// kLong pieces. Those of one client leave one processor free, unless there is only one. Those of a few other clients
// begin all the same: a large mesh takes minutes to prepare, and they would wait for its end.

#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "server/service/scheduling/work_queue.h"

namespace ccslice::server {

class Executor {
 public:
  using Work = WorkQueue::Work;
  using Clock = std::chrono::steady_clock;

  /// How long a piece runs on although it is another one's turn.
  static constexpr std::chrono::nanoseconds kTurn = FairShare::kTurn;

  /// A call's queue. Copyable handle; work that is queued keeps it alive.
  class Lane {
   public:
    /// Behind this lane's other work. `work` must not throw.
    void post(Work work) const { executor_->post(call_, std::move(work), WorkQueue::Place::kBack); }
    /// Before it: the continuation of a piece that is over.
    void post_front(Work work) const { executor_->post(call_, std::move(work), WorkQueue::Place::kFront); }

   private:
    friend class Executor;
    Lane(Executor& executor, WorkQueue::CallPtr call) : executor_(&executor), call_(std::move(call)) {}
    Executor* executor_;
    WorkQueue::CallPtr call_;
  };

  /// REQUIRES: threads >= 1.
  explicit Executor(std::size_t threads, std::function<Clock::time_point()> now = &Clock::now);
  /// Waits for all work.
  ~Executor();
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;

  /// Waits until nothing is queued or running.
  void wait_idle();

  /// `client`: who the call is charged to (client_id.h).
  Lane make_lane(std::string client, Pieces pieces) {
    return Lane(*this, std::make_shared<WorkQueue::Call>(std::move(client), pieces));
  }
  /// A token for work in lanes, which gives way where it polls.
  [[nodiscard]] static CancellationToken make_token() { return CancellationToken::make(&give_way); }
  /// Time that pieces of the class took so far, those that run now as far as they were charged.
  [[nodiscard]] double worked_seconds(Pieces pieces) const noexcept {
    return static_cast<double>(worked_ns_[pieces == Pieces::kInteractive ? 0 : 1].load()) / 1e9;
  }
  /// Processors, but for the one that only takes interactive work.
  std::size_t threads() const noexcept { return threads_; }

 private:
  friend struct Worker;
  enum class Processor { kNone, kInteractive, kAny };

  static void give_way() noexcept;
  void give_way(Worker& self);
  void post(const WorkQueue::CallPtr& call, Work work, WorkQueue::Place place);
  bool add_worker();
  void work_until_over(Worker& self);
  void run_piece(Worker& self, std::unique_lock<std::mutex>& lock);
  void charge(Worker& self, Clock::time_point now);
  void free_processor_of(Worker& self);
  void use_free_processors();
  void start(WorkQueue::Taken taken, Processor processor);
  std::size_t& free(Processor processor) { return free_[processor == Processor::kInteractive ? 0 : 1]; }

  const std::size_t threads_;
  std::array<std::atomic<std::uint64_t>, 2> worked_ns_{};  // Interactive; the rest.
  const std::function<Clock::time_point()> now_;
  std::mutex mutex_;
  WorkQueue queue_;
  std::array<std::size_t, 2> free_;  // Processors that nothing runs on: the interactive one, the others.
  std::list<Worker> workers_;
  std::vector<Worker*> idle_workers_;  // At least as many as there are free processors.
  std::size_t unfinished_ = 0;         // Pieces.
  std::condition_variable idle_;
  bool over_ = false;
};

}  // namespace ccslice::server
