// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Ends calls whose client has done nothing for too long while the server waits for its next message, or for it to read
// one: such a call costs the client nothing and would hold a place among the running calls, and memory, for ever.
//
// A wait has one end: what was waited for came, or the watch lost patience. Whoever ends it goes on with the call.
//
// Long before, a call that LAGS is told so: what it holds may be of more use to others; sooner if they are waiting for
// it.

#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace ccslice::server {

/// A call that waits for its client now and then.
class IdleCall {
 public:
  virtual ~IdleCall() = default;

  /// Ends the wait and calls idle() if the call has been waiting since before `time`. Returns whether it had.
  bool end_wait_begun_before(std::chrono::steady_clock::time_point time);
  /// Calls lag() if the call has been waiting since before `time`.
  void note_wait_begun_before(std::chrono::steady_clock::time_point time);

  /// Whether it waits for a message to be read, which it keeps meanwhile.
  virtual bool keeps_message() const { return false; }
  /// A mesh that the call has in use, for whom.
  struct KeptMesh {
    const void* mesh = nullptr;  // Which one; null if none.
    std::uint64_t bytes = 0;
    std::string client;
  };
  virtual KeptMesh kept_mesh() const { return {}; }
  /// Since when its client has neither sent nor read anything, as waits_since() says it.
  virtual std::int64_t silent_since() const { return waits_since(); }
  /// Ends the call if its client has been silent since before `time`. Returns whether it has.
  virtual bool end_silence_begun_before(std::chrono::steady_clock::time_point time) {
    return end_wait_begun_before(time);
  }
  /// When the wait under way began, in ticks of the steady clock; not positive if there is none that could be ended.
  std::int64_t waits_since() const { return since_.load(); }

 protected:
  /// When a wait began, in ticks of the steady clock.
  using WaitBegin = std::int64_t;

  /// To be called before what is waited for is started: it may come at once. Until arm_wait() only end_wait() ends the
  /// wait, as a call must not be over before it has started what it waits for.
  WaitBegin begin_wait();
  /// Does nothing if that wait has ended.
  void arm_wait(WaitBegin wait);
  /// Ends the wait because what the call waited for has come. False if the wait has ended already: the call is over.
  [[nodiscard]] bool end_wait() { return since_.exchange(kNotWaiting) != kNotWaiting; }
  /// Ends the wait for any other reason. False if there is no wait, or it isn't armed yet.
  [[nodiscard]] bool end_armed_wait();

 private:
  /// Ends the call. On the watch's thread.
  virtual void idle() = 0;
  /// The call has been waiting for a while, and may be no more. On the watch's thread, as often as it sweeps meanwhile.
  virtual void lag() {}

  static constexpr WaitBegin kNotWaiting = 0;
  std::atomic<WaitBegin> since_{kNotWaiting};  // Negative until it's armed.
};

/// After how long a call lags.
struct LagTimes {
  std::chrono::milliseconds usual{1000};
  std::chrono::milliseconds in_need{300};  // Others wait for what calls hold.
};

/// Thread-safe.
class IdleWatch {
 public:
  /// A patience of 0 never ends a call.
  explicit IdleWatch(std::chrono::milliseconds patience, const LagTimes& lag = {}) : patience_(patience), lag_(lag) {}

  void add(const std::shared_ptr<IdleCall>& call);
  /// Ends the calls that have waited too long, and tells those that lag. To be called now and then.
  void sweep(bool in_need = false);
  /// Ends those calls that lag and keep messages, `most` of them, the ones first that have waited longest. How many.
  std::size_t end_longest(std::size_t most);
  /// All that were added and are still there.
  std::vector<std::shared_ptr<IdleCall>> open_calls();

 private:
  const std::chrono::milliseconds patience_;
  const LagTimes lag_;
  std::mutex mutex_;
  std::vector<std::weak_ptr<IdleCall>> calls_;
};

}  // namespace ccslice::server
