// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/server.h"

#include <google/protobuf/stubs/logging.h>
#include <grpc/support/log.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/resource_quota.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <mutex>
#include <stdexcept>
#include <string>

#include "server/rpc/count_calls.h"

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

/// What calls have for ending by themselves once they are cut off: they say why, which gRPC's own cancelling doesn't.
constexpr std::chrono::milliseconds kCutOff = 200ms;
/// What clients have for taking the status of a cancelled call.
constexpr std::chrono::milliseconds kLastWords = 1s;
/// What clients have for the beginning of HTTP/2.
constexpr std::chrono::milliseconds kHandshake = 20s;

/// What gRPC and protobuf say of their insides, and of what clients send, is for those who look for a fault there. They
/// would write to standard error themselves, and calls would wait for whoever reads it.
void log_of_grpc(gpr_log_func_args* line) { spdlog::debug("gRPC: {}", line->message); }
void log_of_protobuf(google::protobuf::LogLevel, const char*, int, const std::string& message) {
  spdlog::debug("protobuf: {}", message);
}

void enable_extras() {
  static std::once_flag once;
  std::call_once(once, [] {
    gpr_set_log_function(log_of_grpc);
    google::protobuf::SetLogHandler(log_of_protobuf);
    grpc::EnableDefaultHealthCheckService(true);
    grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  });
}

/// gRPC takes no time of 0, which is never here.
int to_ms(std::chrono::milliseconds time) {
  constexpr int kNever = std::numeric_limits<int>::max();
  return time.count() == 0 ? kNever : static_cast<int>(std::min<std::int64_t>(time.count(), kNever));
}

/// Idle connections are probed, so that the calls of a client that vanished without a word end too. One that doesn't
/// even begin to speak HTTP/2 isn't waited for.
void set_channel_arguments(const ServerOptions& options, grpc::ServerBuilder& builder) {
  grpc::ResourceQuota quota("connections");
  quota.Resize(options.connection_budget_bytes);
  builder.SetResourceQuota(quota);
  builder.SetMaxReceiveMessageSize(static_cast<int>(options.max_message_bytes));
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, static_cast<int>(options.max_connection_streams));
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, static_cast<int>(kHandshake.count()));
  builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_IDLE_MS, to_ms(options.connection_idle));
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 30'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 5'000);
}

}  // namespace

Server::Server(const ServerOptions& options)
    : state_(options),
      service_(state_),
      listener_(options.listen_address, connection_limits(options, connection_descriptors())) {
  enable_extras();
  grpc::ServerBuilder builder;
  acceptor_ = builder.experimental().AddExternalConnectionAcceptor(
      grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD, grpc::InsecureServerCredentials());
  builder.experimental().SetInterceptorCreators(count_calls(listener_.connections()));
  builder.RegisterService(&service_);
  set_channel_arguments(options, builder);
  server_ = builder.BuildAndStart();
  if (!server_) throw std::runtime_error("gRPC's server doesn't start; --log-level debug says why");
  server_->GetHealthCheckService()->SetServingStatus(true);
  server_->GetHealthCheckService()->SetServingStatus(v1::SlicerService::service_full_name(), true);
  listener_.start([this](int descriptor) { hand_over(descriptor); });
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
  state_.admission.drain();
  bool idle = state_.calls.open() == 0;
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

void Server::hand_over(int descriptor) {
  grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters connection;
  connection.fd = descriptor;
  acceptor_->HandleNewConnection(&connection);
}

/// gRPC would forget to close a connection that comes from here on.
///
/// On a thread of its own: it comes back only when every connection has taken what was being written to it.
void Server::begin_shut_down() {
  if (shut_down_.valid()) return;
  listener_.stop();
  shut_down_ = std::async(std::launch::async, [this] {
    server_->Shutdown(std::chrono::system_clock::now() + 100ms);
    server_->Wait();
  });
}

}  // namespace ccslice::server
