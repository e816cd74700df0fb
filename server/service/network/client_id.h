// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Who a client is: those who share time with each other before their calls do.

#pragma once

#include <string>
#include <string_view>

namespace ccslice::server {

/// The address in gRPC's name for a peer ("ipv4:192.0.2.7:50123", "ipv6:%5B2001:db8::1%5D:50123"), without the port.
/// All peers on Unix sockets are one client.
[[nodiscard]] inline std::string client_of(std::string_view peer) {
  if (peer.starts_with("unix")) return "unix";
  return std::string(peer.substr(0, peer.rfind(':')));
}

}  // namespace ccslice::server
