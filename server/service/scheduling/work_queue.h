// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The work that waits for a worker, and whose turn it is. Time is shared on three levels, evenly on each: between
// INTERACTIVE work and the rest, then between clients, then between a client's calls. What counts is the time that
// pieces took, not their number. Among equals, who hasn't come for longest comes first.
//
// A piece that gave way to others in its middle is an item like any other: that which comes next of its call.

#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/service/scheduling/fair_level.h"

namespace ccslice::server {

struct Worker;

enum class Pieces {
  kInteractive,  // Somebody waits for the answer, and little is asked for.
  kBatch,        // The layers of jobs.
  kLong,         // Batch work of which a client has only so much begun at a time.
};

/// Not thread-safe.
class WorkQueue {
 private:
  struct Client;

 public:
  using Work = std::function<void()>;
  /// A piece that hasn't begun, or the worker in whose middle of one it gave way.
  struct Item {
    Work work;
    Worker* parked = nullptr;
  };
  enum class Place { kFront, kBack };
  static constexpr std::size_t kLongOfOthers = 3;

  struct Call {
    Call(std::string the_client, Pieces the_pieces) : client(std::move(the_client)), pieces(the_pieces) {}

    const std::string client;
    const Pieces pieces;

   private:
    friend class WorkQueue;
    std::deque<Item> items;
    FairShare share;
    Client* account = nullptr;  // While it has items, or some are running.
  };
  using CallPtr = std::shared_ptr<Call>;

  struct Taken {
    CallPtr call;
    Item item;
  };

  /// `max_long`: kLong pieces of one client that have begun and haven't ended, at most. Beyond so many in all only
  /// clients begin one that have none, and kLongOfOthers of those.
  explicit WorkQueue(std::size_t max_long) : max_long_(max_long) {}

  void push(const CallPtr& call, Item item, Place place);
  /// What comes next, if anything may. It is running then.
  [[nodiscard]] std::optional<Taken> take(bool interactive_only);
  /// A running piece took `time` since it was taken or charged.
  void charge(Call& call, std::chrono::nanoseconds time);
  /// A running piece is over.
  void end(const CallPtr& call);
  /// A running piece gives way; its worker is the call's next item.
  void park(const CallPtr& call, Worker& worker);
  std::size_t size() const { return size_; }

 private:
  struct Client {
    FairShare share;
    FairLevel level;              // Of its calls.
    std::vector<CallPtr> active;  // Whose turn was longest ago first.
    std::size_t begun_long = 0;
  };
  struct Class {
    FairShare share;
    FairLevel level;                        // Of its clients.
    std::map<std::string, Client> clients;  // The active ones, and those that aren't even yet.
    std::vector<Client*> active;            // Like a client's.
  };

  Class& class_of(const Call& call) { return classes_[call.pieces == Pieces::kInteractive ? 0 : 1]; }
  void enter(const CallPtr& call);
  void count_running(Call& call, int change);
  void count_begun_long(Call& call, int change);
  void leave_if_done(const CallPtr& call);
  bool is_ready(const Call& call) const;
  bool may_begin_long(const Client& client) const;
  CallPtr next_of(const Client& client) const;
  Client* next_client_of(const Class& work) const;

  const std::size_t max_long_;
  std::size_t begun_long_ = 0;
  std::size_t size_ = 0;
  FairLevel level_;  // Of the classes.
  std::array<Class, 2> classes_;
};

}  // namespace ccslice::server
