// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/network/http_server.h"

#include <httplib.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <semaphore>
#include <stdexcept>
#include <thread>
#include <utility>

#undef _res  // The resolver's, which isn't Eigen's.

namespace ccslice::server {
namespace {

using std::chrono::steady_clock;

constexpr std::size_t kHttpThreads = 8;
/// Of a connection, from the first byte it may send to the last of its answer.
constexpr auto kHttpPatience = std::chrono::seconds(2);
constexpr std::size_t kMostHttpBytes = 4096, kMostRequestBytes = 16 << 10;

/// A connection that ends at a deadline, however slowly its bytes come or go, and where more of them come than a
/// request may have: httplib's own patience is for one byte, and it takes any number of headers.
class TimedStream final : public httplib::Stream {
 public:
  explicit TimedStream(int socket) : socket_(socket), end_(steady_clock::now() + kHttpPatience) {}

  bool is_readable() const override { return wait_for(POLLIN); }
  bool is_writable() const override { return wait_for(POLLOUT); }
  ssize_t read(char* to, std::size_t size) override {
    const ssize_t read = is_readable() ? ::recv(socket_, to, std::min(size, left_), MSG_DONTWAIT) : -1;
    left_ -= static_cast<std::size_t>(std::max<ssize_t>(read, 0));
    return read;
  }
  /// All, or -1.
  ssize_t write(const char* from, std::size_t size) override {
    for (std::size_t sent = 0; sent < size;) {
      const ssize_t more = is_writable() ? ::send(socket_, from + sent, size - sent, MSG_DONTWAIT | MSG_NOSIGNAL) : -1;
      if (more < 0) return -1;
      sent += static_cast<std::size_t>(more);
    }
    return static_cast<ssize_t>(size);
  }
  void get_remote_ip_and_port(std::string& host, int& port) const override { name(&::getpeername, host, port); }
  void get_local_ip_and_port(std::string& host, int& port) const override { name(&::getsockname, host, port); }
  socket_t socket() const override { return socket_; }

 private:
  bool wait_for(short event) const {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end_ - steady_clock::now()).count();
    pollfd wait = {.fd = socket_, .events = event, .revents = 0};
    return left > 0 && ::poll(&wait, 1, static_cast<int>(left)) > 0;
  }

  void name(int (*ask)(int, sockaddr*, socklen_t*), std::string& host, int& port) const {
    sockaddr_storage address = {};
    socklen_t size = sizeof address;
    char host_text[NI_MAXHOST] = {}, port_text[NI_MAXSERV] = {};
    auto* const any = reinterpret_cast<sockaddr*>(&address);
    if (ask(socket_, any, &size) != 0) return;
    if (::getnameinfo(any, size, host_text, sizeof host_text, port_text, sizeof port_text,
                      NI_NUMERICHOST | NI_NUMERICSERV) != 0) {
      return;
    }
    host = host_text;
    port = std::atoi(port_text);
  }

  const int socket_;
  const steady_clock::time_point end_;
  std::size_t left_ = kMostRequestBytes;
};

/// Answers one request of each connection.
class TimedServer final : public httplib::Server {
 private:
  bool process_and_close_socket(socket_t socket) override {
    TimedStream stream(socket);
    bool closed = false;
    const bool answered = process_request(stream, true, closed, nullptr);
    ::shutdown(socket, SHUT_RDWR);
    ::close(socket);
    return answered;
  }
};

/// Accepts no connection that no thread is free for: those wait with the system and take no descriptor of ours.
class BoundedPool final : public httplib::TaskQueue {
 public:
  void enqueue(std::function<void()> serve) override {
    free_threads_.acquire();
    pool_.enqueue([this, serve = std::move(serve)] {
      serve();
      free_threads_.release();
    });
  }
  void shutdown() override { pool_.shutdown(); }

 private:
  std::counting_semaphore<> free_threads_{kHttpThreads};
  httplib::ThreadPool pool_{kHttpThreads};
};

}  // namespace

struct HttpServer::Impl {
  TimedServer server;
  std::thread thread;
};

HttpServer::HttpServer(const std::string& address, Page page) : impl_(std::make_unique<Impl>()) {
  httplib::Server& server = impl_->server;
  server.new_task_queue = [] { return new BoundedPool; };
  server.set_payload_max_length(kMostHttpBytes);
  // httplib would share the port with whoever asks for it.
  server.set_socket_options([](socket_t socket) {
    const int yes = 1;
    ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
  });
  // A thousand ranges of a page would be a thousand copies of it. Servers may ignore ranges.
  server.set_pre_routing_handler([](const httplib::Request& request, httplib::Response&) {
    const_cast<httplib::Request&>(request).ranges.clear();
    return httplib::Server::HandlerResponse::Unhandled;
  });
  server.Get(".*", [page = std::move(page)](const httplib::Request& request, httplib::Response& response) {
    const HttpAnswer answer = page(request.path);
    response.status = answer.status;
    response.set_content(answer.text, "text/plain; version=0.0.4; charset=utf-8");
  });
  const std::size_t colon = address.rfind(':');
  std::string host = address.substr(0, colon);
  if (host.starts_with('[')) host = host.substr(1, host.size() - 2);
  int port = std::stoi(address.substr(colon + 1));
  if (port == 0) {
    port = server.bind_to_any_port(host);
  } else if (!server.bind_to_port(host, port)) {
    port = -1;
  }
  if (port < 0) {
    throw std::runtime_error("can't listen on " + address +
                             " for HTTP: another program has the port, or this machine hasn't the address");
  }
  address_ = address.substr(0, colon + 1) + std::to_string(port);
  impl_->thread = std::thread([&server] { server.listen_after_bind(); });
  while (!server.is_running()) std::this_thread::yield();  // stop() before that would have no effect.
}

HttpServer::~HttpServer() {
  impl_->server.stop();
  impl_->thread.join();
}

}  // namespace ccslice::server
