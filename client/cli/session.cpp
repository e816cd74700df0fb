// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/session.h"

#include <cmath>
#include <cstdlib>

namespace ccslice::cli {

std::string default_server() {
  const char* const variable = std::getenv("CCSLICE_SERVER");
  return variable != nullptr && *variable != '\0' ? variable : "localhost:50051";
}

void add_output_options(CLI::App& command, CommonOptions& options) {
  command.add_flag("--json", options.json, "Print one JSON document on standard output, errors included")
      ->group("Output");
  command.add_flag("-q,--quiet", options.quiet, "No progress and no notes")->group("Output");
}

void add_server_options(CLI::App& command, CommonOptions& options) {
  // Not CLI11's envname(): all commands share one variable, and it would also be set for commands that aren't run.
  command.add_option("--server", options.server, "Where ccsliced listens, HOST:PORT (default from CCSLICE_SERVER)")
      ->capture_default_str()
      ->group("Server");
  command.add_option("--timeout", options.timeout_s, "Give up after this many seconds in all (0: never)")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str()
      ->group("Server");
  command.add_option("--attempts", options.attempts, "Attempts in a row without progress before giving up")
      ->check(CLI::PositiveNumber)
      ->capture_default_str()
      ->group("Server");
  add_output_options(command, options);
}

Session::Session(const CommonOptions& options, client::Cancellation& cancellation) : options_(options) {
  call_.cancellation = &cancellation;
  if (options.timeout_s > 0) {
    constexpr double kLongestS = 1e9;
    call_.deadline = std::chrono::system_clock::now() +
                     std::chrono::milliseconds(std::llround(1000 * std::min(options.timeout_s, kLongestS)));
  }
}

client::Client& Session::client() {
  if (client_) return *client_;
  client::RetryPolicy retry;
  retry.max_attempts = options_.attempts;
  auto client = std::make_unique<client::Client>(client::ClientOptions{options_.server, retry});
  try {
    client::CallOptions once = call_;
    once.retry = client::RetryPolicy{.max_attempts = 1};
    server_info_ = client->server_info(once);
  } catch (const client::ClientError& error) {
    if (error.code() != grpc::StatusCode::UNAVAILABLE) throw;
    if (!error.reason().empty()) {
      server_info_ = client->server_info(call_);
    } else {
      throw client::ClientError(error.code(), "UNREACHABLE",
                                "no ccslice server answers at " + options_.server + " (" + error.what() +
                                    "); start ccsliced there, or name another one with --server or CCSLICE_SERVER");
    }
  }
  client_ = std::move(client);
  return *client_;
}

const v1::GetServerInfoResponse& Session::server_info() {
  client();
  return server_info_;
}

}  // namespace ccslice::cli
