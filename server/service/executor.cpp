// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/executor.h"

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <utility>

namespace ccslice::server {

/// TBB's default is one worker less than there are cores, for the thread that calls; here no thread ever joins the
/// arena.
struct Executor::Arena {
  explicit Arena(std::size_t threads)
      : parallelism(tbb::global_control::max_allowed_parallelism, threads + 1),
        arena(static_cast<int>(threads), /*reserved_for_masters=*/0) {}
  tbb::global_control parallelism;
  tbb::task_arena arena;
};

void Executor::Lane::post(Work work) const { executor_->post(queue_, std::move(work), Place::kBack); }
void Executor::Lane::post_front(Work work) const { executor_->post(queue_, std::move(work), Place::kFront); }

Executor::Executor(std::size_t threads)
    : threads_(threads), max_long_(std::max<std::size_t>(2, threads) - 1), arena_(std::make_unique<Arena>(threads)) {}

Executor::~Executor() { wait_idle(); }

void Executor::wait_idle() {
  std::unique_lock lock(mutex_);
  idle_.wait(lock, [this] { return workers_ == 0; });
}

void Executor::post(const std::shared_ptr<Lane::Queue>& queue, Work work, Place place) {
  {
    std::lock_guard lock(mutex_);
    if (place == Place::kBack) {
      queue->work.push_back(std::move(work));
    } else {
      queue->work.push_front(std::move(work));
    }
    if (!queue->listed) {
      queue->listed = true;
      lanes_.push_back(queue);
    }
    if (workers_ == threads_) return;
    ++workers_;
  }
  arena_->arena.enqueue([this] { work_until_idle(); });
}

void Executor::work_until_idle() {
  Work work;
  Pieces pieces = Pieces::kShort;
  while (take(work, pieces)) {
    work();
    work = nullptr;  // Frees what it captured before the next piece is waited for.
  }
}

/// Ends the piece that this worker did before (`pieces`), takes the next one that may run.
bool Executor::take(Work& work, Pieces& pieces) {
  std::lock_guard lock(mutex_);
  if (std::exchange(pieces, Pieces::kShort) == Pieces::kLong) --running_long_;
  const auto next = std::find_if(lanes_.begin(), lanes_.end(), [this](const std::shared_ptr<Lane::Queue>& lane) {
    return lane->pieces == Pieces::kShort || running_long_ < max_long_;
  });
  if (next == lanes_.end()) {  // Nothing, or long pieces that wait for one to end, whose worker then takes them.
    --workers_;
    if (workers_ == 0) idle_.notify_all();
    return false;
  }
  const std::shared_ptr<Lane::Queue> queue = std::move(*next);
  lanes_.erase(next);
  pieces = queue->pieces;
  if (pieces == Pieces::kLong) ++running_long_;
  work = std::move(queue->work.front());
  queue->work.pop_front();
  queue->listed = !queue->work.empty();
  if (queue->listed) lanes_.push_back(queue);
  return true;
}

}  // namespace ccslice::server
