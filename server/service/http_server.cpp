// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/http_server.h"

#include <httplib.h>

#include <stdexcept>
#include <thread>

#undef _res  // The resolver's, which isn't Eigen's.

namespace ccslice::server {
namespace {

constexpr std::size_t kHttpThreads = 8;
constexpr time_t kHttpPatienceS = 2;
constexpr std::size_t kMostHttpBytes = 4096;

}  // namespace

struct HttpServer::Impl {
  httplib::Server server;
  std::thread thread;
};

HttpServer::HttpServer(const std::string& address, Page page) : impl_(std::make_unique<Impl>()) {
  httplib::Server& server = impl_->server;
  server.new_task_queue = [] { return new httplib::ThreadPool(kHttpThreads); };
  server.set_read_timeout(kHttpPatienceS);
  server.set_write_timeout(kHttpPatienceS);
  server.set_keep_alive_max_count(1);  // A connection that waits would hold a thread.
  server.set_payload_max_length(kMostHttpBytes);
  // httplib would share the port with whoever asks for it.
  server.set_socket_options([](socket_t socket) {
    const int yes = 1;
    ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
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
