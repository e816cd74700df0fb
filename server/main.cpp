// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// ccsliced: options, signals, server. Exit codes: 0 served and drained (or: healthy), 1 can't serve (or: not healthy),
// 2 wrong options.

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <ctime>
#include <iostream>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/base/echo.h"
#include "core/base/engine_version.h"
#include "core/base/version.h"
#include "server/rpc/server/health_client.h"
#include "server/rpc/server/server.h"
#include "server/service/base/logging.h"
#include "server/service/base/option_values.h"
#include "server/service/base/service_manager.h"
#include "server/service/network/access.h"
#include "server/service/network/private_socket.h"
#include "server/service/options/options.h"
#include "server/service/scheduling/heap_trim.h"

namespace ccslice::server {
namespace {

constexpr std::chrono::seconds kLastLines(1);   // What the log's reader has to take the last lines.
constexpr std::chrono::seconds kCancelled(10);  // What calls that are cut off may take to end, and the process.
constexpr std::chrono::milliseconds kBeat(100);
constexpr int kBeatsOfSweep = 10;

/// SIGTERM and SIGINT, blocked before any thread starts and waited for in one place; SIGHUP, which asks for files to be
/// read again. Neither a reader of the log that goes nor a terminal that closes ends the server.
class StopSignals {
 public:
  StopSignals() {
    std::signal(SIGPIPE, SIG_IGN);
    sigemptyset(&signals_);
    sigaddset(&signals_, SIGHUP);
    sigaddset(&signals_, SIGTERM);
    sigaddset(&signals_, SIGINT);
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
  }

  /// Whether one comes within this time. SIGHUP is none, but remembered.
  bool wait(std::chrono::milliseconds time) {
    const auto seconds = std::chrono::floor<std::chrono::seconds>(time);
    const timespec timeout{.tv_sec = seconds.count(), .tv_nsec = std::chrono::nanoseconds(time - seconds).count()};
    const int signal = sigtimedwait(&signals_, nullptr, &timeout);
    if (signal == SIGHUP) asks_to_reload_ = true;
    return signal > 0 && signal != SIGHUP;
  }
  /// Whether SIGHUP has come since the last time.
  bool asks_to_reload() { return std::exchange(asks_to_reload_, false); }

