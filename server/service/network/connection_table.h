// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Which connections are open, from where, and which of them do anything.
//
// A connection's descriptor belongs to whoever serves it, and is closed there without a word. So the table keeps its
// number and the socket's identity (device and inode, which no other open file of the system shares): where the number
// stands for another file, or for none, the connection has left. That is looked up when it matters, which is when a
// limit is reached, and now and then.

#pragma once

#include <sys/socket.h>
#include <sys/types.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "server/service/network/guarded_reads.h"

namespace ccslice::server {

/// Where a connection comes from.
struct Peer {
  std::array<std::uint8_t, 16> address{};  // IPv6; IPv4 mapped into it.
  std::uint16_t port = 0;

  auto operator<=>(const Peer&) const = default;
  /// What counts as one address: an IPv4 address, or the 64 bits of an IPv6 address that a site is given.
  std::array<std::uint8_t, 16> site() const;
};

/// Nothing for a Unix socket's.
std::optional<Peer> peer_of(const sockaddr_storage& address);
/// gRPC's way to write it: "ipv4:192.0.2.1:50000", "ipv6:[2001:db8::1]:50000", also with %5B and %5D for brackets.
std::optional<Peer> parse_peer(const std::string& text);

struct ConnectionLimits {
  std::size_t connections = 0;
  std::size_t per_address = 0;            // Unix sockets have no addresses.
  std::chrono::milliseconds idle{0};      // Without a call for so long: dropped. 0: never.
  std::chrono::milliseconds arriving{0};  // After much has come that asks for nothing yet: dropped. 0: never.
  std::uint64_t arriving_bytes = 0;       // Come over all together of what isn't whole: beyond it, dropped. 0: any.
  std::size_t streams = 0;                // Calls that are open on one at the same time. 0: any number.
  bool encrypted = false;                 // By TLS, by whoever serves them.
};

enum class ConnectionVerdict { kTaken, kTooMany, kTooManyOfAddress };

/// Thread-safe.
class ConnectionTable {
 public:
  using Clock = std::chrono::steady_clock;
  /// 0: a connection that isn't in the table.
  using ConnectionId = std::uint64_t;

  explicit ConnectionTable(const ConnectionLimits& limits) : limits_(limits) {}

  /// `descriptor` is about to be handed over, if it is taken: to somebody who reads what the guard lets pass.
  ConnectionVerdict add(int descriptor, const std::optional<Peer>& peer, Clock::time_point now,
                        const std::shared_ptr<FrameGuard>& guard);

  /// Whose call it is: the slicer's, or of what gRPC serves besides, health and reflection, whose clients lose nothing
  /// if they have to call again.
  enum class CallKind { kSlicer, kBesides };
  /// A call begins on the connection from there. To be given back with end_call().
  [[nodiscard]] ConnectionId begin_call(const Peer& peer, CallKind kind = CallKind::kSlicer);
  /// A message of a call has come in whole, of so many bytes.
  void note_message(ConnectionId id, std::uint64_t bytes, Clock::time_point now);
  /// `served`: not if it was cancelled, perhaps before its request had come.
  void end_call(ConnectionId id, Clock::time_point now, bool served, CallKind kind = CallKind::kSlicer);

  struct Dropped {
    std::size_t idle = 0, arriving = 0, greedy = 0;
    std::size_t headers = 0, calls = 0;  // By their guards.
  };
  /// Forgets connections that have left, and shuts down those whose time is up: whoever serves them closes them then.
  /// It shuts down those, too, over which most has come of messages that aren't whole, whatever calls are open on them,
  /// until the others are within the bound.
  /// Unix sockets are left alone, as calls don't tell which of them they came by.
  Dropped sweep(Clock::time_point now);

  /// Shuts down up to `count` of those on which no slicer's call is open, though something has come since the last one
  /// was served, and of those over which far more has come in all than in messages that were whole: those first over
  /// which most has. For when memory runs short: calls that are begun and never ask for anything cost little to send,
  /// and count nowhere, and a small message that is whole hides a large one that isn't. How many.
  std::size_t drop_unserved(std::size_t count, Clock::time_point now);

  /// Shuts down up to `count` of the connections without an open call of the slicer that come from the address with
  /// most of those: half of those beyond a few, the ones first on which no call was served for longest, and none on
  /// which something happened just now. How many.
  std::size_t drop_of_most_crowded(std::size_t count, Clock::time_point now);

  std::size_t size() const;

 private:
  struct Connection {
    ConnectionId id = 0;
    dev_t device = 0;
    ino_t inode = 0;
    std::optional<Peer> peer;
    std::size_t calls = 0;
    std::size_t slicer_calls = 0;  // Of those.
    Clock::time_point idle_since;
    Clock::time_point served;         // When a call was served last,
    Clock::time_point whole;          // or a message had come in whole,
    std::int64_t received_bytes = 0;  // and what had come by then.
    std::int64_t known_bytes = 0;     // Of all messages that came in whole, and of the headers of all calls.
    std::optional<Clock::time_point> arriving_since{};  // Much has come since then that asks for nothing.
    bool dropped = false;
    std::shared_ptr<FrameGuard> guard{};
    std::unique_ptr<GuardedReads> reads{};
  };
  using Connections = std::unordered_map<int, Connection>;  // By their descriptors.

  void forget_left(Clock::time_point now);
  Connections::iterator forget(Connections::iterator connection);
  void drop_if_due(int descriptor, Connection& connection, Clock::time_point now, bool looks_closely,
                   Dropped& dropped) const;
  bool arrives_for_too_long(int socket, Connection& connection, Clock::time_point now) const;
  bool some_arrives(Clock::time_point now);
  static bool shut_down(int descriptor, Connection& connection);
  template <typename Ranked, typename ConnectionOf = std::identity>
  static std::size_t shut_down_first(const std::vector<Ranked>& ranked, std::size_t count,
                                     ConnectionOf connection_of = {});
  static std::int64_t unserved_bytes(int socket, const Connection& connection, Clock::time_point now);
  static std::int64_t counted_bytes(int socket, const Connection& connection, Clock::time_point now);
  void drop_greedy(Clock::time_point now, Dropped& dropped);

  const ConnectionLimits limits_;
  mutable std::mutex mutex_;
  Connections connections_;
  std::unordered_map<ConnectionId, int> descriptors_;
  std::map<Peer, ConnectionId> ids_;
  std::map<std::array<std::uint8_t, 16>, std::size_t> of_site_;
  ConnectionId last_id_ = 0;
  Clock::time_point looked_at_;          // For those that have left,
  Clock::time_point looked_closely_at_;  // and for what arrives for too long.
  std::size_t looks_ = 0;                // For what arrives.
  Dropped left_;                         // By their guards, since the last sweep.
};

}  // namespace ccslice::server
