// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A TCP proxy on this machine whose first connections break after so many bytes from the server, as networks do.

#pragma once

#include <atomic>
#include <cstddef>
#include <string>
#include <thread>
#include <vector>

namespace ccslice::client {

class CuttingProxy {
 public:
  /// Forwards to 127.0.0.1:`port`; the i-th connection breaks after `cuts[i]` bytes, later ones never.
  CuttingProxy(int port, std::vector<std::size_t> cuts);
  ~CuttingProxy();
  CuttingProxy(const CuttingProxy&) = delete;
  CuttingProxy& operator=(const CuttingProxy&) = delete;

  const std::string& address() const { return address_; }
  int connections() const { return connections_; }

 private:
  void accept_all();
  void forward(int client, std::size_t cut);
  int connect_to_server() const;

  const int port_;
  const std::vector<std::size_t> cuts_;
  int listener_ = -1;
  std::string address_;
  std::atomic<int> connections_ = 0;
  std::atomic<bool> stop_ = false;
  std::vector<std::thread> forwarders_;
  std::thread acceptor_;
};

}  // namespace ccslice::client
