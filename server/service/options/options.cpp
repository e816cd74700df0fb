// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/options/options.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <limits>

#include "core/base/variables.h"
#include "server/service/base/limits.h"
#include "server/service/base/option_values.h"

namespace ccslice::server {
namespace {

constexpr std::uint64_t kMiB = 1ull << 20;
constexpr std::uint64_t kGiB = 1ull << 30;

/// What protobuf can parse, and gRPC can count.
constexpr std::uint64_t kMaxProtobufBytes = 2047 * kMiB;

/// Four times as many calls wait as run, unless told otherwise.
constexpr std::size_t kFourTimes = std::numeric_limits<std::size_t>::max();
constexpr std::size_t kMostCalls = 100'000;

/// One address may take three quarters of the connections, unless told otherwise.
constexpr std::size_t kThreeQuarters = std::numeric_limits<std::size_t>::max();
constexpr std::size_t kMostConnections = 1'000'000;

/// Below, the budgets' own minima would take more.
constexpr std::uint64_t kLeastMemory = 256 * kMiB;

/// At least so much is for slicers, or a quarter of a small memory.
constexpr std::uint64_t least_scratch(std::uint64_t memory) { return std::min(256 * kMiB, memory / 4); }

constexpr std::uint64_t connection_memory(std::uint64_t memory) {
  return std::clamp(memory / 32, std::min(64 * kMiB, memory / 8), 512 * kMiB);
}

/// For uploads, and for streams.
constexpr std::uint64_t passing_memory(std::uint64_t memory, std::uint64_t least) {
  return std::max(memory / 16, least);
}
constexpr std::uint64_t kLeastMeshBytes = 16 * kMiB, kLeastStreamWindow = 32 * kMiB;

/// What prepared meshes and preparations share, three to two: five eighths, or what all others leave of a small memory.
constexpr std::uint64_t mesh_memory(std::uint64_t memory) {
  const std::uint64_t others = process_memory(memory) + least_scratch(memory) + connection_memory(memory) +
                               passing_memory(memory, kLeastMeshBytes) + passing_memory(memory, kLeastStreamWindow);
  return std::min(memory / 8 * 5, memory - others);
}

/// The sum of all budgets and of what the process takes is the memory, of which there is at least the least.
ServerOptions default_options(std::size_t cpus, std::uint64_t granted_memory) {
  const std::uint64_t memory = std::max(granted_memory, kLeastMemory);
  ServerOptions options;
  options.threads = cpus;
  options.memory_bytes = memory;
  options.cache_bytes = mesh_memory(memory) - mesh_memory(memory) / 5 * 2;
  options.max_concurrent_calls = 32;
  options.max_waiting_calls = kFourTimes;
  options.stream_window_bytes = std::clamp(memory / 32, kLeastStreamWindow, 2 * kGiB);
  options.mesh_store.folder_bytes = 16 * kGiB;
  options.max_mesh_bytes = std::clamp(memory / 16, kLeastMeshBytes, kGiB);
  options.preparation_budget_bytes = mesh_memory(memory) / 5 * 2;
  options.max_message_bytes = kClientMessageBytes;
  options.min_upload_rate = 16 * 1024;
  options.connection_budget_bytes = connection_memory(memory);
  options.max_connections_per_address = kThreeQuarters;
  options.connection_idle = std::chrono::minutes(10);
  options.idle_timeout = std::chrono::seconds(60);
  options.preview_idle_timeout = std::chrono::minutes(30);
  options.shutdown_grace = std::chrono::seconds(25);
  return options;
}

/// A budget holds at least one of what it is for. REQUIRES: 0 if it wasn't set.
void settle_budget(std::uint64_t& budget, std::uint64_t usual, std::uint64_t one, const std::string& budget_flag,
                   const std::string& one_flag) {
  if (budget == 0) budget = std::max(usual, one);
  if (budget >= one) return;
  throw OptionError(budget_flag + " takes a size of at least " + one_flag + ", which is " + show_size(one) + ", not " +
                    show_size(budget));
}

}  // namespace

std::uint64_t budgeted_memory(const ServerOptions& options) {
  return options.cache_bytes + options.preparation_budget_bytes + options.upload_budget_bytes +
         options.stream_budget_bytes + options.connection_budget_bytes + options.scratch_budget_bytes +
         process_memory(options.memory_bytes);
}

namespace {

/// What depends on other options.
void settle_budgets(ServerOptions& options) {
  if (options.max_waiting_calls == kFourTimes) options.max_waiting_calls = 4 * options.max_concurrent_calls;
  if (options.max_calls_per_client == 0) {
    options.max_calls_per_client = std::max<std::size_t>(options.max_concurrent_calls / 2, 1);
  }
  if (options.max_connections_per_address == kThreeQuarters) {
    options.max_connections_per_address = std::max<std::size_t>(options.max_connections * 3 / 4, 1);
  }
  const std::uint64_t usual = options.memory_bytes / 16;
  settle_budget(options.upload_budget_bytes, usual, options.max_mesh_bytes, "--upload-budget-bytes",
                "--max-mesh-bytes");
  settle_budget(options.stream_budget_bytes, usual, options.stream_window_bytes, "--stream-budget-bytes",
                "--stream-window-bytes");
  if (options.scratch_budget_bytes == 0) {
    const std::uint64_t others = budgeted_memory(options);
    options.scratch_budget_bytes =
        std::max(options.memory_bytes - std::min(others, options.memory_bytes), least_scratch(options.memory_bytes));
  }
}

void require_identity(const ServerOptions& options) {
  if (options.tls.certificate.empty() != options.tls.key.empty()) {
    throw OptionError("--tls-cert and --tls-key go together: give both");
  }
  if (!options.tls.client_authority.empty() && options.tls.certificate.empty()) {
    throw OptionError("--tls-client-ca needs TLS: give --tls-cert and --tls-key");
  }
  if (!options.token_file.empty() && options.tls.certificate.empty() && !is_local(options.listen_address) &&
      !options.plaintext_tokens) {
    throw OptionError("--token-file on " + options.listen_address +
                      " would let tokens travel unencrypted: give --tls-cert and --tls-key, or "
                      "--allow-plaintext-tokens yes behind a proxy that ends TLS");
  }
}

/// How one option is written, read and shown.
struct OptionSpec {
  std::string flag;         // "--cache-bytes"; the variable is CCSLICE_CACHE_BYTES.
  std::string placeholder;  // "SIZE".
  std::string help;
  std::function<void(ServerOptions&, const std::string& value)> set;  // Throws std::invalid_argument: what it takes.
  std::function<std::string(const ServerOptions&)> show;
};

struct SizeRange {
  std::uint64_t least;
  std::uint64_t most = kAnySize;
};

OptionSpec size_option(std::string flag, std::uint64_t ServerOptions::*member, SizeRange range, std::string help) {
  return {std::move(flag), "SIZE", std::move(help),
          [=](ServerOptions& o, const std::string& v) { o.*member = parse_size(v, range.least, range.most); },
          [=](const ServerOptions& o) { return show_size(o.*member); }};
}

template <class T>
OptionSpec count_option(std::string flag, T ServerOptions::*member, std::uint64_t most, std::string help) {
  return {std::move(flag), "N", std::move(help),
          [=](ServerOptions& o, const std::string& v) { o.*member = static_cast<T>(parse_count(v, 1, most)); },
          [=](const ServerOptions& o) { return std::to_string(o.*member); }};
}

OptionSpec duration_option(std::string flag, std::chrono::milliseconds ServerOptions::*member, std::string help) {
  return {std::move(flag), "TIME", std::move(help),
          [=](ServerOptions& o, const std::string& v) { o.*member = parse_duration(v); },
          [=](const ServerOptions& o) { return show_duration(o.*member); }};
}

OptionSpec file_option(std::string flag, CertificateFiles ServerOptions::*files, std::string CertificateFiles::*member,
                       std::string help) {
  return {std::move(flag), "FILE", std::move(help),
          [=](ServerOptions& o, const std::string& v) { o.*files.*member = v; },
          [=](const ServerOptions& o) { return (o.*files.*member).empty() ? "none" : o.*files.*member; }};
}

/// For programs on other machines, such as probes: no Unix socket.
OptionSpec address_option(std::string flag, std::string ServerOptions::*member, std::string help) {
  return {std::move(flag), "HOST:PORT", std::move(help),
          [=](ServerOptions& o, const std::string& v) {
            if (v.starts_with("unix:")) throw std::invalid_argument("HOST:PORT");
            o.*member = v.empty() ? "" : parse_address(v);
          },
          [=](const ServerOptions& o) { return (o.*member).empty() ? "none" : o.*member; }};
}

template <class T>
OptionSpec choice_option(std::string flag, T ServerOptions::*member, std::vector<std::string> names, std::string help) {
  return {std::move(flag), join(names, "|"), std::move(help),
          [=](ServerOptions& o, const std::string& v) { o.*member = static_cast<T>(parse_choice(v, names)); },
          [=](const ServerOptions& o) { return names[static_cast<std::size_t>(o.*member)]; }};
}

// NOLINTNEXTLINE(readability-function-size): a row for each option.
const std::vector<OptionSpec>& option_specs() {
  static const std::vector<OptionSpec> specs = {
      {"--listen", "HOST:PORT",
       "Address to serve on; port 0 takes a free one and logs it. 0.0.0.0:50051 is all addresses of this machine, "
       "where "
       "nothing but a proxy or a firewall protects the server.",
       [](ServerOptions& o, const std::string& v) { o.listen_address = parse_address(v); },
       [](const ServerOptions& o) { return o.listen_address; }},
      file_option(
          "--tls-cert", &ServerOptions::tls, &CertificateFiles::certificate,
          "Serve with TLS and this certificate (PEM, with its chain). Renewed files are taken within seconds; a "
          "pair that doesn't fit together isn't."),
      file_option("--tls-key", &ServerOptions::tls, &CertificateFiles::key, "The key of --tls-cert (PEM)."),
      file_option("--tls-client-ca", &ServerOptions::tls, &CertificateFiles::client_authority,
                  "Take only clients that show a certificate of this authority (PEM). Its name is the client's."),
      {"--token-file", "FILE",
       "Who may do what: a line for each token, NAME ROLE sha256:HEX [calls=N] [expires=DATE]. Roles are read, write "
       "(upload too) and admin (list and delete too). \"anonymous read\" lets everybody read. ccsliced --hash-token "
       "makes a line. Read again when it changes, and on SIGHUP. Empty: everybody may do everything.",
       [](ServerOptions& o, const std::string& v) { o.token_file = v; },
       [](const ServerOptions& o) { return o.token_file.empty() ? "none" : o.token_file; }},
      {"--allow-plaintext-tokens", "no|yes",
       "Take tokens without TLS beyond this machine: for servers behind a proxy that ends TLS.",
       [](ServerOptions& o, const std::string& v) {
         o.plaintext_tokens = parse_choice(v, {"no", "yes"}) == 1;
       },
       [](const ServerOptions& o) { return o.plaintext_tokens ? "yes" : "no"; }},
      address_option("--health-listen", &ServerOptions::health_address,
                     "Serve grpc.health.v1 alone here, without TLS, for probes. --health-check asks here, too."),
      address_option("--metrics-listen", &ServerOptions::metrics_address,
                     "Serve /metrics (for Prometheus), /healthz and /readyz (503 while it shuts down, for proxies) "
                     "over HTTP here."),
      count_option("--threads", &ServerOptions::threads, 1024,
                   "Worker threads. By default as many as the CPUs this process may use (its cgroup's quota counts)."),
      size_option("--memory", &ServerOptions::memory_bytes, {kLeastMemory},
                  "Memory that the server should do with: the defaults of the sizes below are shares of it. By default "
                  "what this process may use (its cgroup's limit counts)."),
      size_option("--cache-bytes", &ServerOptions::cache_bytes, {kMiB},
                  "Memory for prepared meshes. When it is full, the least recently used ones are dropped, but none in "
                  "use. By default three eighths of --memory, or less of a small one."),
      duration_option("--mesh-ttl", &ServerOptions::mesh_time_to_live,
                      "Drop meshes that nobody used for this long. 0 keeps them until the cache needs the room."),
      {"--mesh-store", "PLACE",
       "Where servers share their meshes, so that each can slice what was uploaded to any of them, and none forgets: "
       "dir:FOLDER, a folder that all of them see, or redis://HOST:PORT/DATABASE. Uploads are written there before "
       "they are answered; a mesh that isn't cached is read from there. Where the store is slow or down, calls go on "
       "without it. Empty: no store.",
       [](ServerOptions& o, const std::string& v) {
         o.mesh_store.place.reset();
         if (!v.empty()) o.mesh_store.place = parse_mesh_store(v);
       },
       [](const ServerOptions& o) { return o.mesh_store.place ? show_mesh_store(*o.mesh_store.place) : "none"; }},
      {"--mesh-store-bytes", "SIZE",
       "What a folder of --mesh-store may hold; beyond, the least recently used meshes are deleted. Redis has limits "
       "of "
       "its own (maxmemory, allkeys-lru).",
       [](ServerOptions& o, const std::string& v) { o.mesh_store.folder_bytes = parse_size(v, kMiB); },
       [](const ServerOptions& o) { return show_size(o.mesh_store.folder_bytes); }},
      {"--mesh-store-ttl", "TIME",
       "Let Redis drop meshes that nobody used for this long. 0 keeps them until Redis needs the room.",
       [](ServerOptions& o, const std::string& v) {
         o.mesh_store.time_to_live_s = static_cast<std::uint64_t>(parse_duration(v).count() + 999) / 1000;
       },
       [](const ServerOptions& o) { return show_duration(std::chrono::seconds(o.mesh_store.time_to_live_s)); }},
      {"--mesh-store-password-file", "FILE", "A file whose first line is the password of Redis. Empty: none is needed.",
       [](ServerOptions& o, const std::string& v) { o.mesh_store.password_file = v; },
       [](const ServerOptions& o) { return o.mesh_store.password_file.empty() ? "none" : o.mesh_store.password_file; }},
      {"--warm-meshes", "N", "Prepare this many meshes of the store, last used first, before serving.",
       [](ServerOptions& o, const std::string& v) { o.warm_meshes = parse_count(v, 0, kMostCalls); },
       [](const ServerOptions& o) { return std::to_string(o.warm_meshes); }},
      count_option("--max-concurrent-calls", &ServerOptions::max_concurrent_calls, kMostCalls,
                   "Calls that compute at the same time, and a quarter as many more short ones. Further ones wait."),
      {"--max-calls-per-client", "N",
       "Calls that one client, by its token or its certificate, may have open; further ones get CLIENT_LIMIT. calls=N "
       "of --token-file goes before. Previews don't count. By default half of --max-concurrent-calls.",
       [](ServerOptions& o, const std::string& v) {
         o.max_calls_per_client = static_cast<std::size_t>(parse_count(v, 1, kMostCalls));
       },
       [](const ServerOptions& o) { return std::to_string(o.max_calls_per_client); }},
      {"--max-waiting-calls", "N",
       "Calls that wait for one of those to end, clients in turn. Further ones are refused and asked to retry "
       "(SERVER_BUSY). By default four times --max-concurrent-calls; 0 lets none wait.",
       [](ServerOptions& o, const std::string& v) {
         o.max_waiting_calls = static_cast<std::size_t>(parse_count(v, 0, 4 * kMostCalls));
       },
       [](const ServerOptions& o) { return std::to_string(o.max_waiting_calls); }},
      duration_option("--admission-wait", &ServerOptions::admission_wait,
                      "How long such a call waits at most, before it is refused (SERVER_BUSY)."),
      size_option("--stream-window-bytes", &ServerOptions::stream_window_bytes, {kMiB},
                  "Layers or triangles that one call may hold in memory, ahead of a client that reads slowly. Also "
                  "bounds the size of a single layer."),
      size_option("--stream-budget-bytes", &ServerOptions::stream_budget_bytes, {kMiB},
                  "Memory that all those calls may hold together; at least --stream-window-bytes. The less is left, "
                  "the smaller the windows of new calls. Calls for which nothing is left wait for it "
                  "(--admission-wait)."),
      size_option(
          "--scratch-budget-bytes", &ServerOptions::scratch_budget_bytes, {16 * kMiB},
          "Memory that slicing and tessellating may take together, by estimate, besides what comes of it; batches of "
          "points and what comes of them, too. A call works "
          "with as many slicers as fit, and waits where not even one does (--admission-wait). One that could "
          "never begin is refused (JOB_EXCEEDS_MEMORY). Some is kept for short ranges. By default what the other "
          "budgets leave of --memory, less 256MiB or a quarter for the process, but at least as much again."),
      size_option("--max-mesh-bytes", &ServerOptions::max_mesh_bytes, {1024, kMaxProtobufBytes}, "Largest upload."),
      size_option("--upload-budget-bytes", &ServerOptions::upload_budget_bytes, {1024},
                  "Bytes that all running uploads may hold together; at least --max-mesh-bytes."),
      {"--min-upload-rate", "SIZE",
       "Bytes a second that an upload has to bring, over each ten seconds; slower ones end (UPLOAD_TOO_SLOW). 0 takes "
       "any.",
       [](ServerOptions& o, const std::string& v) { o.min_upload_rate = parse_size(v, 0); },
       [](const ServerOptions& o) { return show_size(o.min_upload_rate); }},
      size_option("--preparation-budget-bytes", &ServerOptions::preparation_budget_bytes, {kMiB},
                  "Memory that all running preparations may take together, by estimate. An upload that needs more on "
                  "its own is refused. One that needs more than is left waits."),
      size_option("--max-message-bytes", &ServerOptions::max_message_bytes, {64 * 1024, kMaxProtobufBytes},
                  "Largest message a client may send. Clients keep below 4MiB unless told otherwise."),
      count_option("--max-connections", &ServerOptions::max_connections, kMostConnections,
                   "Connections at the same time; further ones are closed at once. Each takes a file descriptor, so "
                   "the limit of open files (ulimit -n, the hard one) may allow fewer."),
      count_option("--max-connections-per-address", &ServerOptions::max_connections_per_address, kMostConnections,
                   "Of those, connections from one IPv4 address, or from one /64 of IPv6. By default three quarters of "
                   "--max-connections. Behind a proxy all come from the proxy's address."),
      size_option("--connection-budget-bytes", &ServerOptions::connection_budget_bytes, {16 * kMiB},
                  "Memory for what arrives over all connections and isn't a whole message yet. Where more comes, calls "
                  "and connections are ended for it. By default a thirty-second of the memory this process may use, "
                  "but at most 512MiB and at least 64MiB or an eighth."),
      duration_option("--connection-idle", &ServerOptions::connection_idle,
                      "Drop connections on which no call has been open for this long; clients connect again by "
                      "themselves. 0 keeps them."),
      count_option("--max-connection-streams", &ServerOptions::max_connection_streams, 1'000'000,
                   "Calls at the same time on one connection; further ones wait in the client."),
      duration_option("--idle-timeout", &ServerOptions::idle_timeout,
                      "End calls that wait this long for their client to send (STREAM_IDLE) or to read "
                      "(STREAM_STALLED). 0 lets them wait."),
      duration_option("--preview-idle-timeout", &ServerOptions::preview_idle_timeout,
                      "End Preview calls that wait this long for their client to ask for a picture (STREAM_IDLE), in "
                      "place of --idle-timeout. 0 lets them wait."),
      duration_option("--max-connection-age", &ServerOptions::max_connection_age,
                      "Ask clients to connect again after this long, so that they find new servers; calls have "
                      "--shutdown-grace to end. 0 keeps connections."),
      duration_option(
          "--drain-delay", &ServerOptions::drain_delay,
          "After SIGTERM or SIGINT, health says NOT_SERVING for this long while calls are still taken: those "
          "who send clients here learn it late."),
      duration_option(
          "--shutdown-grace", &ServerOptions::shutdown_grace,
          "After SIGTERM or SIGINT running calls may go on for this long; then they are cancelled. A second "
          "signal cancels them at once."),
      choice_option("--log-level", &ServerOptions::log_level, {"debug", "info", "warning", "error"},
                    "Log messages of this level and above, to standard error."),
      choice_option("--log-format", &ServerOptions::log_format, {"text", "json"},
                    "Plain lines for people, or one JSON object a line."),
  };
  return specs;
}

std::string variable_of(const std::string& flag) {
  std::string name = std::string(kVariablePrefix) + flag.substr(2);
  std::transform(name.begin(), name.end(), name.begin(), [](char c) {
    if (c == '-') return '_';
    return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  });
  return name;
}

void set_option(const OptionSpec& spec, ServerOptions& options, const std::string& source, const std::string& value) {
  try {
    spec.set(options, value);
  } catch (const std::invalid_argument& takes) {
    // Addresses may have passwords in them, where they don't belong.
    const bool may_hold_secret = value.find("://") != std::string::npos && value.find('@') != std::string::npos;
    throw OptionError(source + " takes " + takes.what() + (may_hold_secret ? "" : ", not \"" + value + "\""));
  }
}

const OptionSpec& find_spec(const std::string& flag) {
  const auto& specs = option_specs();
  const auto spec = std::find_if(specs.begin(), specs.end(), [&](const OptionSpec& s) { return s.flag == flag; });
  if (spec == specs.end()) throw OptionError("unknown option \"" + flag + "\"; ccsliced --help lists them all");
  return *spec;
}

std::string health_check_address(const std::string& value) {
  try {
    return parse_address(value);
  } catch (const std::invalid_argument& takes) {
    throw OptionError(std::string("--health-check takes ") + takes.what() + ", not \"" + value + "\"");
  }
}

bool parse_command(const std::vector<std::string>& arguments, std::size_t& i, ParsedOptions& parsed) {
  const std::string& argument = arguments[i];
  if (argument == "--help" || argument == "-h") {
    parsed.command = Command::kHelp;
  } else if (argument == "--version") {
    parsed.command = Command::kVersion;
  } else if (argument == "--private") {
    parsed.command = Command::kServePrivately;
  } else if (argument == "--hash-token") {
    parsed.command = Command::kHashToken;
    for (std::string* const word : {&parsed.token_name, &parsed.token_role}) {
      if (i + 1 < arguments.size() && !arguments[i + 1].starts_with("-")) *word = arguments[++i];
    }
  } else if (argument == "--health-check") {
    parsed.command = Command::kHealthCheck;
    if (i + 1 < arguments.size() && !arguments[i + 1].starts_with("-")) {
      parsed.health_check_address = health_check_address(arguments[++i]);
    }
  } else {
    return false;
  }
  return true;
}

/// The environment, then the arguments, over what is in `parsed`.
void parse_all(const std::vector<std::string>& arguments, const Environment& environment, ParsedOptions& parsed) {
  for (const OptionSpec& spec : option_specs()) {
    const std::string variable = variable_of(spec.flag);
    if (const auto value = environment(variable)) set_option(spec, parsed.options, variable, *value);
  }
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    if (parse_command(arguments, i, parsed)) continue;
    const std::size_t equals = arguments[i].find('=');
    const std::string flag = arguments[i].substr(0, equals);
    const OptionSpec& spec = find_spec(flag);
    if (equals != std::string::npos) {
      set_option(spec, parsed.options, flag, arguments[i].substr(equals + 1));
    } else if (i + 1 < arguments.size()) {
      set_option(spec, parsed.options, flag, arguments[++i]);
    } else {
      throw OptionError(flag + " needs a value: " + flag + " " + spec.placeholder);
    }
  }
}

}  // namespace

