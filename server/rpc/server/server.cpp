// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/server/server.h"

#include <google/protobuf/stubs/logging.h>
#include <grpc/support/log.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/resource_quota.h>
#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdint>
#include <future>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/rpc/calls/count_calls.h"
#include "server/rpc/calls/load_mesh.h"
#include "server/rpc/server/metrics_page.h"
#include "server/service/base/logging.h"

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

/// What calls have for ending by themselves once they are cut off: they say why, which gRPC's own cancelling doesn't.
constexpr std::chrono::milliseconds kCutOff = 200ms;
/// What clients have for taking the status of a cancelled call.
constexpr std::chrono::milliseconds kLastWords = 1s;
/// What clients have for the beginning of HTTP/2.
constexpr std::chrono::milliseconds kHandshake = 20s;

constexpr std::size_t kHealthConnections = 256;
constexpr int kHealthMessageBytes = 4096, kHealthStreams = 16;
/// How often gRPC looks for renewed certificates.
constexpr unsigned int kLookAtCertificatesS = 1;

void set_serving(grpc::Server& server, bool serving) {
  server.GetHealthCheckService()->SetServingStatus(serving);
  server.GetHealthCheckService()->SetServingStatus(v1::SlicerService::service_full_name(), serving);
}

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

/// A message that is compressed is bounded before it is inflated only: 4 MB of it can become 4 GB.
void take_no_compressed_messages(grpc::ServerBuilder& builder) {
  builder.AddChannelArgument(GRPC_COMPRESSION_CHANNEL_ENABLED_ALGORITHMS_BITSET, 1 << GRPC_COMPRESS_NONE);
  builder.AddChannelArgument(GRPC_ARG_ENABLE_PER_MESSAGE_DECOMPRESSION, 0);
}

constexpr int kThreadsOfReflection = 16;  // gRPC gives each of its streams one.

/// Idle connections are probed, so that the calls of a client that vanished without a word end too. One that doesn't
/// even begin to speak HTTP/2 isn't waited for.
void set_channel_arguments(const ServerOptions& options, grpc::ServerBuilder& builder) {
  grpc::ResourceQuota quota("connections");
  quota.Resize(options.connection_budget_bytes);
  quota.SetMaxThreads(kThreadsOfReflection);
  builder.SetResourceQuota(quota);
  take_no_compressed_messages(builder);
  builder.SetMaxReceiveMessageSize(static_cast<int>(options.max_message_bytes));
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, static_cast<int>(options.max_connection_streams));
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, static_cast<int>(kHandshake.count()));
  builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_IDLE_MS, to_ms(options.connection_idle));
  if (options.max_connection_age.count() > 0) {
    builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_AGE_MS, to_ms(options.max_connection_age));
    builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_AGE_GRACE_MS, to_ms(options.shutdown_grace));
  }
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 30'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 5'000);
}

/// Before the address is taken, so that clients go elsewhere meanwhile. Those that were used last are prepared last:
/// the cache keeps them if it hasn't room for all.
ServiceState& warmed_up(ServiceState& state, const std::function<bool()>& stops) {
  constexpr std::chrono::milliseconds kBetweenLooks(50);
  if (!state.store || state.options.warm_meshes == 0) return state;
  std::vector<std::string> ids = state.store->last_used(state.options.warm_meshes);
  std::reverse(ids.begin(), ids.end());
  std::size_t prepared = 0;
  for (const std::string& id : ids) {
    if (stops()) return state;
    const auto promise = std::make_shared<std::promise<bool>>();
    const auto load = std::make_shared<MeshLoad>(
        [promise](const MeshPtr& mesh, const std::exception_ptr&) { promise->set_value(mesh != nullptr); });
    load->begin(state, id, "");
    std::future<bool> has_mesh = promise->get_future();
    while (has_mesh.wait_for(kBetweenLooks) != std::future_status::ready) {
      if (!stops()) continue;
      load->cancel();
      return state;
    }
    prepared += has_mesh.get() ? 1 : 0;
  }
  spdlog::info("prepared {} of {} meshes of the store", prepared, ids.size());
  return state;
}

}  // namespace

