// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/endpoints.h"

#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>

#include <algorithm>
#include <cstdint>
#include <string_view>
#include <utility>

#include "client/address.h"

namespace ccslice::client {
namespace {

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
  return arguments;
}

/// Nobody is between the two ends of a socket of this machine.
bool is_local_socket(const Address& address) {
  return address.target.starts_with("unix:") || address.target.starts_with("unix-abstract:");
}

std::shared_ptr<const Endpoint> endpoint_at(const std::string& address, std::shared_ptr<grpc::ChannelInterface> channel,
                                            std::shared_ptr<const TokenFile> token) {
  auto stub = v1::SlicerService::NewStub(channel);
  return std::make_shared<const Endpoint>(Endpoint{address, std::move(channel), std::move(stub), std::move(token)});
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

Endpoints::Endpoints(const ClientOptions& options) {
  const std::vector<std::string> one = {options.address};
  const std::vector<Address> addresses = parse_addresses(options.addresses.empty() ? one : options.addresses);
  const bool tls = options.tls || std::ranges::any_of(addresses, &Address::tls);
  const auto plain_credentials = grpc::InsecureChannelCredentials();
  const auto tls_credentials = tls ? read_tls_credentials(options.tls.value_or(TlsFiles())) : plain_credentials;
  const auto token = options.token_file.empty() ? nullptr : std::make_shared<const TokenFile>(options.token_file);
  for (const Address& address : addresses) {
    const bool with_tls = address.tls || (options.tls && !is_local_socket(address));
    const auto channel =
        grpc::CreateCustomChannel(address.target, with_tls ? tls_credentials : plain_credentials, channel_arguments());
    all_.push_back(endpoint_at(address.target, channel, token));
  }
}

Endpoints::Endpoints(std::shared_ptr<grpc::ChannelInterface> channel) {
  all_.push_back(endpoint_at("the server", std::move(channel), nullptr));
}

EndpointList Endpoints::in_order(const std::string& mesh_id) const {
  EndpointList endpoints = all_;
  order_for(mesh_id, endpoints);
  return endpoints;
}

}  // namespace ccslice::client
