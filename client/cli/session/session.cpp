// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/session/session.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "client/address.h"
#include "client/cli/base/console.h"
#include "client/cli/base/option_group.h"
#include "client/cli/base/text_values.h"
#include "core/base/echo.h"
#include "core/base/version.h"

namespace ccslice::cli {

namespace {

constexpr const char* kDefaultServer = "localhost:50051";
constexpr double kLongestS = 1e9;

/// The flag's value, or the environment's; empty if neither says anything.
std::string flag_or_variable(const std::optional<std::string>& flag, const char* variable) {
  if (flag) return *flag;
  const char* const value = std::getenv(variable);
  return value == nullptr ? "" : value;
}

/// The servers that the user has chosen: the flag's, or the environment's. Empty if neither names one. Throws
/// UsageError.
std::string chosen_servers(const CommonOptions& options) {
  const std::string chosen = flag_or_variable(options.server, "CCSLICE_SERVER");
  if (chosen.empty() && !options.server) return chosen;
  try {
    client::parse_addresses(split(chosen, ','));
  } catch (const client::ClientError& error) {
    throw UsageError(std::string(options.server ? "--server" : "CCSLICE_SERVER") +
                     " takes an address HOST:PORT, or several with commas between them: " + error.what());
  }
  return chosen;
}

/// All but the addresses.
client::ClientOptions connection_options(const CommonOptions& options) {
  client::ClientOptions connection;
  client::TlsFiles tls;
  tls.ca = flag_or_variable(options.ca, "CCSLICE_CA");
  tls.cert = flag_or_variable(options.cert, "CCSLICE_CERT");
  tls.key = flag_or_variable(options.key, "CCSLICE_KEY");
  if (!tls.ca.empty() || !tls.cert.empty() || !tls.key.empty()) connection.tls = tls;
  connection.token_file = flag_or_variable(options.token_file, "CCSLICE_TOKEN_FILE");
  return connection;
}

/// What the user can do about servers of which none answers.
std::string remedy_for(const client::ClientOptions& connection) {
  for (const client::Address& address : client::parse_addresses(connection.addresses)) {
    const std::string variable = client::proxy_variable(address.target);
    if (variable.empty()) continue;
    return "the way to " + address.target + " leads through the proxy that the environment's " + variable +
           " names: unset it, or add the host to no_proxy, if that is wrong";
  }
  const auto is_https = [](const std::string& address) { return address.starts_with("https://"); };
  if (!connection.tls && std::ranges::none_of(connection.addresses, is_https)) {
    return "start ccsliced there, or name another one with --server or CCSLICE_SERVER; if it serves TLS, give --ca";
  }
  return "start ccsliced there with TLS, or name another one with --server or CCSLICE_SERVER; its certificate is to be "
         "for the name in the address, and --ca to have signed it";
}

void add_identity_options(CLI::App& command, CommonOptions& options) {
  const OptionGroup group(command, "Server");
  command.add_option("--ca", options.ca,
                     "Use TLS, and trust servers whose certificate this PEM file has signed (default: CCSLICE_CA; with "
                     "https:// alone, what the system trusts)");
  command.add_option("--cert", options.cert,
                     "Use TLS, and show servers that ask the certificate in this PEM file; goes with --key (default: "
                     "CCSLICE_CERT)");
  command.add_option("--key", options.key, "PEM file with the key of --cert (default: CCSLICE_KEY)");
  command.add_option(
      "--token-file", options.token_file,
      "Send the first line of this file with every call, as a bearer token (default: CCSLICE_TOKEN_FILE)");
}

}  // namespace

void add_output_options(CLI::App& command, CommonOptions& options) {
  const OptionGroup group(command, "Output");
  command.add_flag("--json", options.json, "Print one JSON document on standard output, errors included");
  command.add_flag("-q,--quiet", options.quiet,
                   "No progress and no notes; what plan warns of is in the manifest.json of slice alone");
}

void add_server_options(CLI::App& command, CommonOptions& options) {
  const OptionGroup group(command, "Server");
  // Not CLI11's envname(): all commands share one variable, and it would also be set for commands that aren't run.
  command.add_option(
      "--server", options.server,
      std::string("Where ccsliced listens, HOST:PORT, https://HOST:PORT or unix:PATH, or several such with "
                  "commas between them, one of which gets the calls of a mesh, and the next one where it "
                  "fails (default: the environment variable CCSLICE_SERVER, or ") +
          kDefaultServer + ")");
  add_identity_options(command, options);
  command.add_flag_function(
      "--local,!--no-local", [&options](std::int64_t count) { options.local = count > 0; },
      std::string("Start a ccsliced for this command alone, and end it with the command; --no-local: never do. "
                  "Without either, one is started if no server is named and nobody answers at ") +
          kDefaultServer);
  command.add_option("--timeout", options.timeout_s, "Give up after this many seconds in all (0: never)")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command
      .add_option("--patience", options.patience_s,
                  "Go on for so many seconds without a new layer while no server answers, or those that do are busy")
      ->check(CLI::Range(0.0, kLongestS))
      ->capture_default_str();
  command
      .add_option("--attempts", options.attempts, "Give up after so many attempts in a row, too (default: no limit)")
      ->check(CLI::PositiveNumber);
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
  client::ClientOptions connection = connection_options(options_);
  const std::string chosen = chosen_servers(options_);
  const std::string servers = chosen.empty() ? kDefaultServer : chosen;
  connection.addresses = split(servers, ',');
  if (!quiet() && !connection.token_file.empty() && client::others_can_read(connection.token_file)) {
    print_note("warning: everybody on this machine can read the token in " + connection.token_file + "; chmod 600 it");
  }
  try {
    connect_to(connection);
  } catch (const client::ClientError& error) {
    const bool nobody_there = error.code() == grpc::StatusCode::UNAVAILABLE && error.reason().empty();
    if (!nobody_there) throw;
    if (chosen.empty() && options_.local != false && !find_ccsliced().empty()) return start_server();
    throw client::ClientError(
        error.code(), "UNREACHABLE",
        "no ccslice server answers at " + servers + " (" + error.what() + "); " + remedy_for(connection));
  }
}

void Session::connect_to(client::ClientOptions options) {
  options.retry.max_attempts = options_.attempts;
  options.retry.patience = std::chrono::milliseconds(std::llround(1000 * options_.patience_s));
  auto client = std::make_unique<client::Client>(options);
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
  connect_to({.address = private_server_->address()});
  if (!quiet() && server_info_.server_version() != kVersion) {
    print_note(program + " is version " + echoed(server_info_.server_version()) + ", and this is " + kVersion);
  }
}

const v1::GetServerInfoResponse& Session::server_info() {
  client();
  return server_info_;
}

}  // namespace ccslice::cli
