// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A stream whose work is done ahead of its reader, in memory that is reserved before.
//
//     prepared -> asks for memory, may wait for it -> works, is read -> ... -> over
//                          ^                              |
//                          | is read again                | isn't read for a while
//                          +--------- has shed <----------+
//
// One that SHEDS gives back its place and all that can be had again. It keeps the message that is being sent, which
// counts nowhere: hundreds of such calls must not keep others from memory. What comes behind is computed anew, to the
// same bytes. One that GIVES WAY does the same although it is read, for a client of whom far fewer calls run
// (admission.h), and asks for memory again with its next message.

#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <exception>
#include <mutex>
#include <string>
#include <utility>

#include "server/rpc/calls/stream_call.h"

namespace ccslice::server {

template <class Response>
class SheddingCall : public StreamCall<Response> {
 protected:
  using StreamCall<Response>::StreamCall;
  using StreamCall<Response>::state_;

  /// Takes what the work needs, or nothing: Admission::Memory::reserve.
  virtual bool reserve() = 0;
  virtual bool is_short() const = 0;
  /// Has start_work() called on a worker: there is memory.
  virtual void start_work_later() = 0;
  /// On a worker. May throw.
  virtual void start_work() = 0;
  /// Gives back all but the place, on any thread. Whether there was anything.
  virtual bool give_work_back() = 0;
  /// Whether the work goes on where it was given back, so that no more than a little of it is done twice.
  virtual bool goes_on() const = 0;
  /// Whether some of it went out since it was begun or went on. Else it could give way for ever, and get nowhere.
  virtual bool has_got_on() { return false; }

  void stop() override {
    cancel_.cancel();
    this->leave_memory_queue();
  }

  /// Refuses what could never begin. `what`: the work takes so much `scratch_bytes`. Throws ServiceError.
  void require_scratch(const std::string& what, std::uint64_t scratch_bytes, const std::string& remedy) const {
    if (scratch_bytes <= state_.scratch.capacity_bytes()) return;
    throw job_exceeds_memory(what, scratch_bytes, state_.scratch.capacity_bytes(), remedy, "--scratch-budget-bytes");
  }

  /// Of the memory for scratch, what long work that needs `scratch_bytes` leaves to short work, unless it couldn't
  /// begin then.
  std::uint64_t bytes_left(std::uint64_t scratch_bytes) const {
    if (is_short()) return 0;
    const std::uint64_t all = state_.scratch.capacity_bytes();
    return std::min(scratch_for_short(all), all - scratch_bytes);
  }

  /// For the first time. Once.
  void ask_for_work() {
    this->ask_for_memory(wanted_memory(), decided());
    leave_if_stopped();
  }
  /// After it has shed.
  void ask_again() {
    if (take_gave_way()) {
      this->wait_again(wanted_memory(), decided());
    } else {
      this->resume(wanted_memory(), decided());
    }
    leave_if_stopped();
  }

  /// Has start_work() run, as a piece of work of its own.
  void start_work_in(Pieces pieces) {
    this->make_lane(pieces).post([this, self = this->shared_from_this()] {
      try {
        start_work();
      } catch (...) {
        const std::lock_guard lock(work_mutex_);
        error_ = std::current_exception();
      }
      this->wake();
    });
  }

  /// A call without memory may still be refused, which clients take better before the first message. Throws why it is.
  bool may_begin() {
    const std::lock_guard lock(work_mutex_);
    throw_error_locked();
    return has_memory_;
  }

  void throw_error_locked() const {
    if (error_) std::rethrow_exception(error_);
  }
  /// Whether the call has shed since this was asked last. Then it has to ask_again().
  bool take_shed_locked() { return std::exchange(has_shed_, false); }

  const CancellationToken cancel_ = Executor::make_token();
  std::mutex work_mutex_;  // Guards what derived classes say it does, too.

 private:
  void shed() override {
    if (give_work_back()) note_shed(/*gave_way=*/false, state_.metrics.shed);
  }
  void give_way() {
    if (has_got_on() && give_work_back()) note_shed(/*gave_way=*/true, state_.metrics.gave_way);
  }
  void note_shed(bool gave_way, std::atomic<std::uint64_t>& times) {
    ++times;
    this->give_place_back();
    {
      const std::lock_guard lock(work_mutex_);
      has_shed_ = true;
      gave_way_ = gave_way;
    }
    this->wake();
  }
  bool take_gave_way() {
    const std::lock_guard lock(work_mutex_);
    return std::exchange(gave_way_, false);
  }

  /// It may have been stopped when nobody could take it out of the queue yet.
  void leave_if_stopped() {
    if (cancel_.cancelled()) this->leave_memory_queue();
  }

  Admission::Memory wanted_memory() {
    Admission::Memory memory{.reserve = [this] { return reserve(); }, .is_short = is_short()};
    if (is_short() || !goes_on()) return memory;
    memory.give_way = [weak = this->weak_from_this()] {
      if (const auto call = weak.lock()) static_cast<SheddingCall&>(*call).give_way();
    };
    return memory;
  }

  Admission::Decision decided() {
    return [this, self = this->shared_from_this()](const std::exception_ptr& refusal) {
      {
        const std::lock_guard lock(work_mutex_);
        error_ = refusal;
        has_memory_ = true;
      }
      if (!refusal) start_work_later();
      this->wake();
    };
  }

  bool has_memory_ = false;   // Or had it.
  bool has_shed_ = false;     // Nothing has been asked for since.
  bool gave_way_ = false;     // When it shed last.
  std::exception_ptr error_;  // Why there is no work.
};

}  // namespace ccslice::server
