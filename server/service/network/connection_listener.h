// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Accepts connections and hands them to whoever serves them, as many as there may be.
//
//     accept -> too many in all, or of this address? close : wait for a turn -> hand over
//
// They are handed over at once, but where memory may run short: then one of each address in turn, so that nobody waits
// behind all who come from another one.
//
// Where descriptors run out, of this process or of the machine, it gives up one that it keeps for that, accepts with
// it and closes the connection at once. So those who come meanwhile are refused and don't wait, and it goes on as soon
// as there are descriptors again.

#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "server/service/network/connection_table.h"
#include "server/service/network/listen_socket.h"

namespace ccslice::server {

/// Raises this process's limit of open files as far as it may. What connections may have of it: all but a reserve.
std::size_t connection_descriptors();

class ConnectionListener {
 public:
  /// Takes a connection's descriptor, and with it the duty to close it. On the listener's thread.
  using HandOver = std::function<void(int descriptor)>;

  /// Takes the address, and lets connections wait. Throws as ListenSockets does.
  ConnectionListener(const std::string& address, const ConnectionLimits& limits);
  /// Stops.
  ~ConnectionListener();
  ConnectionListener(const ConnectionListener&) = delete;
  ConnectionListener& operator=(const ConnectionListener&) = delete;

  const std::string& address() const noexcept { return sockets_.address(); }
  ConnectionTable& connections() noexcept { return table_; }

  /// Memory may run short, once connections that were just taken have begun what they may. On the listener's thread.
  using IsCrowded = std::function<bool(std::size_t just_taken)>;

  /// Accepts from here on. Once. While it is crowded, connections are handed over one by one, some 20 a second: what
  /// comes over the last ones has to show, and others to leave, before there are more.
  void start(HandOver hand_over, IsCrowded is_crowded = {});
  /// Hands over no more connections once this has come back, and lets the address go.
  void stop();

 private:
  struct Waiting {
    Descriptor connection;
    std::shared_ptr<FrameGuard> guard;
  };
  using Site = std::array<std::uint8_t, 16>;

  void run();
  /// Waits for a connection, for the next turn, or for stop(). The sockets that have one.
  std::vector<int> wait_for_connections() const;
  void accept_waiting(int listener);
  void take(Descriptor connection, const sockaddr_storage& address);
  void hand_over(Waiting waiting);
  /// In turn, until it is crowded.
  void hand_over_waiting();
  Waiting next_waiting();
  /// Whether there was a connection to refuse.
  bool refuse_with_spare(int listener);
  std::size_t count_just_taken();
  void sweep();
  void report_refusals();

  const ConnectionLimits limits_;
  ListenSockets sockets_;
  ConnectionTable table_;
  HandOver hand_over_;
  IsCrowded is_crowded_;
  Descriptor spare_;       // For refusing connections where there is no other one.
  Descriptor stop_event_;  // Readable from stop() on.
  bool resting_ = false;   // Not even the spare one is left: looks again soon.
  std::map<Site, std::deque<Waiting>> waiting_;
  std::deque<Site> turns_;  // Of those.
  std::chrono::steady_clock::time_point crowded_until_, swept_, reported_, counted_;
  std::size_t taken_ = 0, taken_before_ = 0;  // Since counted_, and in as long before that.
  std::size_t slowed_ = 0, refused_ = 0, refused_of_address_ = 0, refused_without_descriptor_ = 0, dropped_greedy_ = 0;
  std::size_t dropped_of_headers_ = 0, dropped_of_calls_ = 0;
  std::thread thread_;
};

}  // namespace ccslice::server
