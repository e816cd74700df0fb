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
#include <utility>
#include <vector>

#include "client/cli/session/private_server.h"
#include "client/client.h"
#include "core/mesh_import/mesh_file.h"

namespace ccslice::cli {

/// What every command understands.
struct CommonOptions {
  // Unset: the environment variables CCSLICE_SERVER, CCSLICE_CA, CCSLICE_CERT, CCSLICE_KEY and CCSLICE_TOKEN_FILE. No
  // server there: localhost:50051.
  std::optional<std::string> server, ca, cert, key, token_file;
  std::optional<bool> local;  // Whether to start a server: unset if only when nobody answers at localhost:50051.
  double timeout_s = 0;       // 0: none.
  double patience_s = 120;    // client::RetryPolicy's.
  int attempts = 0;           // 0: any number.
  std::string job_file;       // That says the job in place of options.
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
  /// Connects on first use, to a server that it starts where the options say so. Throws ClientError (UNAVAILABLE),
  /// saying what to do, if nobody answers.
  client::Client& client();
  /// Whether the server is one that was started for this run alone. Connects on first use.
  bool server_is_private();
  const client::CallOptions& call() const { return call_; }
  const v1::GetServerInfoResponse& server_info();
  /// What the file of the command's mesh calls its vertices and cells, for what the server says of them. None if the
  /// mesh was named by its id.
  const std::optional<FileNumbers>& file_numbers() const { return file_numbers_; }
  /// What was said of the file.
  const std::vector<std::string>& file_notes() const { return file_notes_; }
  void forget_file() {
    file_numbers_.reset();
    file_notes_.clear();
  }
  void set_file(FileNumbers numbers, std::vector<std::string> notes) {
    file_numbers_ = std::move(numbers);
    file_notes_ = std::move(notes);
  }

 private:
  void connect();
  /// Throws ClientError (UNAVAILABLE) if nobody answers.
  void connect_to(client::ClientOptions options);
  void start_server();

  const CommonOptions& options_;
  client::CallOptions call_;
  std::unique_ptr<PrivateServer> private_server_;
  std::unique_ptr<client::Client> client_;
  v1::GetServerInfoResponse server_info_;
  std::optional<FileNumbers> file_numbers_;
  std::vector<std::string> file_notes_;
};

}  // namespace ccslice::cli