std::optional<std::string> process_environment(const std::string& name) {
  const char* value = std::getenv(name.c_str());
  if (value == nullptr) return std::nullopt;
  return value;
}

ConnectionLimits connection_limits(const ServerOptions& options, std::size_t descriptors) {
  ConnectionLimits limits{.connections = options.max_connections,
                          .per_address = std::min(options.max_connections_per_address, options.max_connections),
                          .idle = options.connection_idle,
                          .arriving = options.idle_timeout,
                          .arriving_bytes = options.connection_budget_bytes / 4,  // gRPC refuses calls at its end.
                          .streams = options.max_connection_streams,
                          .encrypted = !options.tls.certificate.empty()};
  // gRPC itself ends idle connections, politely. It takes for a call, and leaves, a request that never comes in whole.
  constexpr std::chrono::seconds kGrace{5};
  if (limits.idle.count() > 0) limits.idle += kGrace;
  if (descriptors >= limits.connections) return limits;
  limits.per_address = std::max<std::size_t>(limits.per_address * descriptors / limits.connections, 1);
  limits.connections = descriptors;
  spdlog::warn("the limit of open files (ulimit -n) allows {} connections, {} of an address: fewer than {}",
               limits.connections, limits.per_address, options.max_connections);
  return limits;
}

void refuse_unknown_variables(const char* const* environment) {
  const std::string fault = describe_unknown_variable(environment);
  if (!fault.empty()) throw OptionError(fault);
}

