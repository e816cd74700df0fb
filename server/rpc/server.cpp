// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/server.h"

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/server_builder.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <mutex>

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

/// What calls have for ending by themselves once they are cut off: they say why, which gRPC's own cancelling doesn't.
constexpr std::chrono::milliseconds kCutOff = 200ms;
/// What clients have for taking the status of a cancelled call.
constexpr std::chrono::milliseconds kLastWords = 1s;

void enable_extras() {
  static std::once_flag once;
  std::call_once(once, [] {
    grpc::EnableDefaultHealthCheckService(true);
    grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  });
}

std::string with_port(const std::string& listen_address, int port) {
  if (listen_address.starts_with("unix:")) return listen_address;
  return listen_address.substr(0, listen_address.rfind(':') + 1) + std::to_string(port);
}

/// Idle connections are probed, so that the calls of a client that vanished without a word end too.
void set_channel_arguments(const ServerOptions& options, grpc::ServerBuilder& builder) {
  builder.SetMaxReceiveMessageSize(static_cast<int>(options.max_message_bytes));
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, static_cast<int>(options.max_connection_streams));
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 30'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 5'000);
}

}  // namespace

Server::Server(const ServerOptions& options) : state_(options), service_(state_) {
  enable_extras();
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort(options.listen_address, grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(&service_);
  set_channel_arguments(options, builder);
  server_ = builder.BuildAndStart();
  if (!server_ || (port == 0 && !options.listen_address.starts_with("unix:"))) {
    throw std::runtime_error("can't listen on " + options.listen_address + ": is the port taken, or not allowed?");
  }
  address_ = with_port(options.listen_address, port);
  server_->GetHealthCheckService()->SetServingStatus(true);
  server_->GetHealthCheckService()->SetServingStatus(v1::SlicerService::service_full_name(), true);
}

Server::~Server() {
  begin_shut_down();
  shut_down_.wait();
}

bool Server::drain(std::chrono::milliseconds grace, const std::function<bool()>& hurry) {
  const auto end = std::chrono::steady_clock::now() + grace;
  server_->GetHealthCheckService()->SetServingStatus(false);
  server_->GetHealthCheckService()->SetServingStatus(v1::SlicerService::service_full_name(), false);
  state_.calls.drain();
  bool idle = false;
  while (!idle && !hurry() && std::chrono::steady_clock::now() < end) {
    idle = state_.calls.wait_idle(std::min(end, std::chrono::steady_clock::now() + 50ms));
  }
  if (!idle) {
    spdlog::warn("{} calls are still open: cutting them off", state_.calls.open());
    state_.calls.cut_off_all();
    (void)state_.calls.wait_idle(std::chrono::steady_clock::now() + kCutOff);  // Nothing is left to do for the rest.
  }
  begin_shut_down();
  return shut_down_.wait_for(kLastWords) == std::future_status::ready;
}

/// On a thread of its own: it comes back only when every connection has taken what was being written to it.
void Server::begin_shut_down() {
  if (shut_down_.valid()) return;
  shut_down_ = std::async(std::launch::async, [this] {
    server_->Shutdown(std::chrono::system_clock::now() + 100ms);
    server_->Wait();
  });
}

}  // namespace ccslice::server
