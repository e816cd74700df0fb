// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What one run of a command shares: the common options, and the connection to a server.

#pragma once

#include <CLI/CLI.hpp>
#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "client/client.h"

namespace ccslice::cli {

/// The environment variable CCSLICE_SERVER, or localhost:50051.
std::string default_server();

/// What every command understands.
struct CommonOptions {
  std::string server = default_server();
  double timeout_s = 0;  // 0: none.
  int attempts = client::RetryPolicy{}.max_attempts;
  bool json = false;
  bool quiet = false;
};

void add_output_options(CLI::App& command, CommonOptions& options);
/// Adds the output options too.
void add_server_options(CLI::App& command, CommonOptions& options);

/// One run of the program: its options and, once it is needed, its connection.
class Session {
 public:
  Session(const CommonOptions& options, client::Cancellation& cancellation);

  const CommonOptions& options() const { return options_; }
  /// Whether to leave out progress bars and notes.
  bool quiet() const { return options_.json || options_.quiet; }
  /// Connects on first use. Throws ClientError (UNAVAILABLE), saying what to do, if nobody answers there.
  client::Client& client();
  const client::CallOptions& call() const { return call_; }
  const v1::GetServerInfoResponse& server_info();

 private:
  const CommonOptions& options_;
  client::CallOptions call_;
  std::unique_ptr<client::Client> client_;
  v1::GetServerInfoResponse server_info_;
};

}  // namespace ccslice::cli