std::vector<std::string> option_variables() {
  std::vector<std::string> variables;
  for (const OptionSpec& spec : option_specs()) variables.push_back(variable_of(spec.flag));
  return variables;
}

ParsedOptions parse_options(const std::vector<std::string>& arguments, const Environment& environment,
                            const Resources& resources) {
  const auto parse_over = [&](std::uint64_t memory_bytes) {
    ParsedOptions parsed{.command = Command::kServe,
                         .options = default_options(resources.cpus, memory_bytes),
                         .health_check_address = {},
                         .token_name = {},
                         .token_role = {}};
    parse_all(arguments, environment, parsed);
    return parsed;
  };
  ParsedOptions parsed = parse_over(parse_over(resources.memory_bytes).options.memory_bytes);
  settle_budgets(parsed.options);
  if (parsed.command == Command::kServePrivately) {
    parsed.options.tls = {};  // Nobody else gets in, and whoever starts it doesn't ask for more.
    parsed.options.token_file.clear();
    parsed.options.health_address.clear();
    parsed.options.metrics_address.clear();
    parsed.options.drain_delay = {};
    parsed.options.mesh_store.place.reset();
    parsed.options.warm_meshes = 0;
  }
  require_identity(parsed.options);
  if (parsed.health_check_address.empty()) {
    parsed.health_check_address = local_address(parsed.options.health_address.empty() ? parsed.options.listen_address
                                                                                      : parsed.options.health_address);
  }
  return parsed;
}

