// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A server for one run of the command line: a ccsliced of this machine that nobody else can reach.

#pragma once

#include <sys/types.h>

#include <string>

#include "client/client.h"

namespace ccslice::cli {

/// The path of a ccsliced: what the environment variable CCSLICED names, or the one in the folder of this program, or
/// beside that folder as in a build, or the first in PATH. Empty if there is none.
std::string find_ccsliced();

/// A ccsliced that runs as long as this object lives. It ends by itself if this program is killed.
class PrivateServer {
 public:
  /// Starts `program` and waits until it serves. Throws ClientError (UNAVAILABLE), saying why, if it doesn't, and if it
  /// doesn't before `call`'s deadline; CANCELLED_HERE if cancelled.
  PrivateServer(const std::string& program, const client::CallOptions& call);
  ~PrivateServer();
  PrivateServer(const PrivateServer&) = delete;
  PrivateServer& operator=(const PrivateServer&) = delete;

  /// For gRPC: "unix:...".
  const std::string& address() const { return address_; }

 private:
  void start(const std::string& program);
  void wait_until_it_serves(const std::string& program, const client::CallOptions& call);
  void stop() noexcept;

  pid_t process_ = -1;
  int input_ = -1;   // Closing it ends the server.
  int output_ = -1;  // Its first line is the address.
  std::string address_;
};

}  // namespace ccslice::cli