Server::Server(const ServerOptions& options, const std::function<bool()>& stops)
    : state_(options),
      refused_(options.admission_wait),
      service_(warmed_up(state_, stops)),
      listener_(options.listen_address, connection_limits(options, connection_descriptors())) {
  enable_extras();
  grpc::ServerBuilder builder;
  if (!options.tls.certificate.empty()) certificates_ = std::make_unique<ServedCertificates>(options.tls);
  acceptor_ = builder.experimental().AddExternalConnectionAcceptor(
      grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD, credentials());
  builder.experimental().SetInterceptorCreators(count_calls(listener_.connections()));
  builder.RegisterService(&service_);
  set_channel_arguments(options, builder);
  server_ = builder.BuildAndStart();
  if (!server_) throw std::runtime_error("gRPC's server doesn't start; --log-level debug says why");
  set_serving(*server_, true);
  if (!options.health_address.empty()) health_ = std::make_unique<HealthServer>(options.health_address);
  if (!options.metrics_address.empty()) serve_figures();
  listener_.start([this](int descriptor) { hand_over(*acceptor_, descriptor); },
                  [this](std::size_t just_taken) { return takes_too_much(just_taken * most_of_connection()); });
}

Server::HealthServer::HealthServer(const std::string& address)
    : listener(address, {.connections = kHealthConnections,
                         .per_address = kHealthConnections,
                         .idle = std::chrono::minutes(10),
                         .arriving = {},
                         .streams = kHealthStreams}) {
  grpc::ServerBuilder builder;
  builder.experimental().SetInterceptorCreators(count_calls(listener.connections()));
  acceptor = builder.experimental().AddExternalConnectionAcceptor(
      grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD, grpc::InsecureServerCredentials());
  grpc::ResourceQuota quota("health");
  quota.SetMaxThreads(kThreadsOfReflection);
  builder.SetResourceQuota(quota);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, kHealthStreams);
  take_no_compressed_messages(builder);
  builder.SetMaxReceiveMessageSize(kHealthMessageBytes);
  server = builder.BuildAndStart();
  if (!server) throw std::runtime_error("gRPC's server of health doesn't start; --log-level debug says why");
  set_serving(*server, true);
  listener.start([this](int descriptor) { hand_over(*acceptor, descriptor); });
}

Server::HealthServer::~HealthServer() {
  listener.stop();
  server->Shutdown(std::chrono::system_clock::now());
  server->Wait();
}

