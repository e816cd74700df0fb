// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Who may compute, and who waits for it. So many calls RUN; so many more WAIT, for at most so long; further ones are
// refused and told when to come again. A call that waits holds no thread and nothing of the server's but its request.
//
// Long calls may go on for hours, as many as run. So there are some places beyond those, which long calls don't take:
// short ones needn't wait for a long one's end. A call is taken to be short until it says otherwise.
//
// A call that finds out what memory it needs, and doesn't find that, gives up its place and waits for both, before
// those that come new. Who waits for memory holds up nobody who needs none. Calls that gave back all that they had in
// their middle RESUME: before long ones of their client, and they wait for as long as it takes, since their clients
// have begun to read. A client who reads slowly has them resume again and again, so others needn't wait for that. But
// the oldest of a client that has waited as long as others may at most comes before all, once in such a time.
//
// Among those whose turn it is equally, the client comes first of whom fewest calls run, then the one who was served
// longest ago, then who waits longest. Where the queue is full, a client who has two calls less in it than another one
// takes the place of that one's newest. So a client with one call needn't wait for all of one who makes hundreds.
//
// Nor for the end of what that one has running, which may take hours: where a client of whom two calls less run has
// waited for a while, the latest run of the client with most of them is told to GIVE WAY. It gives all back, and waits
// for its client's next turn. The earlier ones go on undisturbed, so however many others come and go, some of its calls
// get ahead. And of eight places or more a quarter is never one client's: not every call can give way.

#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <list>
#include <mutex>
#include <string>
#include <thread>
#include <unordered_map>
#include <utility>
#include <vector>

