// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/base/service_manager.h"

#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <cerrno>
#include <cstddef>
#include <cstring>

#include "server/service/base/descriptor.h"

namespace ccslice::server {
namespace {

/// Its system error, or 0.
int send_datagram(const std::string& path, const std::string& text) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.front() != '/' && path.front() != '@') return EAFNOSUPPORT;
  if (path.size() >= sizeof address.sun_path) return ENAMETOOLONG;
  path.copy(address.sun_path, path.size());
  if (path.front() == '@') address.sun_path[0] = '\0';
  const Descriptor socket(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (!socket) return errno;
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + path.size());
  const ssize_t sent =
      sendto(socket.get(), text.data(), text.size(), MSG_NOSIGNAL, reinterpret_cast<const sockaddr*>(&address), size);
  return sent < 0 ? errno : 0;
}

std::string microseconds(std::chrono::microseconds time) { return std::to_string(time.count()); }

}  // namespace

void ServiceManager::say_reloading() const {
  // Newer ones (systemd 253) want to know the time, so that they don't take an earlier message for this one.
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  send("RELOADING=1\nMONOTONIC_USEC=" + microseconds(std::chrono::duration_cast<std::chrono::microseconds>(now)));
}

void ServiceManager::say_stopping(std::chrono::microseconds longest) const {
  send("STOPPING=1\nSTATUS=stopping: running calls may end\nEXTEND_TIMEOUT_USEC=" + microseconds(longest));
}

void ServiceManager::send(const std::string& state) const {
  if (socket_.empty()) return;
  const int fault = send_datagram(socket_, state);
  if (fault == 0) return;
  spdlog::warn("can't tell the service manager at NOTIFY_SOCKET={}: {}", socket_, std::strerror(fault));
}

}  // namespace ccslice::server