/// Clients' certificates, if they are asked for, are checked against the authority; their names are theirs.
std::shared_ptr<grpc::ServerCredentials> Server::credentials() const {
  if (!certificates_) return grpc::InsecureServerCredentials();
  const CertificateFiles& files = certificates_->served();
  const auto provider = std::make_shared<grpc::experimental::FileWatcherCertificateProvider>(
      files.key, files.certificate, files.client_authority, kLookAtCertificatesS);
  grpc::experimental::TlsServerCredentialsOptions tls(provider);
  tls.watch_identity_key_cert_pairs();
  if (!files.client_authority.empty()) {
    tls.watch_root_certs();
    tls.set_cert_request_type(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
  }
  return grpc::experimental::TlsServerCredentials(tls);
}

void Server::serve_figures() {
  metrics_ = std::make_unique<HttpServer>(state_.options.metrics_address, [this](const std::string& path) {
    if (path == "/metrics") {
      const CertificateEnds ends = certificates_ ? certificates_->ends() : CertificateEnds();
      return HttpAnswer{.text = metrics_page(state_, {.connections = listener_.connections().size(), .ends = ends})};
    }
    if (path == "/healthz") return HttpAnswer{.text = "alive\n"};
    if (path == "/readyz")
      return ready_ ? HttpAnswer{.text = "ready\n"} : HttpAnswer{.status = 503, .text = "stopping\n"};
    return HttpAnswer{.status = 404, .text = "there are /metrics, /healthz and /readyz\n"};
  });
}

void Server::relieve() {
  constexpr std::size_t kEndedAtOnce = 64, kDroppedAtOnce = 256;
  constexpr std::chrono::milliseconds kUntilMemoryIsBack = 200ms;
  if (state_.admission.wants_memory()) state_.idle_watch.sweep(/*in_need=*/true);
  make_room();
  const auto now = std::chrono::steady_clock::now();
  if (now - relieved_ < kUntilMemoryIsBack || !takes_too_much()) return;
  relieved_ = now;
  state_.heap_trim.trim();
  if (!takes_too_much()) return;
  const std::size_t ended = state_.idle_watch.end_longest(kEndedAtOnce);
  if (ended > 0) return spdlog::warn("ended {} calls whose clients don't read: memory runs short (--memory)", ended);
  ConnectionTable& connections = listener_.connections();
  std::size_t dropped = connections.drop_unserved(kDroppedAtOnce, now);
  if (dropped == 0) dropped = connections.drop_of_most_crowded(kDroppedAtOnce, now);
  if (dropped > 0)
    spdlog::warn("dropped {} connections of calls that ask for nothing, or without calls: memory runs short (--memory)",
                 dropped);
}

/// For a mesh that the cache had no room for, until it is uploaded again.
void Server::make_room() {
  const std::optional<RefusedMesh> refused = state_.cache.take_refused();
  if (!refused) return;
  std::vector<std::shared_ptr<IdleCall>> calls = state_.idle_watch.open_calls();
  for (const auto& preview : state_.preview_watch.open_calls()) calls.push_back(preview);
  const auto silent = refused_.least_silence(refused->client, std::chrono::steady_clock::now());
  const std::size_t ended = make_room_for(*refused, calls, silent);
  if (ended > 0)
    spdlog::warn("ended {} calls of silent or slow clients: their meshes fill the cache (--cache-bytes)", ended);
}

/// The process comes near the memory it should do with, or will by what is expected besides, and not for what the
/// budgets know of.
bool Server::takes_too_much(std::uint64_t expected_bytes) {
  const std::uint64_t all = state_.options.memory_bytes;
  const HeapTrim::Figures figures = state_.heap_figures();
  const std::uint64_t held = figures.resident_bytes + expected_bytes, known = std::min(figures.known_bytes, held);
  return held > all / 8 * 7 && held - known > process_memory(all);
}

/// What calls that ask for nothing take in gRPC at most; one connection is never thought to fill the memory alone.
std::uint64_t Server::most_of_connection() const {
  constexpr std::uint64_t kWatchBytes = 19 << 10;  // Of the health; other calls take less.
  return std::min(state_.options.max_connection_streams * kWatchBytes, state_.options.memory_bytes / 64);
}

void Server::reload(bool always) {
  constexpr auto kBetweenChecks = 5s;  // Tokens expire, too.
  const auto now = std::chrono::steady_clock::now();
  const bool has_new_rules = state_.access.reload(always);
  if (has_new_rules) log_audit("reloaded", "tokens from " + state_.options.token_file, {});
  if (has_new_rules || now - checked_ >= kBetweenChecks) {
    checked_ = now;
    state_.calls.check_all();
  }
  if (certificates_ && certificates_->reload(always)) {
    log_audit("reloaded", "the certificate from " + state_.options.tls.certificate, {});
  }
}

void Server::say_not_serving() {
  ready_ = false;
  set_serving(*server_, false);
  if (health_) set_serving(*health_->server, false);
}

Server::~Server() {
  metrics_.reset();
  begin_shut_down();
  shut_down_.wait();
}

bool Server::drain(std::chrono::milliseconds grace, const std::function<bool()>& hurry) {
  const auto end = std::chrono::steady_clock::now() + grace;
  say_not_serving();
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

void Server::hand_over(Acceptor& acceptor, int descriptor) {
  Acceptor::NewConnectionParameters connection;
  connection.fd = descriptor;
  acceptor.HandleNewConnection(&connection);
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
