// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Tells whoever manages services how this one is: systemd, whose units say Type=notify. A message is a datagram of
// lines NAME=VALUE to the Unix socket that NOTIFY_SOCKET names, as sd_notify(3) describes it. That is little enough to
// do without libsystemd, which would bring its own dependencies into every image.

#pragma once

#include <chrono>
#include <string>
#include <utility>

namespace ccslice::server {

class ServiceManager {
 public:
  /// `socket`: an absolute path, or "@" and a name of Linux's abstract ones. Empty: nobody wants to know.
  explicit ServiceManager(std::string socket) : socket_(std::move(socket)) {}

  /// It serves, or serves on after it has reloaded. `status`: a line for people.
  void say_ready(const std::string& status) const { send("READY=1\nSTATUS=" + status); }
  /// It reads files again, until it says that it is ready.
  void say_reloading() const;
  /// It stops, and may take this long: however short the unit's own patience is.
  void say_stopping(std::chrono::microseconds longest) const;

 private:
  /// Where nobody listens, the log says so, and the server goes on.
  void send(const std::string& state) const;

  std::string socket_;
};

}  // namespace ccslice::server
