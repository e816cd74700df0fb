// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Sockets that listen: on a name's or a number's port, on all addresses of this machine, or on a Unix socket.

#pragma once

#include <string>
#include <vector>

#include "server/service/base/descriptor.h"

namespace ccslice::server {

/// Takes an address from its construction on.
class ListenSockets {
 public:
  /// `address`: HOST:PORT, [IPV6]:PORT or unix:PATH. A name listens on all of its addresses that this machine has;
  /// 0.0.0.0, [::] and * on all of this machine's, of both kinds. Port 0 takes a free one. A Unix socket that nobody
  /// listens on any more is replaced. Throws std::runtime_error: why not, and what to do.
  explicit ListenSockets(const std::string& address);
  ~ListenSockets() { close(); }
  ListenSockets(const ListenSockets&) = delete;
  ListenSockets& operator=(const ListenSockets&) = delete;

  /// `address` with the port that was taken.
  const std::string& address() const noexcept { return address_; }
  bool is_unix() const noexcept { return !path_.empty(); }
  const std::vector<Descriptor>& descriptors() const noexcept { return descriptors_; }
  /// Lets the address go, and refuses the connections that wait. Removes a Unix socket's file.
  void close() noexcept;

 private:
  void listen_on_path();
  void listen_on_port();

  std::string address_;
  std::string path_;  // Of a Unix socket.
  std::vector<Descriptor> descriptors_;
};

}  // namespace ccslice::server
