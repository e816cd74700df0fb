// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/endpoints.h"

#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string_view>
#include <thread>
#include <utility>

#include "client/address.h"
#include "client/client_error.h"

namespace ccslice::client {
namespace {

using namespace std::chrono_literals;

constexpr auto kLookUpEvery = 30s, kLookUpAtMostEvery = 1s;
/// How long first calls wait to know the servers. Then they go to the name, and gRPC looks it up in its own way, which
/// can be cancelled.
constexpr auto kFirstLookUp = 1s;

grpc::ChannelArguments channel_arguments() {
  grpc::ChannelArguments arguments;
  // Finds out about servers that vanished without a word; more often than every five minutes counts as abuse.
  constexpr int kKeepaliveMs = 6 * 60 * 1000;
  constexpr int kKeepaliveTimeoutMs = 20 * 1000;
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveMs);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kKeepaliveTimeoutMs);
  // A server that is back is looked for every fifth of a second. What is called the least pause is how long an attempt
  // to connect may take (gRPC's subchannel.cc).
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 5000);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 200);
  // A compressed message may take a thousand times its bytes before anybody asks for its size. Servers are told that we
  // take none. Whoever sends one all the same is refused (gRPC's call.cc), but maybe only once it is inflated, so it
  // never is.
  arguments.SetInt(GRPC_COMPRESSION_CHANNEL_ENABLED_ALGORITHMS_BITSET, 1 << GRPC_COMPRESS_NONE);
  arguments.SetInt(GRPC_ARG_ENABLE_PER_MESSAGE_DECOMPRESSION, 0);
  return arguments;
}

/// Nobody is between the two ends of a socket of this machine.
bool is_local_socket(const Address& address) {
  return address.target.starts_with("unix:") || address.target.starts_with("unix-abstract:");
}

/// A server that refuses tokens in plain text does so when they have travelled already.
void require_secret_way(const Address& address, bool with_tls) {
  if (with_tls || is_loopback(address.target)) return;
  throw ClientError(grpc::StatusCode::INVALID_ARGUMENT, local_reason::kCredentialsInvalid,
                    "the token would travel unencrypted to " + address.target +
                        ": give --ca, or https:// before the address, or leave out the token");
}

std::shared_ptr<const Endpoint> endpoint_at(const std::string& address, std::shared_ptr<grpc::ChannelInterface> channel,
                                            std::shared_ptr<const TokenFile> token) {
  auto stub = v1::SlicerService::NewStub(channel);
  return std::make_shared<const Endpoint>(Endpoint{address, std::move(channel), std::move(stub), std::move(token)});
}

/// One address of the options, and the endpoints that it stands for.
struct Site {
  Address address;
  std::shared_ptr<grpc::ChannelCredentials> credentials;
  std::shared_ptr<const TokenFile> token;
  EndpointList endpoints;
};

std::shared_ptr<const Endpoint> endpoint_of(const Site& site, const std::string& target) {
  grpc::ChannelArguments arguments = channel_arguments();
  if (is_loopback(target)) arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  if (target != site.address.target) arguments.SetString(GRPC_ARG_DEFAULT_AUTHORITY, site.address.target);
  return endpoint_at(target, grpc::CreateCustomChannel(target, site.credentials, arguments), site.token);
}

/// Those of the targets: where they were known already, as they are.
EndpointList endpoints_of(const Site& site, const std::vector<std::string>& targets) {
  EndpointList endpoints;
  for (const std::string& target : targets) {
    const auto known = std::ranges::find(site.endpoints, target, &Endpoint::address);
    endpoints.push_back(known == site.endpoints.end() ? endpoint_of(site, target) : *known);
  }
  return endpoints;
}

/// Of two texts. The same in every program and version, or clients wouldn't agree: FNV-1a, mixed by the finalizer of
/// splitmix64, since the last bytes of the text hardly reach the upper bits.
std::uint64_t score_of(std::string_view address, std::string_view mesh_id) {
  std::uint64_t hash = 14'695'981'039'346'656'037ull;
  const auto add = [&](std::string_view text) {
    for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 1'099'511'628'211ull;
  };
  add(address);
  add(" ");
  add(mesh_id);
  hash = (hash ^ (hash >> 30)) * 0xbf58476d1ce4e5b9ull;
  hash = (hash ^ (hash >> 27)) * 0x94d049bb133111ebull;
  return hash ^ (hash >> 31);
}

}  // namespace

