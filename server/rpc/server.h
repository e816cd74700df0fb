// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A running server: the service, grpc.health.v1 and reflection on one port.

#pragma once

#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>

#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <stdexcept>
#include <string>

#include "server/rpc/service_state.h"
#include "server/rpc/slicer_service.h"
#include "server/service/connection_listener.h"

namespace ccslice::server {

class Server {
 public:
  /// Serves from here on. Throws std::runtime_error if it can't listen on the address.
  explicit Server(const ServerOptions& options);
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

  /// Health turns NOT_SERVING, new calls are refused, running ones may go on until the grace period is over or `hurry`
  /// says so (asked about every 50 ms); then they are cut off with SERVER_SHUTTING_DOWN, and what can't even take that
  /// is cancelled. Whether none is left; if not, some client has stopped reading with its connection full, and gRPC
  /// would wait for it.
  [[nodiscard]] bool drain(
      std::chrono::milliseconds grace, const std::function<bool()>& hurry = [] { return false; });

 private:
  /// Gives gRPC a connection.
  void hand_over(int descriptor);
  /// Takes no more connections and calls, and cancels those calls that are left.
  void begin_shut_down();

  ServiceState state_;
  SlicerService service_;
  ConnectionListener listener_;
  std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor_;
  std::unique_ptr<grpc::Server> server_;
  std::future<void> shut_down_;  // Once begun: over when it is ready.
};

}  // namespace ccslice::server
