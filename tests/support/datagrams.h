// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <stdexcept>
#include <string>

#include "tests/support/temporary_folder.h"

namespace ccslice {

/// What comes to a Unix socket for datagrams, as a service manager's is.
class Datagrams {
 public:
  /// `abstract`: under a name of Linux's own instead of a file's.
  explicit Datagrams(bool abstract = false)
      : name_((abstract ? "@" : "") + (folder_.path() / "notify").string()),
        socket_(socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    name_.copy(address.sun_path, sizeof address.sun_path - 1);
    if (abstract) address.sun_path[0] = '\0';
    const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name_.size());
    if (bind(socket_, reinterpret_cast<const sockaddr*>(&address), size) != 0) {
      throw std::runtime_error("can't listen on " + name_);
    }
  }
  ~Datagrams() { close(socket_); }
  Datagrams(const Datagrams&) = delete;
  Datagrams& operator=(const Datagrams&) = delete;

  /// As NOTIFY_SOCKET has it.
  const std::string& name() const { return name_; }

  /// Waits for one; empty if none comes.
  std::string next(std::chrono::milliseconds limit) const {
    pollfd waiting{.fd = socket_, .events = POLLIN, .revents = 0};
    if (poll(&waiting, 1, static_cast<int>(limit.count())) != 1) return "";
    std::array<char, 4096> text;
    const ssize_t size = recv(socket_, text.data(), text.size(), 0);
    return size < 0 ? "" : std::string(text.data(), static_cast<std::size_t>(size));
  }

 private:
  TemporaryFolder folder_;
  std::string name_;
  int socket_;
};

}  // namespace ccslice
