// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/base/variables.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "core/base/echo.h"
#include "core/base/similar_name.h"

namespace ccslice {
namespace {

/// tests/server compares them with the options.
constexpr auto kServerVariables = std::to_array<std::string_view>({
    "ADMISSION_WAIT",
    "ALLOW_PLAINTEXT_TOKENS",
    "CACHE_BYTES",
    "CONNECTION_BUDGET_BYTES",
    "CONNECTION_IDLE",
    "DRAIN_DELAY",
    "HEALTH_LISTEN",
    "IDLE_TIMEOUT",
    "LISTEN",
    "LOG_FORMAT",
    "LOG_LEVEL",
    "MAX_CALLS_PER_CLIENT",
    "MAX_CONCURRENT_CALLS",
    "MAX_CONNECTIONS",
    "MAX_CONNECTIONS_PER_ADDRESS",
    "MAX_CONNECTION_AGE",
    "MAX_CONNECTION_STREAMS",
    "MAX_MESH_BYTES",
    "MAX_MESSAGE_BYTES",
    "MAX_WAITING_CALLS",
    "MEMORY",
    "MESH_STORE",
    "MESH_STORE_BYTES",
    "MESH_STORE_PASSWORD_FILE",
    "MESH_STORE_TTL",
    "MESH_TTL",
    "METRICS_LISTEN",
    "MIN_UPLOAD_RATE",
    "PREPARATION_BUDGET_BYTES",
    "PREVIEW_IDLE_TIMEOUT",
    "SCRATCH_BUDGET_BYTES",
    "SHUTDOWN_GRACE",
    "STREAM_BUDGET_BYTES",
    "STREAM_WINDOW_BYTES",
    "THREADS",
    "TLS_CERT",
    "TLS_CLIENT_CA",
    "TLS_KEY",
    "TOKEN_FILE",
    "UPLOAD_BUDGET_BYTES",
    "WARM_MESHES",
});

/// The variables of clients, plug-ins, tests and builds.
constexpr auto kOtherVariables = std::to_array<std::string_view>({
    "BUILD",
    "CA",
    "CERT",
    "CHANNEL",
    "KEY",
    "OUTPUT",
    "RANDOM_SEED",
    "SERVER",
    "SHARED_MESHES_DIR",
    "TETRAHEDRA",
    "TOKEN_FILE",
    "UNITY",
    "VIEW",
    "WERROR",
});

/// farm.py knows its own.
constexpr std::string_view kFarmPrefix = "FARM_";

/// https://kubernetes.io/docs/tutorials/services/connect-applications-service/#environment-variables: for a service
/// "ccslice" or "ccslice-x" NAME_SERVICE_HOST, NAME_SERVICE_PORT, NAME_SERVICE_PORT_OFPORT, NAME_PORT=tcp://..., and
/// NAME_PORT_80_TCP with three that begin so.
bool tells_of_service(std::string_view variable, std::string_view value) {
  const std::string_view name = variable.substr(kVariablePrefix.size() - 1);  // From the "_" on.
  if (name.ends_with("_SERVICE_HOST") || name.find("_SERVICE_PORT") != std::string_view::npos) return true;
  if (name.ends_with("_PORT") && value.find("://") != std::string_view::npos) return true;
  constexpr std::string_view kPort = "_PORT_";
  for (std::size_t at = name.find(kPort); at != std::string_view::npos; at = name.find(kPort, at + 1)) {
    const std::string_view port = name.substr(at + kPort.size());
    if (!port.empty() && port.front() >= '0' && port.front() <= '9') return true;
  }
  return false;
}

bool is_known(std::string_view name) {
  return name.starts_with(kFarmPrefix) || std::ranges::find(kServerVariables, name) != kServerVariables.end() ||
         std::ranges::find(kOtherVariables, name) != kOtherVariables.end();
}

/// By letters that differ, no more than a third of them; empty if there is none.
std::string_view nearest(std::string_view name) {
  constexpr std::size_t kLongest = 64, kShare = 3;
  if (name.size() > kLongest) return {};
  std::string_view found;
  std::size_t least = std::max<std::size_t>(name.size() / kShare, 1) + 1;
  const auto look_at = [&](std::string_view known) {
    const std::size_t letters = edit_distance(known, name);
    if (letters >= least) return;
    least = letters;
    found = known;
  };
  std::ranges::for_each(kServerVariables, look_at);
  std::ranges::for_each(kOtherVariables, look_at);
  return found;
}

}  // namespace

std::span<const std::string_view> server_variables() { return kServerVariables; }

std::string describe_unknown_variable(const char* const* environment) {
  for (; *environment != nullptr; ++environment) {
    const std::string_view entry = *environment;
    const std::string_view variable = entry.substr(0, entry.find('='));
    if (!variable.starts_with(kVariablePrefix)) continue;
    const std::string_view name = variable.substr(kVariablePrefix.size());
    if (is_known(name) || tells_of_service(variable, entry.substr(std::min(variable.size() + 1, entry.size()))))
      continue;
    const std::string_view meant = nearest(name);
    return "no program of ccslice reads the environment variable " + echoed(std::string(variable)) +
           (meant.empty() ? "; ccsliced --help lists the server's" : "; did you mean " + std::string(kVariablePrefix)) +
           std::string(meant) + (meant.empty() ? ": correct or unset it" : "? Correct or unset it");
  }
  return "";
}

}  // namespace ccslice
