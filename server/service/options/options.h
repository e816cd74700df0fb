// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What an operator may set: every option by flag (--cache-bytes 2GiB, or --cache-bytes=2GiB) and by environment
// variable (CCSLICE_CACHE_BYTES=2GiB). The flag wins, then the variable, then the default, which follows the machine's
// or the container's size. Other variables of that prefix are refused (core/base/variables.h).

#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "server/service/base/cgroup.h"
#include "server/service/base/logging.h"
#include "server/service/meshes/mesh_store.h"
#include "server/service/network/certificates.h"
#include "server/service/network/connection_table.h"

namespace ccslice::server {

struct ServerOptions {
  std::string listen_address = "127.0.0.1:50051";
  std::string health_address, metrics_address;  // Empty: nothing is served there.
  CertificateFiles tls;
  std::string token_file;  // Empty: everybody may do everything.
  bool plaintext_tokens = false;
  std::size_t threads = 1;
  std::uint64_t memory_bytes = 0;  // What the defaults of the other sizes are shares of.
  std::uint64_t cache_bytes = 0;
  std::chrono::milliseconds mesh_time_to_live{0};  // 0: meshes don't expire.
  std::size_t max_concurrent_calls = 32;
  std::size_t max_calls_per_client = 0;
  std::size_t max_waiting_calls = 0;
  std::chrono::milliseconds admission_wait{10'000};
  std::uint64_t stream_window_bytes = 0;
  std::uint64_t stream_budget_bytes = 0;
  std::uint64_t scratch_budget_bytes = 0;
  std::uint64_t max_mesh_bytes = 0;
  MeshStoreOptions mesh_store;
  std::size_t warm_meshes = 0;
  std::uint64_t upload_budget_bytes = 0;
  std::chrono::milliseconds upload_loan{30'000};  // Of its last quarter; none of the command line's.
  std::uint64_t min_upload_rate = 0;              // Bytes a second. 0: any.
  std::uint64_t preparation_budget_bytes = 0;
  std::uint64_t max_message_bytes = 0;
  std::uint64_t connection_budget_bytes = 0;
  std::size_t max_connections = 10'000;
  std::size_t max_connections_per_address = 0;
  std::chrono::milliseconds connection_idle{0};  // 0: a connection without calls may stay.
  std::uint32_t max_connection_streams = 128;
  std::chrono::milliseconds idle_timeout{0};          // 0: a silent client may stay.
  std::chrono::milliseconds preview_idle_timeout{0};  // Likewise.
  std::chrono::milliseconds max_connection_age{0};    // 0: any age.
  std::chrono::milliseconds drain_delay{0};
  std::chrono::milliseconds shutdown_grace{0};
  LogLevel log_level = LogLevel::kInfo;
  LogFormat log_format = LogFormat::kText;
};

/// What all budgets and the process itself may take together: more than the memory only where budgets were given.
std::uint64_t budgeted_memory(const ServerOptions& options);

/// What the options allow, or in proportion less where there are fewer descriptors, which the log says.
ConnectionLimits connection_limits(const ServerOptions& options, std::size_t descriptors);

/// What the command line asks for.
enum class Command { kServe, kServePrivately, kHelp, kVersion, kHealthCheck, kHashToken };

struct ParsedOptions {
  Command command = Command::kServe;
  ServerOptions options;
  std::string health_check_address;    // kHealthCheck.
  std::string token_name, token_role;  // kHashToken.
};

/// A message for the operator: names the flag or the variable and says what it takes.
class OptionError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

using Environment = std::function<std::optional<std::string>(const std::string& name)>;

/// The environment of this process.
[[nodiscard]] std::optional<std::string> process_environment(const std::string& name);

/// Throws OptionError. `arguments`: without the program's name.
ParsedOptions parse_options(const std::vector<std::string>& arguments, const Environment& environment,
                            const Resources& resources);

/// Throws OptionError if the environment has a variable of this prefix that nobody reads: most likely a misspelled one.
void refuse_unknown_variables(const char* const* environment);

/// The variable that sets an option: "CCSLICE_CACHE_BYTES" of "--cache-bytes".
std::vector<std::string> option_variables();

/// The text of --help, with the defaults that hold on this machine.
std::string help_text(const Resources& resources);

}  // namespace ccslice::server
