// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/scheduling/executor.h"

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>

namespace ccslice::server {

/// A thread. All members but the last two belong to the executor's lock.
struct Worker {
  explicit Worker(Executor& the_executor)
      : executor(the_executor), thread([this] { executor.work_until_over(*this); }) {}

  static thread_local Worker* current;

  Executor& executor;
  Executor::Processor processor = Executor::Processor::kNone;  // None: idle or parked.
  WorkQueue::CallPtr call;                                     // Of the piece that it runs,
  Executor::Work work;                                         // which is this, before it begins.
  std::condition_variable wake;                                // There is a processor for it.
  Executor::Clock::time_point charged;                         // Until when the piece has been paid for.
  std::thread thread;                                          // The last: it begins at once.
};

thread_local Worker* Worker::current = nullptr;

Executor::Executor(std::size_t threads, std::function<Clock::time_point()> now)
    : threads_(threads), now_(std::move(now)), queue_(std::max<std::size_t>(2, threads) - 1), free_{1, threads} {
  const std::lock_guard lock(mutex_);
  while (idle_workers_.size() < threads + 1) {
    if (!add_worker()) throw std::runtime_error("can't start " + std::to_string(threads + 1) + " threads");
  }
}

Executor::~Executor() {
  wait_idle();
  {
    const std::lock_guard lock(mutex_);
    over_ = true;
    for (Worker& worker : workers_) worker.wake.notify_one();
  }
  for (Worker& worker : workers_) worker.thread.join();
}

void Executor::wait_idle() {
  std::unique_lock lock(mutex_);
  idle_.wait(lock, [this] { return unfinished_ == 0; });
}

void Executor::post(const WorkQueue::CallPtr& call, Work work, WorkQueue::Place place) {
  const std::lock_guard lock(mutex_);
  ++unfinished_;
  queue_.push(call, {.work = std::move(work)}, place);
  use_free_processors();
}

/// False if the machine has no more threads.
bool Executor::add_worker() {
  try {
    idle_workers_.push_back(&workers_.emplace_back(*this));
    return true;
  } catch (const std::system_error&) {
    return false;
  }
}

void Executor::work_until_over(Worker& self) {
  Worker::current = &self;
  std::unique_lock lock(mutex_);
  while (true) {
    self.wake.wait(lock, [&] { return self.processor != Processor::kNone || over_; });
    if (self.processor == Processor::kNone) return;
    run_piece(self, lock);
    idle_workers_.push_back(&self);
    free_processor_of(self);
  }
}

void Executor::run_piece(Worker& self, std::unique_lock<std::mutex>& lock) {
  Work work = std::exchange(self.work, nullptr);
  self.charged = now_();
  lock.unlock();
  work();
  work = nullptr;  // Frees what it captured.
  lock.lock();
  charge(self, now_());
  queue_.end(std::exchange(self.call, nullptr));
  if (--unfinished_ == 0) idle_.notify_all();
}

void Executor::charge(Worker& self, Clock::time_point now) {
  const std::chrono::nanoseconds time = now - std::exchange(self.charged, now);
  worked_ns_[self.call->pieces == Pieces::kInteractive ? 0 : 1] += static_cast<std::uint64_t>(time.count());
  queue_.charge(*self.call, time);
}

void Executor::give_way() noexcept {
  if (Worker::current != nullptr) Worker::current->executor.give_way(*Worker::current);
}

/// Parks the worker if it's another one's turn, until it is its own again. Where there are no more threads, it runs on.
void Executor::give_way(Worker& self) {
  const Clock::time_point now = now_();
  if (now - self.charged < kTurn) return;
  std::unique_lock lock(mutex_);
  charge(self, now);  // While the others are those who were there, even if nobody waits now.
  if (queue_.size() == 0) return;
  if (idle_workers_.size() <= free_.front() + free_.back() && !add_worker()) return;
  queue_.park(self.call, self);
  free_processor_of(self);
  self.wake.wait(lock, [&] { return self.processor != Processor::kNone; });
  self.charged = now_();
}

void Executor::free_processor_of(Worker& self) {
  ++free(std::exchange(self.processor, Processor::kNone));
  use_free_processors();
}

void Executor::use_free_processors() {
  for (const Processor processor : {Processor::kInteractive, Processor::kAny}) {
    while (free(processor) > 0) {
      std::optional<WorkQueue::Taken> taken = queue_.take(processor == Processor::kInteractive);
      if (!taken) break;
      --free(processor);
      start(std::move(*taken), processor);
    }
  }
}

void Executor::start(WorkQueue::Taken taken, Processor processor) {
  Worker* worker = taken.item.parked;
  if (worker == nullptr) {
    worker = idle_workers_.back();  // The one that worked last, as its memory is near.
    idle_workers_.pop_back();
    worker->call = std::move(taken.call);
    worker->work = std::move(taken.item.work);
  }
  worker->processor = processor;
  worker->wake.notify_one();
}

}  // namespace ccslice::server
