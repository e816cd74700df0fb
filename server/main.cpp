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
#include <vector>

#include "core/base/engine_version.h"
#include "server/rpc/health_client.h"
#include "server/rpc/server.h"
#include "server/service/logging.h"
#include "server/service/options.h"
#include "server/service/private_socket.h"

namespace ccslice::server {
namespace {

constexpr std::chrono::seconds kLastLines(1);  // What the log's reader has to take the last lines.

/// SIGTERM and SIGINT, blocked before any thread starts and waited for in one place. Neither a reader of the log that
/// goes nor a terminal that closes ends the server.
class StopSignals {
 public:
  StopSignals() {
    std::signal(SIGPIPE, SIG_IGN);
    std::signal(SIGHUP, SIG_IGN);
    sigemptyset(&signals_);
    sigaddset(&signals_, SIGTERM);
    sigaddset(&signals_, SIGINT);
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
  }

  /// Whether one comes within this time.
  bool wait(std::time_t seconds) const {
    const timespec timeout{.tv_sec = seconds, .tv_nsec = 0};
    return sigtimedwait(&signals_, nullptr, &timeout) > 0;
  }

 private:
  sigset_t signals_;
};

/// Tells the program that started this one where to call, and stops the server once that program has gone.
void serve_parent(const std::string& address) {
  std::cout << address << std::endl;
  std::thread([] {
    wait_for_end_of_input(STDIN_FILENO);
    kill(getpid(), SIGTERM);
  }).detach();
}

[[noreturn]] void serve(ServerOptions options, bool privately, const StopSignals& signals) {
  set_up_logging(options.log_level, options.log_format);
  std::unique_ptr<PrivateSocket> socket;
  if (privately) {
    socket = std::make_unique<PrivateSocket>();
    options.listen_address = socket->address();
    options.shutdown_grace = std::chrono::milliseconds(0);  // Whoever calls has gone.
  }
  Server server(options);
  if (privately) serve_parent(server.address());
  spdlog::info("ccsliced {} (engine {}) serves on {}: {} threads, {} bytes for meshes", CCSLICE_SERVER_VERSION,
               kEngineVersion, server.address(), options.threads, options.cache_bytes);
  while (!signals.wait(1)) server.sweep();
  spdlog::info("stopping: running calls have {} ms", options.shutdown_grace.count());
  const bool all_left = server.drain(options.shutdown_grace, [&signals] { return signals.wait(0); });
  spdlog::info(all_left ? "stopped" : "stopped without waiting for clients that don't read");
  socket = nullptr;
  flush_log(kLastLines);
  std::_Exit(0);  // Threads of gRPC's that wait for connections may sleep for ten seconds more.
}

int run(const std::vector<std::string>& arguments, const StopSignals& signals) {
  const Resources resources = available_resources();
  const ParsedOptions parsed = parse_options(arguments, process_environment, resources);
  switch (parsed.command) {
    case Command::kHelp: std::cout << help_text(resources); return 0;
    case Command::kVersion:
      std::cout << "ccsliced " << CCSLICE_SERVER_VERSION << " (engine " << kEngineVersion << ")\n";
      return 0;
    case Command::kHealthCheck: {
      std::string explanation;
      const bool healthy = check_health(parsed.health_check_address, explanation);
      std::cout << explanation << "\n";
      return healthy ? 0 : 1;
    }
    case Command::kServe:
    case Command::kServePrivately: serve(parsed.options, parsed.command == Command::kServePrivately, signals);
  }
  return 2;
}

}  // namespace
}  // namespace ccslice::server

int main(int argc, char** argv) {
  const ccslice::server::StopSignals signals;
  try {
    return ccslice::server::run({argv + 1, argv + argc}, signals);
  } catch (const ccslice::server::OptionError& error) {
    std::cerr << "ccsliced: " << error.what() << "\n";
    return 2;
  } catch (const std::exception& error) {
    std::cerr << "ccsliced: " << error.what() << "\n";
    return 1;
  }
}