void order_for(const std::string& mesh_id, EndpointList& endpoints) {
  if (mesh_id.empty()) return;
  std::ranges::stable_sort(endpoints, std::ranges::greater(), [&](const std::shared_ptr<const Endpoint>& endpoint) {
    return score_of(endpoint->address, mesh_id);
  });
}

struct Endpoints::State {
  /// Looks all names up. Where that finds nothing they stand for what they stood for.
  void look_up_names();

  Resolver resolver;
  bool has_names = false;
  std::once_flag begun;  // The first call starts the thread.
  std::chrono::steady_clock::time_point first_calls_end;
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<Site> sites;
  bool looked_up = false;  // For the first time.
  bool wanted = false;     // To look names up sooner.
  bool over = false;
};

void Endpoints::State::look_up_names() {
  for (Site& site : sites) {  // Their endpoints alone change, in this thread alone.
    if (!is_name(site.address)) continue;
    const std::vector<std::string> targets = resolver(site.address.host, site.address.port);
    if (targets.empty()) continue;
    EndpointList found = endpoints_of(site, targets);
    const std::lock_guard lock(mutex);
    std::swap(site.endpoints, found);
  }
}

void Endpoints::watch_names(const std::shared_ptr<State>& state) {
  for (;;) {
    state->look_up_names();
    const auto last = std::chrono::steady_clock::now();
    std::unique_lock lock(state->mutex);
    state->looked_up = true;
    state->changed.notify_all();
    state->changed.wait_until(lock, last + kLookUpEvery, [&] { return state->over || state->wanted; });
    state->changed.wait_until(lock, last + kLookUpAtMostEvery, [&] { return state->over; });
    if (state->over) return;
    state->wanted = false;
  }
}

Endpoints::Endpoints(const ClientOptions& options) : state_(std::make_shared<State>()) {
  const std::vector<std::string> one = {options.address};
  const std::vector<Address> addresses = parse_addresses(options.addresses.empty() ? one : options.addresses);
  const bool tls = options.tls || std::ranges::any_of(addresses, &Address::tls);
  const auto plain_credentials = grpc::InsecureChannelCredentials();
  const auto tls_credentials = tls ? read_tls_credentials(options.tls.value_or(TlsFiles())) : plain_credentials;
  const auto token = options.token_file.empty() ? nullptr : std::make_shared<const TokenFile>(options.token_file);
  state_->resolver = options.resolver;
  for (const Address& address : addresses) {
    const bool with_tls = address.tls || (options.tls && !is_local_socket(address));
    if (token) require_secret_way(address, with_tls);
    Site& site = state_->sites.emplace_back(Site{address, with_tls ? tls_credentials : plain_credentials, token, {}});
    site.endpoints = endpoints_of(site, {address.target});
    state_->has_names |= is_name(address);
  }
}

Endpoints::Endpoints(std::shared_ptr<grpc::ChannelInterface> channel) : state_(std::make_shared<State>()) {
  state_->sites.push_back({{}, nullptr, nullptr, {endpoint_at("the server", std::move(channel), nullptr)}});
}

Endpoints::~Endpoints() {
  const std::lock_guard lock(state_->mutex);
  state_->over = true;
  state_->changed.notify_all();
}

EndpointList Endpoints::in_order(const std::string& mesh_id) const {
  if (state_->has_names) {
    std::call_once(state_->begun, [this] {
      state_->first_calls_end = std::chrono::steady_clock::now() + kFirstLookUp;
      std::thread([state = state_] { watch_names(state); }).detach();
    });
  }
  EndpointList endpoints;
  {
    std::unique_lock lock(state_->mutex);
    if (state_->has_names) {
      state_->changed.wait_until(lock, state_->first_calls_end, [this] { return state_->looked_up; });
    }
    for (const Site& site : state_->sites) {
      endpoints.insert(endpoints.end(), site.endpoints.begin(), site.endpoints.end());
    }
  }
  order_for(mesh_id, endpoints);
  return endpoints;
}

void Endpoints::look_up_soon() const {
  const std::lock_guard lock(state_->mutex);
  state_->wanted = true;
  state_->changed.notify_all();
}

}  // namespace ccslice::client