 private:
  sigset_t signals_;
  bool asks_to_reload_ = false;
};

/// Tells the program that started this one where to call, and stops the server once that program has gone.
void serve_parent(const std::string& address) {
  std::cout << address << std::endl;
  std::thread([] {
    wait_for_end_of_input(STDIN_FILENO);
    kill(getpid(), SIGTERM);
  }).detach();
}

std::string serves_on(const Server& server) { return "serves on " + server.address(); }

/// Until `end`, or until it is to stop.
void attend(Server& server, StopSignals& signals, const ServiceManager& manager,
            std::chrono::steady_clock::time_point end) {
  for (int beat = 1; std::chrono::steady_clock::now() < end && !signals.wait(kBeat); ++beat) {
    server.relieve();
    if (beat % kBeatsOfSweep != 0) continue;
    server.sweep();
    const bool asked = signals.asks_to_reload();
    if (asked) manager.say_reloading();
    server.reload(asked);
    if (asked) manager.say_ready(serves_on(server));
  }
}

[[noreturn]] void serve(ServerOptions options, bool privately, StopSignals& signals) {
  // The user of a private one sees all that it writes, and is its only client.
  set_up_logging(options.log_level, options.log_format, STDERR_FILENO, !privately);
  // Whatever starts a private one has its own word with the manager.
  const ServiceManager manager(privately ? "" : process_environment("NOTIFY_SOCKET").value_or(""));
  std::unique_ptr<PrivateSocket> socket;
  if (privately) {
    socket = std::make_unique<PrivateSocket>();
    options.listen_address = socket->address();
    options.shutdown_grace = std::chrono::milliseconds(0);  // Whoever calls has gone.
  }
  bool stops = false;  // Already while meshes are made ready.
  Server server(options, [&] { return stops = stops || signals.wait(std::chrono::milliseconds(0)); });
  if (privately) serve_parent(server.address());
  spdlog::info("ccsliced {} (engine {}) serves on {}: {} threads, {} bytes for meshes", kVersion, kEngineVersion,
               server.address(), options.threads, options.cache_bytes);
  for (const auto& [what, address] :
       {std::pair{"health", server.health_address()}, std::pair{"figures", server.metrics_address()}}) {
    if (!address.empty()) spdlog::info("serves {} on {}", what, address);
  }
  if (options.token_file.empty() && options.tls.client_authority.empty() && !is_local(options.listen_address)) {
    spdlog::warn("whoever reaches {} may do everything: --token-file or --tls-client-ca says who may do what",
                 options.listen_address);
  }
  if (const std::uint64_t all = budgeted_memory(options); all > options.memory_bytes) {
    spdlog::warn("budgets come to {} bytes with what the process takes, and --memory is {}: lower one or raise that",
                 all, options.memory_bytes);
  }
  manager.say_ready(serves_on(server));
  if (!stops) attend(server, signals, manager, std::chrono::steady_clock::time_point::max());
  manager.say_stopping(options.drain_delay + options.shutdown_grace + kCancelled);
  if (options.drain_delay.count() > 0) {
    spdlog::info("stopping in {} ms: health says so, calls are still taken", options.drain_delay.count());
    server.say_not_serving();
    attend(server, signals, manager, std::chrono::steady_clock::now() + options.drain_delay);
  }
  spdlog::info("stopping: running calls have {} ms", options.shutdown_grace.count());
  const bool all_left =
      server.drain(options.shutdown_grace, [&signals] { return signals.wait(std::chrono::milliseconds(0)); });
  spdlog::info(all_left ? "stopped" : "stopped without waiting for clients that don't read");
  socket = nullptr;
  flush_log(kLastLines);
  std::_Exit(0);  // Threads of gRPC's that wait for connections may sleep for ten seconds more.
}

/// A token never stands on a command line, where all users of a machine can read it.
int hash_token(const std::string& name, const std::string& role) {
  if (name.empty() || role.empty()) {
    throw OptionError("--hash-token takes a name and a role: ccsliced --hash-token farm write < token");
  }
  std::string token;
  std::getline(std::cin, token);
  try {
    std::cout << access_line(name, role, token) << "\n";
  } catch (const std::invalid_argument& why) {
    throw OptionError(std::string("--hash-token: ") + why.what());
  }
  return 0;
}

int run(const std::vector<std::string>& arguments, StopSignals& signals) {
  const Resources resources = available_resources();
  const ParsedOptions parsed = parse_options(arguments, process_environment, resources);
  switch (parsed.command) {
    case Command::kHelp: std::cout << help_text(resources); return 0;
    case Command::kVersion: std::cout << "ccsliced " << kVersion << " (engine " << kEngineVersion << ")\n"; return 0;
    case Command::kHealthCheck: {
      std::string explanation;
      const bool healthy = check_health(parsed.health_check_address, explanation);
      std::cout << harmless(explanation) << "\n";
      return healthy ? 0 : 1;
    }
    case Command::kHashToken: return hash_token(parsed.token_name, parsed.token_role);
    case Command::kServe:
    case Command::kServePrivately:
      refuse_unknown_variables(environ);
      serve(parsed.options, parsed.command == Command::kServePrivately, signals);
  }
  return 2;
}

}  // namespace
}  // namespace ccslice::server

int main(int argc, char** argv) {
  ccslice::server::StopSignals signals;
  ccslice::server::bound_kept_memory();
  try {
    return ccslice::server::run({argv + 1, argv + argc}, signals);
  } catch (const ccslice::server::OptionError& error) {
    std::cerr << ccslice::harmless(std::string("ccsliced: ") + error.what()) << "\n";
    return 2;
  } catch (const std::exception& error) {
    std::cerr << ccslice::harmless(std::string("ccsliced: ") + error.what()) << "\n";
    return 1;
  }
}