std::string help_text(const Resources& resources) {
  ServerOptions defaults = default_options(resources.cpus, resources.memory_bytes);
  settle_budgets(defaults);
  std::string text =
      "ccsliced - slices Catmull-Clark solids into voxel layers, over gRPC\n"
      "\n"
      "Usage:\n"
      "  ccsliced [options]                     serve until SIGTERM or SIGINT\n"
      "  ccsliced --private [options]           serve the program that started it, and nobody else\n"
      "  ccsliced --health-check [HOST:PORT]    ask a running server; exit code 0 if it serves, 1 if not\n"
      "  ccsliced --hash-token NAME ROLE        make a line of --token-file; the token comes from standard input\n"
      "  ccsliced --help | --version\n"
      "\n"
      "Every option may also be set by the environment variable named below it; the flag wins. A SIZE is bytes, or has "
      "a\n"
      "unit: 64KiB, 512MiB, 2GiB. A TIME has a unit: 500ms, 30s, 10m, 2h; 0 is 0. The defaults shown are those on "
      "this\n"
      "machine: " +
      std::to_string(resources.cpus) + " CPUs and " + show_size(resources.memory_bytes) +
      " of memory, limits of the container included.\n"
      "\n"
      "Options:\n";
  for (const OptionSpec& spec : option_specs()) {
    text += "  " + spec.flag + " " + spec.placeholder + "    (default: " + spec.show(defaults) + ")\n";
    text += "  " + variable_of(spec.flag) + "\n";
    text += wrap(spec.help, 110, "      ");
  }
  text +=
      "\n"
      "--private is for programs that start a server of their own, as ccslice does: it listens on a Unix socket in a\n"
      "folder that only this user may enter (instead of --listen), prints the socket's address as the first line of\n"
      "standard output, and ends when its standard input is closed, at once.\n"
      "\n"
      "Examples:\n"
      "  ccsliced --listen 127.0.0.1:50051 --log-format json\n"
      "  CCSLICE_CACHE_BYTES=4GiB CCSLICE_MESH_TTL=2h ccsliced\n"
      "  ccslice info --server localhost:50051\n"
      "\n"
      "The contract is proto/ccslice/v1; gRPC reflection and grpc.health.v1 are served too.\n";
  return text;
}

}  // namespace ccslice::server
