// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Addresses of servers as users write them: HOST:PORT, unix:PATH, another scheme of gRPC's, or https://HOST:PORT for
// TLS.

#pragma once

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

}  // namespace ccslice::client
