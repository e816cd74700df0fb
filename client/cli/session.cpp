// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/session.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string_view>
#include <system_error>

#include "client/cli/console.h"
#include "client/cli/text_values.h"
#include "core/base/echo.h"

namespace ccslice::cli {

namespace {

constexpr const char* kDefaultServer = "localhost:50051";
constexpr double kLongestS = 1e9;

/// HOST:PORT, or an address with a scheme of gRPC's, such as unix:PATH or dns:///HOST:PORT.
bool is_address(const std::string& text) {
  constexpr std::array<std::string_view, 6> kSchemes = {"unix:", "unix-abstract:", "dns:", "ipv4:", "ipv6:", "xds:"};
  if (std::ranges::any_of(kSchemes, [&](std::string_view scheme) { return text.starts_with(scheme); })) return true;
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0 || text.find('/') != std::string::npos) return false;
  int port = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, status] = std::from_chars(text.data() + colon + 1, end, port);
  constexpr int kLastPort = 65'535;
  return status == std::errc() && stop == end && port > 0 && port <= kLastPort;
}

/// What the user has chosen: the flag's server, or the environment's. Empty if neither names one. Throws UsageError.
std::string chosen_server(const CommonOptions& options) {
  const char* const variable = std::getenv("CCSLICE_SERVER");
  const bool by_flag = options.server.has_value();
  const std::string chosen = by_flag ? *options.server : variable == nullptr ? "" : variable;
  if (is_address(chosen) || (chosen.empty() && !by_flag)) return chosen;
  throw UsageError(std::string(by_flag ? "--server" : "CCSLICE_SERVER") +
                   " takes an address HOST:PORT, such as localhost:50051, or unix:PATH, not '" + chosen + "'");
}

}  // namespace

void add_output_options(CLI::App& command, CommonOptions& options) {
  command.add_flag("--json", options.json, "Print one JSON document on standard output, errors included")
      ->group("Output");
  command.add_flag("-q,--quiet", options.quiet, "No progress and no notes")->group("Output");
}

void add_server_options(CLI::App& command, CommonOptions& options) {
  // Not CLI11's envname(): all commands share one variable, and it would also be set for commands that aren't run.
  command
      .add_option("--server", options.server,
                  std::string("Where ccsliced listens, HOST:PORT or unix:PATH (default: the environment variable "
                              "CCSLICE_SERVER, or ") +
                      kDefaultServer + ")")
      ->group("Server");
  command
      .add_flag_function(
          "--local,!--no-local", [&options](std::int64_t count) { options.local = count > 0; },
          std::string("Start a ccsliced for this command alone, and end it with the command; --no-local: never do. "
                      "Without either, one is started if no server is named and nobody answers at ") +
              kDefaultServer)
      ->group("Server");
  command.add_option("--timeout", options.timeout_s, "Give up after this many seconds in all (0: never)")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str()
      ->group("Server");
  command
      .add_option("--patience", options.patience_s,
                  "Go on for so many seconds without a new layer while no server answers, or those that do are busy")
      ->check(CLI::Range(0.0, kLongestS))
      ->capture_default_str()
      ->group("Server");
  command
      .add_option("--attempts", options.attempts, "Give up after so many attempts in a row, too (default: no limit)")
      ->check(CLI::PositiveNumber)
      ->group("Server");
  add_output_options(command, options);
}

Session::Session(const CommonOptions& options, client::Cancellation& cancellation) : options_(options) {
  call_.cancellation = &cancellation;
  if (options.timeout_s > 0) {
    call_.deadline = std::chrono::system_clock::now() +
                     std::chrono::milliseconds(std::llround(1000 * std::min(options.timeout_s, kLongestS)));
  }
}

client::Client& Session::client() {
  if (!client_) connect();
  return *client_;
}

bool Session::server_is_private() {
  client();
  return private_server_ != nullptr;
}

void Session::connect() {
  if (options_.local == true && options_.server) {
    throw UsageError("--local starts a server and --server names one; leave out one of them");
  }
  if (options_.local == true) return start_server();
  const std::string chosen = chosen_server(options_);
  const std::string address = chosen.empty() ? kDefaultServer : chosen;
  try {
    connect_to(address);
  } catch (const client::ClientError& error) {
    const bool nobody_there = error.code() == grpc::StatusCode::UNAVAILABLE && error.reason().empty();
    if (!nobody_there) throw;
    if (chosen.empty() && options_.local != false && !find_ccsliced().empty()) return start_server();
    throw client::ClientError(error.code(), "UNREACHABLE",
                              "no ccslice server answers at " + address + " (" + error.what() +
                                  "); start ccsliced there, or name another one with --server or CCSLICE_SERVER");
  }
}

void Session::connect_to(const std::string& address) {
  client::RetryPolicy retry;
  retry.max_attempts = options_.attempts;
  retry.patience = std::chrono::milliseconds(std::llround(1000 * options_.patience_s));
  auto client = std::make_unique<client::Client>(client::ClientOptions{address, retry});
  try {
    client::CallOptions once = call_;
    once.retry = client::RetryPolicy{.max_attempts = 1};
    server_info_ = client->server_info(once);
  } catch (const client::ClientError& error) {
    const bool answers = error.code() == grpc::StatusCode::UNAVAILABLE && !error.reason().empty();
    if (!answers) throw;
    server_info_ = client->server_info(call_);
  }
  client_ = std::move(client);
}

void Session::start_server() {
  const std::string program = find_ccsliced();
  if (program.empty()) {
    throw client::ClientError(grpc::StatusCode::UNAVAILABLE, "UNREACHABLE",
                              "there is no ccsliced beside ccslice and none in PATH; install it, name it with the "
                              "environment variable CCSLICED, or name a running server with --server");
  }
  if (!quiet()) print_note("started " + program + " for this command alone (--no-local: don't)");
  private_server_ = std::make_unique<PrivateServer>(program, call_);
  connect_to(private_server_->address());
  if (!quiet() && server_info_.server_version() != CCSLICE_VERSION) {
    print_note(program + " is version " + echoed(server_info_.server_version()) + ", and this is " + CCSLICE_VERSION);
  }
}

const v1::GetServerInfoResponse& Session::server_info() {
  client();
  return server_info_;
}

}  // namespace ccslice::cli
