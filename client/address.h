// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Addresses of servers as users write them: HOST:PORT, unix:PATH, another scheme of gRPC's, or https://HOST:PORT for
// TLS.

#pragma once

#include <functional>
#include <string>
#include <vector>

namespace ccslice::client {

struct Address {
  std::string target;  // What gRPC is given: without https://.
  std::string host;    // As written, [] included. Empty if gRPC alone knows what the address means.
  std::string port;
  bool tls = false;  // https:// is before it.
};

/// Throws ClientError (ADDRESS_INVALID).
Address parse_address(const std::string& text);

/// Of one client: at least one, none empty, none twice. Throws ClientError (ADDRESS_INVALID).
std::vector<Address> parse_addresses(const std::vector<std::string>& texts);

/// Whether it is a name that may stand for several servers: no number, no path, and not this machine.
bool is_name(const Address& address);

/// Whether a target of gRPC's leads to this machine and no other: a socket's path, localhost, a number of 127.0.0.0/8
/// or ::1, or a list of such. Proxies are never asked for the way there.
bool is_loopback(const std::string& target);

/// The variable of the environment that names the proxy that gRPC goes through to get to a target: grpc_proxy,
/// https_proxy or http_proxy, the first that is set, unless no_grpc_proxy or no_proxy ends its host. Empty if there is
/// none.
std::string proxy_variable(const std::string& target);

/// Finds the addresses that a host and a port stand for, such as 10.0.0.1:50051. None if that isn't known.
using Resolver = std::function<std::vector<std::string>(const std::string& host, const std::string& port)>;

/// As the system finds them, by DNS and its files. A name with no more than one address of each version of IP is one
/// server, and its own address: gRPC finds out how to get there. Of several those of one version are returned, since
/// the others lead to the same servers.
std::vector<std::string> look_up(const std::string& host, const std::string& port);

}  // namespace ccslice::client
