// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The worker threads: all computing of the service happens here, never on gRPC's threads.
//
// Every call has a LANE, a queue of pieces of work. Workers take one piece from each lane in turn, so calls share the
// threads fairly however much work one of them has; a piece should last well below a second. Work never waits for a
// client: it is only queued when its result has room (see LayerStream).
//
// Work that lasts longer (preparing a mesh, tessellating) is queued in lanes of LONG pieces. One thread is kept free of
// them, so slicing always gets on; a server with a single thread takes them in turn with everything else.

#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>

namespace ccslice::server {

class Executor {
 public:
  using Work = std::function<void()>;
  enum class Pieces { kShort, kLong };

  /// A call's queue. Copyable handle; work that is queued keeps it alive.
  class Lane {
   public:
    /// Behind this lane's other work. `work` must not throw.
    void post(Work work) const;
    /// Before it: the continuation of a piece that gives way to other lanes.
    void post_front(Work work) const;

   private:
    friend class Executor;
    struct Queue {
      Pieces pieces;
      std::deque<Work> work;
      bool listed = false;  // In Executor::lanes_.
    };
    Lane(Executor& executor, std::shared_ptr<Queue> queue) : executor_(&executor), queue_(std::move(queue)) {}
    Executor* executor_;
    std::shared_ptr<Queue> queue_;
  };

  /// REQUIRES: threads >= 1.
  explicit Executor(std::size_t threads);
  /// Waits for all work.
  ~Executor();
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;

  /// Waits until nothing is queued or running.
  void wait_idle();

  Lane make_lane(Pieces pieces = Pieces::kShort) {
    return Lane(*this, std::make_shared<Lane::Queue>(Lane::Queue{.pieces = pieces, .work = {}}));
  }
  std::size_t threads() const noexcept { return threads_; }

 private:
  struct Arena;
  enum class Place { kBack, kFront };
  void post(const std::shared_ptr<Lane::Queue>& queue, Work work, Place place);
  void work_until_idle();
  [[nodiscard]] bool take(Work& work, Pieces& pieces);

  const std::size_t threads_;
  const std::size_t max_long_;  // Long pieces running at the same time.
  std::mutex mutex_;
  std::condition_variable idle_;
  std::deque<std::shared_ptr<Lane::Queue>> lanes_;  // Those with queued work, next one first.
  std::size_t workers_ = 0;                         // Tasks in the arena, each in work_until_idle().
  std::size_t running_long_ = 0;
  std::unique_ptr<Arena> arena_;
};

}  // namespace ccslice::server
