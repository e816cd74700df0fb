// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A running server: the service, grpc.health.v1 and reflection on one port.

#pragma once

#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <stdexcept>
#include <string>

#include "server/rpc/calls/service_state.h"
#include "server/rpc/server/slicer_service.h"
#include "server/service/meshes/mesh_room.h"
#include "server/service/network/certificates.h"
#include "server/service/network/connection_listener.h"
#include "server/service/network/http_server.h"

namespace ccslice::server {

class Server {
 public:
  /// Serves from here on. `stops` is asked while meshes are made ready beforehand, and ends that. Throws
  /// std::runtime_error if it can't listen on the address.
  explicit Server(
      const ServerOptions& options, const std::function<bool()>& stops = [] { return false; });
  /// Cancels what is running, and waits for clients to take what is being written to them.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// The address to connect to: that of the options, with the port that was taken.
  const std::string& address() const noexcept { return listener_.address(); }
  ServiceState& state() noexcept { return state_; }

  /// Drops expired meshes, ends calls whose clients are silent, has those shed what they hold whose clients lag, and
  /// gives memory back to the machine. To be called now and then.
  void sweep() {
    state_.cache.sweep();
    state_.idle_watch.sweep();
    state_.preview_watch.sweep();
    state_.heap_trim.sweep();
  }

  /// Has calls shed whose clients lag, if others wait for memory. What they keep all the same, the messages being sent,
  /// counts nowhere: ends some of them where the process comes near the memory it should do with. To be called more
  /// often than sweep().
  void relieve();

  /// Takes new tokens and certificates, if their files have changed or if told so, and ends calls whose clients may not
  /// make them any more.
  void reload(bool always);

  /// Health turns NOT_SERVING; calls are taken as before.
  void say_not_serving();

  /// Where figures are served; empty if they aren't.
  std::string metrics_address() const { return metrics_ ? metrics_->address() : ""; }
  /// Where health alone is served; empty if it isn't.
  std::string health_address() const { return health_ ? health_->listener.address() : ""; }

  /// Health turns NOT_SERVING, new calls are refused, running ones may go on until the grace period is over or `hurry`
  /// says so (asked about every 50 ms); then they are cut off with SERVER_SHUTTING_DOWN, and what can't even take that
  /// is cancelled. Whether none is left; if not, some client has stopped reading with its connection full, and gRPC
  /// would wait for it.
  [[nodiscard]] bool drain(
      std::chrono::milliseconds grace, const std::function<bool()>& hurry = [] { return false; });

 private:
  using Acceptor = grpc::experimental::ExternalConnectionAcceptor;
  /// A server of grpc.health.v1 alone.
  struct HealthServer {
    explicit HealthServer(const std::string& address);
    ~HealthServer();
    ConnectionListener listener;
    std::unique_ptr<Acceptor> acceptor;
    std::unique_ptr<grpc::Server> server;
  };

  bool takes_too_much(std::uint64_t expected_bytes = 0);
  std::uint64_t most_of_connection() const;
  void make_room();
  /// Gives gRPC a connection.
  static void hand_over(Acceptor& acceptor, int descriptor);
  std::shared_ptr<grpc::ServerCredentials> credentials() const;
  void serve_figures();
  /// Takes no more connections and calls, and cancels those calls that are left.
  void begin_shut_down();

  ServiceState state_;
  std::chrono::steady_clock::time_point relieved_;  // When memory ran short last.
  std::chrono::steady_clock::time_point checked_;   // When calls looked whether their clients may still make them.
  RefusedClients refused_;
  SlicerService service_;
  ConnectionListener listener_;
  std::unique_ptr<ServedCertificates> certificates_;  // None: no TLS.
  std::unique_ptr<Acceptor> acceptor_;
  std::unique_ptr<grpc::Server> server_;
  std::unique_ptr<HealthServer> health_;
  std::atomic<bool> ready_{true};
  std::unique_ptr<HttpServer> metrics_;
  std::future<void> shut_down_;  // Once begun: over when it is ready.
};

}  // namespace ccslice::server
