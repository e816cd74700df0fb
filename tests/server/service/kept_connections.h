// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Connections that come to a listener and stay.

#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "server/service/network/connection_listener.h"

namespace ccslice::server {

/// Serves connections by keeping them until it is told to close them.
class Keeper {
 public:
  explicit Keeper(const ConnectionLimits& limits, const std::string& address = "127.0.0.1:0",
                  ConnectionListener::IsCrowded is_crowded = {})
      : listener_(address, limits) {
    const auto keep = [this](int descriptor) {
      const std::lock_guard lock(mutex_);
      kept_.emplace_back(descriptor);
    };
    listener_.start(keep, std::move(is_crowded));
  }
  ~Keeper() { listener_.stop(); }

  const std::string& address() const { return listener_.address(); }
  ConnectionTable& table() { return listener_.connections(); }
  std::size_t kept() {
    const std::lock_guard lock(mutex_);
    return kept_.size();
  }
  bool comes_to_keep(std::size_t connections) {
    for (int i = 0; i < 500 && kept() != connections; ++i) usleep(10'000);
    return kept() == connections;
  }
  bool keeps(const Peer& peer) {
    const std::lock_guard lock(mutex_);
    return std::ranges::any_of(kept_, [&](const Descriptor& each) {
      sockaddr_storage address{};
      socklen_t size = sizeof address;
      getpeername(each.get(), reinterpret_cast<sockaddr*>(&address), &size);
      return peer_of(address) == peer;
    });
  }
  void close_all() {
    const std::lock_guard lock(mutex_);
    kept_.clear();
  }
  /// Takes in what has come: the system keeps only so much.
  void read_all() {
    const std::lock_guard lock(mutex_);
    std::string bytes(1 << 20, '\0');
    for (const Descriptor& each : kept_) {
      while (read(each.get(), bytes.data(), bytes.size()) > 0) {
      }
    }
  }
  /// Over the connection that came last, as much as it takes in now. How much that was.
  std::size_t send(const std::string& bytes) {
    const std::lock_guard lock(mutex_);
    return static_cast<std::size_t>(std::max<ssize_t>(write(kept_.back().get(), bytes.data(), bytes.size()), 0));
  }

 private:
  std::mutex mutex_;
  std::vector<Descriptor> kept_;
  ConnectionListener listener_;
};

/// A connection from one of this machine's addresses, 127.0.0.x.
inline Descriptor call_from(const std::string& source, const std::string& address) {
  Descriptor socket(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in from{}, to{};
  from.sin_family = to.sin_family = AF_INET;
  inet_pton(AF_INET, source.c_str(), &from.sin_addr);
  const std::size_t colon = address.rfind(':');
  inet_pton(AF_INET, address.substr(0, colon).c_str(), &to.sin_addr);
  to.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(colon + 1))));
  EXPECT_EQ(bind(socket.get(), reinterpret_cast<const sockaddr*>(&from), sizeof from), 0);
  EXPECT_EQ(connect(socket.get(), reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
  return socket;
}

inline Peer own_address(const Descriptor& socket) {
  sockaddr_storage own{};
  socklen_t size = sizeof own;
  getsockname(socket.get(), reinterpret_cast<sockaddr*>(&own), &size);
  return *peer_of(own);
}

/// Whether the other end closes, or has closed, this connection.
inline bool is_closed_soon(const Descriptor& socket, int limit_ms = 5000) {
  pollfd wait{.fd = socket.get(), .events = POLLIN, .revents = 0};
  char byte = 0;
  return poll(&wait, 1, limit_ms) == 1 && read(socket.get(), &byte, 1) <= 0;
}

inline ConnectionLimits limits(std::size_t connections, std::size_t per_address) {
  return {.connections = connections, .per_address = per_address, .idle = {}, .arriving = {}};
}

}  // namespace ccslice::server
