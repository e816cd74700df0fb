// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/client/cutting_proxy.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <limits>
#include <stdexcept>
#include <utility>

namespace ccslice::client {
namespace {

sockaddr_in loopback(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  return address;
}

bool write_all(int socket, const char* bytes, ssize_t count) {
  while (count > 0) {
    const ssize_t written = send(socket, bytes, static_cast<std::size_t>(count), MSG_NOSIGNAL);
    if (written <= 0) return false;
    bytes += written;
    count -= written;
  }
  return true;
}

}  // namespace

CuttingProxy::CuttingProxy(int port, std::vector<std::size_t> cuts) : port_(port), cuts_(std::move(cuts)) {
  listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address = loopback(0);
  socklen_t size = sizeof(address);
  if (bind(listener_, reinterpret_cast<sockaddr*>(&address), size) != 0 || listen(listener_, 8) != 0) {
    throw std::runtime_error("the proxy can't listen");
  }
  getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
  address_ = "127.0.0.1:" + std::to_string(ntohs(address.sin_port));
  acceptor_ = std::thread([this] { accept_all(); });
}

CuttingProxy::~CuttingProxy() {
  stop_ = true;
  acceptor_.join();
  for (std::thread& forwarder : forwarders_) forwarder.join();
  close(listener_);
}

void CuttingProxy::accept_all() {
  while (!stop_) {
    pollfd waiting{listener_, POLLIN, 0};
    constexpr int kPollMs = 20;
    if (poll(&waiting, 1, kPollMs) <= 0) continue;
    const int client = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (client < 0) continue;
    const auto index = static_cast<std::size_t>(connections_++);
    const std::size_t cut = index < cuts_.size() ? cuts_[index] : std::numeric_limits<std::size_t>::max();
    forwarders_.emplace_back([this, client, cut] { forward(client, cut); });
  }
}

int CuttingProxy::connect_to_server() const {
  const int server = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const sockaddr_in address = loopback(port_);
  if (connect(server, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    close(server);
    return -1;
  }
  return server;
}

void CuttingProxy::forward(int client, std::size_t cut) {
  const int server = connect_to_server();
  std::size_t passed = 0;
  std::array<char, 4096> buffer;
  bool open = server >= 0;
  while (open && !stop_ && passed < cut) {
    std::array<pollfd, 2> waiting = {{{client, POLLIN, 0}, {server, POLLIN, 0}}};
    constexpr int kPollMs = 20;
    poll(waiting.data(), waiting.size(), kPollMs);
    for (std::size_t from = 0; from < 2 && open; ++from) {
      if (!waiting[from].revents) continue;
      const ssize_t count = read(waiting[from].fd, buffer.data(), buffer.size());
      open = count > 0 && write_all(waiting[1 - from].fd, buffer.data(), count);
      if (from == 1 && count > 0) passed += static_cast<std::size_t>(count);
    }
  }
  close(client);
  if (server >= 0) close(server);
}

}  // namespace ccslice::client