namespace ccslice::server {

struct AdmissionLimits {
  std::size_t running = 32;
  std::size_t short_more = 0;  // So many more run, as long as no more than `running` are long.
  std::size_t waiting = 0;
  std::chrono::milliseconds longest_wait{10'000};
  std::chrono::milliseconds give_way_after{1'000};  // And again, until one has given way for whoever waits.
};

/// Thread-safe. Must outlive its places.
class Admission {
 public:
  /// Runs once: with nothing if there is a place, with a ServiceError{kServerBusy, kServerDraining} if not. On the
  /// thread that asked, or later on any other one.
  using Decision = std::function<void(std::exception_ptr refusal)>;

  /// What a call needs besides its place.
  struct Memory {
    /// Takes it all, or nothing. Runs under a lock: calls nothing here. Doesn't keep the call alive; the decision does.
    std::function<bool()> reserve;
    bool is_short = false;  // Then it is served before long ones that wait for memory; else it is long.
    /// May be empty. Has the call give back its memory and its place soon, and then wait_again(). On a thread of the
    /// admission's, under no lock, also when the call has ended meanwhile.
    std::function<void()> give_way = {};
  };

  /// A call's place. Gives it back when it goes.
  class Place {
   public:
    /// `client`: who makes the call (client_id.h).
    explicit Place(Admission& admission, std::string client = {}) : admission_(admission), client_(std::move(client)) {}
    ~Place() { admission_.give_back(*this); }
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;

   private:
    friend class Admission;
    enum class State { kNone, kWaiting, kRunning };
    enum class Turn { kResumes, kGaveWay, kHasBegun, kIsNew };
    /// Among calls that have begun short ones come before long ones: else these would take turns with the memory that
    /// one of those needs. Of a client the ranks come in this order; the second and the third are one GROUP, in which
    /// clients take turns.
    enum class Rank : std::size_t { kHasBegunShort, kResumes, kHasBegun, kIsNew, kCount };

    Admission& admission_;
    const std::string client_;
    State state_ = State::kNone;
    Turn turn_ = Turn::kIsNew;
    bool has_run_ = false;
    Memory memory_;      // While it asks or waits.
    Decision decision_;  // While it waits.
    bool is_long_ = false;
    bool lacks_memory_ = false;                    // While it waits: there was a place.
    std::chrono::steady_clock::time_point since_;  // When it began to wait, or to run.
    Rank rank_ = Rank::kIsNew;                     // While it waits: where
    std::list<Place*>::iterator position_;         // in the queue, and among those of its client.
    std::list<Place*>::iterator position_of_client_;
    std::function<void()> give_way_;  // Empty if it can't.
  };

  explicit Admission(const AdmissionLimits& limits);
  ~Admission();
  Admission(const Admission&) = delete;
  Admission& operator=(const Admission&) = delete;

  /// REQUIRES: the place neither runs nor waits. One that ran before, and gave itself back between two pieces of its
  /// call's work, waits like a new one but is let in even while calls drain: its call is under way.
  /// `give_way`: as of Memory, for a call that doesn't ask for any here.
  void request(Place& place, Decision decision, bool is_long = false, std::function<void()> give_way = {});
  /// Memory for a call that runs, and for a long one that began as a short one a place among the long ones. It goes on
  /// running if that is there; otherwise it gives its place to others, and waits for both. Refused as in request():
  /// then it still runs.
  void request_memory(Place& place, Memory memory, Decision decision);
  /// A place and memory for a call that ran before and gave its place back. Never refused.
  void resume(Place& place, Memory memory, Decision decision);
  /// A place and memory for a call that gave way: before those of its client that haven't begun yet.
  void wait_again(Place& place, Memory memory, Decision decision);
  /// Whether a new call was waiting. Then it doesn't any more, and its decision never runs.
  bool leave_queue(Place& place);
  /// Whether a call that asked for memory was waiting. Then it does no more, and its decision never runs.
  bool leave_memory_queue(Place& place);
  /// To be called when there may be more memory than before.
  void retry();
  /// Whether some call waits for memory that others should do without. One that gave way takes what is left.
  bool wants_memory() const noexcept { return urgent_memory_waiters_.load() > 0; }
  /// Ends a run, and begins that of a call that waits. Does nothing for a place that isn't running. A run that ends
  /// while this begins it is followed by the next one only after its decision has returned.
  void give_back(Place& place);
  /// Refuses those who wait, and all who come from now on; but none that resumes, gave way, or asks again for a place.
  void drain();

  std::size_t running() const;
  /// Counts the client's calls that run, and those that have begun and wait.
  std::size_t begun_of(const std::string& client) const;
  std::size_t waiting() const;
  /// Of those, how many could have a place if there were memory for them.
  std::size_t waiting_for_memory() const noexcept { return memory_waiters_.load(); }

 private:
  using Clock = std::chrono::steady_clock;
  using Rank = Place::Rank;
  struct Client {
    std::size_t running = 0;
    std::uint64_t served = 0;           // How many runs had begun in all when the last one of its own did.
    std::size_t expiring = 0;           // Of those that wait.
    Clock::time_point overdue_begun{};  // When one of its calls last came before all others.
    std::list<Place*> giving;           // Of those that run, who can give way: the one to be told next comes last.
    std::array<std::list<Place*>, static_cast<std::size_t>(Rank::kCount)> waiting;  // By rank, as they came.
    std::list<Place*>& of(Rank rank) { return waiting[static_cast<std::size_t>(rank)]; }
    bool is_idle() const {
      return running == 0 && std::ranges::all_of(waiting, [](const auto& places) { return places.empty(); });
    }
  };
  struct Waiting;
  struct AwaitedMemory {
    bool by_any = false, by_short = false;
  };
  struct Refusal {
    Decision decision;
    std::exception_ptr reason;
  };

  void enter(Place& place, Place::Turn turn, Memory memory, Decision decision);
  static bool is_under_way(const Place& place, Place::Turn turn);
  static bool waits_for_ever(Place::Turn turn);
  bool has_place_for(const Place& place) const;
  bool has_memory_for(const Place& place) const;
  static Rank rank_of(const Place& place);
  static std::size_t group_of(Rank rank);
  bool comes_first(const Place& a, const Place& b) const;
  Place* overdue_of(Client& client, Clock::time_point now);
  bool is_overdue(const Place& place, const Client& client, Clock::time_point now) const;
  void admit_overdue(AwaitedMemory& awaited, std::vector<Decision>& admitted);
  bool try_admit(Place& place, AwaitedMemory& awaited, std::vector<Decision>& admitted);
  void admit_of_ranks(Rank first, Rank last, AwaitedMemory& awaited, std::vector<Decision>& admitted);
  void run(Place& place);
  void stop_running(Place& place);
  bool make_room_in_queue(const Place& place, Refusal& refused);
  void insert(Place& place, Decision decision, bool lacks_memory);
  bool leave(Place& place, bool is_new);
  void admit(std::vector<Decision>& admitted);
  void watch_waits();
  void note_left();
  void admit_unlocked(std::unique_lock<std::mutex>& lock);
  Place* next_to_expire() const;
  std::function<void()> next_to_give_way(Clock::time_point now);
  void note_lack_of_memory(Place& place, bool lacks);
  std::exception_ptr busy(bool for_memory) const;
  std::chrono::seconds retry_delay() const;
  void take_out(Place& place);

  const AdmissionLimits limits_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::list<Place*> queue_;   // In the order in which they came.
  std::size_t expiring_ = 0;  // Of those, all but the ones that wait for as long as it takes.
  std::atomic<std::size_t> memory_waiters_{0}, urgent_memory_waiters_{0};
  std::size_t running_ = 0, long_running_ = 0;
  std::unordered_map<std::string, Client> clients_;
  std::uint64_t served_ = 0;  // Runs that have begun.
  bool draining_ = false, over_ = false;
  bool has_left_ = false;                      // See note_left().
  Clock::time_point last_end_ = Clock::now();  // Of a run while calls wait, or when the first one began to.
  Clock::time_point told_;                     // When somebody was told to give way.
  double pace_s_ = 1;                          // Between the ends of runs while calls wait, smoothed.
  std::thread clock_;
};

}  // namespace ccslice::server
