// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>
#include <string>

#include "server/rpc/server/server.h"
#include "server/service/options/options.h"

namespace ccslice::client {

/// A small server in this process, with the program's defaults; port 0 is a free one.
inline server::ServerOptions local_server_options(const std::string& address = "127.0.0.1:0") {
  server::ServerOptions options = server::parse_options({}, [](const std::string&) { return std::nullopt; },
                                                        {.cpus = 2, .memory_bytes = 4ull << 30})
                                      .options;
  options.listen_address = address;
  return options;
}

}  // namespace ccslice::client
