// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>

#include "server/rpc/server.h"

namespace ccslice::client {

/// A small server in this process; port 0 is a free one.
inline server::ServerOptions local_server_options(const std::string& address = "127.0.0.1:0") {
  server::ServerOptions options;
  options.listen_address = address;
  options.threads = 2;
  options.cache_bytes = 1ull << 30;
  options.stream_window_bytes = 64 << 20;
  options.stream_budget_bytes = 256 << 20;
  options.preparation_budget_bytes = 1ull << 30;
  options.max_mesh_bytes = 256 << 20;
  options.upload_budget_bytes = 512 << 20;
  options.max_message_bytes = 4 << 20;
  return options;
}

}  // namespace ccslice::client
