// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A server for one program alone, which started it (`ccsliced --private`): it listens on a Unix socket that no other
// user can reach, and lives as long as the pipe to its standard input.

#pragma once

#include <string>

namespace ccslice::server {

/// A folder that this user alone may enter, for a socket.
class PrivateSocket {
 public:
  /// Throws std::runtime_error if no folder can be made, or its name is too long for a socket's address.
  PrivateSocket();
  /// Removes the socket and its folder.
  ~PrivateSocket();
  PrivateSocket(const PrivateSocket&) = delete;
  PrivateSocket& operator=(const PrivateSocket&) = delete;

  /// "unix:/tmp/ccsliced-Ab12Cd/socket".
  std::string address() const { return "unix:" + path(); }

 private:
  std::string path() const { return folder_ + "/socket"; }

  std::string folder_;
};

/// Reads and drops what comes on a file descriptor, until its writers have closed it. A killed program closes it too.
void wait_for_end_of_input(int descriptor);

}  // namespace ccslice::server
