// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/network/listen_socket.h"

#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <system_error>

namespace ccslice::server {
namespace {

constexpr int kSocketFlags = SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC;

std::runtime_error cannot_listen(const std::string& address, const std::string& why) {
  return std::runtime_error("can't listen on " + address + ": " + why + "; choose another address with --listen");
}

/// Keeps errno's words and the call's, for the last address that failed.
struct Opened {
  Descriptor socket;
  int error = 0;
};

void set_flag(int socket, int level, int option, int value) {
  (void)setsockopt(socket, level, option, &value, sizeof value);  // Nothing depends on it but comfort.
}

Opened listen_on(const sockaddr* address, socklen_t size) {
  Descriptor socket(::socket(address->sa_family, kSocketFlags, 0));
  if (!socket) return {.socket = {}, .error = errno};
  if (address->sa_family != AF_UNIX) set_flag(socket.get(), SOL_SOCKET, SO_REUSEADDR, 1);
  if (address->sa_family == AF_INET6) {
    const auto* six = reinterpret_cast<const sockaddr_in6*>(address);
    set_flag(socket.get(), IPPROTO_IPV6, IPV6_V6ONLY, IN6_IS_ADDR_UNSPECIFIED(&six->sin6_addr) ? 0 : 1);
  }
  if (bind(socket.get(), address, size) != 0 || listen(socket.get(), SOMAXCONN) != 0) {
    return {.socket = {}, .error = errno};
  }
  return {.socket = std::move(socket), .error = 0};
}

int port_of(const Descriptor& socket) {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  if (getsockname(socket.get(), reinterpret_cast<sockaddr*>(&address), &size) != 0) return 0;
  if (address.ss_family == AF_INET6) return ntohs(reinterpret_cast<const sockaddr_in6*>(&address)->sin6_port);
  return ntohs(reinterpret_cast<const sockaddr_in*>(&address)->sin_port);
}

void set_port(sockaddr* address, int port) {
  const std::uint16_t number = htons(static_cast<std::uint16_t>(port));
  if (address->sa_family == AF_INET6) {
    reinterpret_cast<sockaddr_in6*>(address)->sin6_port = number;
  } else {
    reinterpret_cast<sockaddr_in*>(address)->sin_port = number;
  }
}

using Addresses = std::unique_ptr<addrinfo, decltype(&freeaddrinfo)>;

Addresses addresses_of(const std::string& host, const std::string& port, const std::string& shown) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  const int error = getaddrinfo(host.c_str(), port.c_str(), &hints, &found);
  if (error != 0) throw cannot_listen(shown, gai_strerror(error));
  return {found, freeaddrinfo};
}

std::string without_brackets(const std::string& host) {
  return host.size() > 2 && host.front() == '[' && host.back() == ']' ? host.substr(1, host.size() - 2) : host;
}

bool is_any(const std::string& host) { return host == "*" || host == "0.0.0.0" || host == "::"; }

bool somebody_listens(const sockaddr_un& address) {
  const Descriptor probe(::socket(AF_UNIX, kSocketFlags, 0));
  return probe && (connect(probe.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 ||
                   errno == EAGAIN);  // Its queue is full.
}

}  // namespace

ListenSockets::ListenSockets(const std::string& address) : address_(address) {
  if (address.starts_with("unix:")) {
    path_ = address.substr(address.starts_with("unix://") ? 7 : 5);
    listen_on_path();
  } else {
    listen_on_port();
  }
}

void ListenSockets::close() noexcept {
  if (is_unix() && !descriptors_.empty()) unlink(path_.c_str());
  descriptors_.clear();
}

void ListenSockets::listen_on_path() {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path_.size() >= sizeof address.sun_path) throw cannot_listen(address_, "the path is too long for a socket");
  std::copy(path_.begin(), path_.end(), address.sun_path);
  struct stat file {};
  if (stat(path_.c_str(), &file) == 0 && S_ISSOCK(file.st_mode)) {
    if (somebody_listens(address)) throw cannot_listen(address_, "another server listens there");
    unlink(path_.c_str());
  }
  Opened opened = listen_on(reinterpret_cast<const sockaddr*>(&address), sizeof address);
  if (!opened.socket) throw cannot_listen(address_, std::strerror(opened.error));
  descriptors_.push_back(std::move(opened.socket));
}

void ListenSockets::listen_on_port() {
  const std::size_t colon = address_.rfind(':');
  const std::string host = without_brackets(address_.substr(0, colon)), text = address_.substr(colon + 1);
  int port = std::stoi(text), error = 0;
  const auto take = [&](const Addresses& addresses) {
    for (addrinfo* each = addresses.get(); each != nullptr; each = each->ai_next) {
      set_port(each->ai_addr, port);  // A free one that the first address took is everybody's.
      Opened opened = listen_on(each->ai_addr, each->ai_addrlen);
      if (!opened.socket) {
        error = opened.error;
        continue;
      }
      port = port_of(opened.socket);
      descriptors_.push_back(std::move(opened.socket));
    }
  };
  // [::] takes IPv4 too. Machines without IPv6 have 0.0.0.0.
  take(addresses_of(is_any(host) ? "::" : host, text, address_));
  if (descriptors_.empty() && is_any(host) && error != EADDRINUSE) take(addresses_of("0.0.0.0", text, address_));
  if (descriptors_.empty()) throw cannot_listen(address_, std::strerror(error));
  address_ = address_.substr(0, colon + 1) + std::to_string(port);
}

}  // namespace ccslice::server
