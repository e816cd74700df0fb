// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/options/options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "core/base/variables.h"
#include "server/service/base/option_values.h"

namespace ccslice::server {
namespace {

using ::testing::HasSubstr;
using ::testing::UnorderedElementsAreArray;

const Resources kMachine{.cpus = 6, .memory_bytes = 16ull << 30};

ParsedOptions parse(const std::vector<std::string>& arguments, const std::map<std::string, std::string>& variables = {},
                    const Resources& machine = kMachine) {
  return parse_options(
      arguments,
      [&](const std::string& name) -> std::optional<std::string> {
        const auto variable = variables.find(name);
        if (variable == variables.end()) return std::nullopt;
        return variable->second;
      },
      machine);
}

std::string fault(const std::vector<std::string>& arguments, const std::map<std::string, std::string>& variables = {}) {
  try {
    parse(arguments, variables);
  } catch (const OptionError& error) {
    return error.what();
  }
  return "";
}

TEST(Options, FollowTheMachineByDefault) {
  const ServerOptions options = parse({}).options;
  EXPECT_EQ(options.threads, 6u);
  EXPECT_EQ(options.cache_bytes, 6ull << 30);
  EXPECT_EQ(options.max_message_bytes, 4u << 20);
  EXPECT_EQ(options.listen_address, "127.0.0.1:50051") << "nothing protects it";
}

TEST(Options, VariablesAreThoseThatAllProgramsKnow) {
  std::vector<std::string> known;
  for (const std::string_view name : server_variables()) known.push_back(std::string(kVariablePrefix).append(name));
  EXPECT_THAT(known, UnorderedElementsAreArray(option_variables())) << "core/base/variables.cpp lists them, too";
}

TEST(Options, RefuseMisspelledVariables) {
  const std::vector<const char*> right = {"CCSLICE_MEMORY=1GiB", "CCSLICE_SERVER=a:1", nullptr};
  EXPECT_NO_THROW(refuse_unknown_variables(right.data()));
  const std::vector<const char*> wrong = {"CCSLICE_MEMROY=1GiB", nullptr};
  try {
    refuse_unknown_variables(wrong.data());
    ADD_FAILURE() << "it passes";
  } catch (const OptionError& error) {
    EXPECT_THAT(error.what(), HasSubstr("CCSLICE_MEMROY; did you mean CCSLICE_MEMORY?"));
  }
}

TEST(Options, LeaveMemoryForTheProcessItself) {
  for (const std::uint64_t memory : {256ull << 20, 512ull << 20, 1ull << 30, 2ull << 30, 16ull << 30, 512ull << 30}) {
    const ServerOptions o = parse({}, {}, {.cpus = 2, .memory_bytes = memory}).options;
    const std::uint64_t process = std::min<std::uint64_t>(256 << 20, memory / 4);
    EXPECT_LE(o.cache_bytes + o.preparation_budget_bytes + o.upload_budget_bytes + o.stream_budget_bytes +
                  o.connection_budget_bytes + o.scratch_budget_bytes + process,
              memory)
        << memory;
    EXPECT_LE(o.cache_bytes + o.preparation_budget_bytes + o.upload_budget_bytes + o.stream_budget_bytes,
              memory / 4 * 3)
        << memory;
  }
}

TEST(Options, SizesAreSharesOfTheMemoryThatIsGiven) {
  const ServerOptions of_machine = parse({}, {}, {.cpus = 6, .memory_bytes = 4ull << 30}).options;
  for (const ServerOptions& given :
       {parse({"--memory", "4GiB"}).options, parse({"--memory=4GiB"}, {{"CCSLICE_MEMORY", "3GiB"}}).options,
        parse({}, {{"CCSLICE_MEMORY", "4GiB"}}).options}) {
    EXPECT_EQ(given.memory_bytes, 4ull << 30);
    EXPECT_EQ(given.cache_bytes, of_machine.cache_bytes);
    EXPECT_EQ(given.max_mesh_bytes, of_machine.max_mesh_bytes);
    EXPECT_EQ(given.preparation_budget_bytes, of_machine.preparation_budget_bytes);
    EXPECT_EQ(given.stream_window_bytes, of_machine.stream_window_bytes);
    EXPECT_EQ(given.stream_budget_bytes, of_machine.stream_budget_bytes);
    EXPECT_EQ(given.upload_budget_bytes, of_machine.upload_budget_bytes);
  }
  const ServerOptions own = parse({"--cache-bytes", "100MiB", "--memory", "4GiB"}).options;
  EXPECT_EQ(own.cache_bytes, 100u << 20) << "whatever the order";
  EXPECT_THAT(fault({"--memory", "2MiB"}), HasSubstr("--memory takes a size of at least 256MiB"));
}

TEST(Options, ComeByFlagInBothForms) {
  const ServerOptions options =
      parse({"--threads", "3", "--cache-bytes=256MiB", "--mesh-ttl", "2h", "--log-format", "json",
             "--log-level=warning", "--listen", "[::]:0", "--shutdown-grace", "500ms"})
          .options;
  EXPECT_EQ(options.threads, 3u);
  EXPECT_EQ(options.cache_bytes, 256ull << 20);
  EXPECT_EQ(options.mesh_time_to_live, std::chrono::hours(2));
  EXPECT_EQ(options.log_format, LogFormat::kJson);
  EXPECT_EQ(options.log_level, LogLevel::kWarning);
  EXPECT_EQ(options.listen_address, "[::]:0");
  EXPECT_EQ(options.shutdown_grace, std::chrono::milliseconds(500));
}

TEST(Options, ComeByEnvironmentAndTheFlagWins) {
  EXPECT_EQ(parse({}, {{"CCSLICE_THREADS", "4"}}).options.threads, 4u);
  EXPECT_EQ(parse({"--threads=2"}, {{"CCSLICE_THREADS", "4"}}).options.threads, 2u);
  EXPECT_EQ(parse({}, {{"CCSLICE_MAX_CONCURRENT_CALLS", "7"}}).options.max_concurrent_calls, 7u);
}

TEST(Options, FaultsNameTheFlagOrVariableAndWhatItTakes) {
  EXPECT_THAT(fault({"--thread", "3"}), HasSubstr("unknown option \"--thread\""));
  EXPECT_THAT(fault({"--threads"}), HasSubstr("--threads N"));
  EXPECT_THAT(fault({"--threads", "0"}), HasSubstr("from 1 to 1024"));
  EXPECT_THAT(fault({"--cache-bytes", "many"}), HasSubstr("such as 512MiB"));
  EXPECT_THAT(fault({"--log-level", "loud"}), HasSubstr("debug, info, warning, error"));
  EXPECT_THAT(fault({"--listen", "nowhere"}), HasSubstr("HOST:PORT"));
  EXPECT_THAT(fault({}, {{"CCSLICE_MESH_TTL", "5"}}), HasSubstr("CCSLICE_MESH_TTL takes a time"));
}

TEST(Options, SizesOutOfRangeAreRefusedWithTheRange) {
  EXPECT_THAT(fault({"--max-message-bytes", "3GiB"}),
              HasSubstr("--max-message-bytes takes a size from 64KiB to 2047MiB, such as 512MiB, not \"3GiB\""));
  EXPECT_THAT(fault({}, {{"CCSLICE_MAX_MESH_BYTES", "2GiB"}}),
              HasSubstr("CCSLICE_MAX_MESH_BYTES takes a size from 1KiB to 2047MiB"));
  EXPECT_EQ(parse({"--max-mesh-bytes", "2047MiB"}).options.max_mesh_bytes, 2047ull << 20);
}

TEST(Options, ABudgetHoldsAtLeastOneOfWhatItIsFor) {
  EXPECT_THAT(fault({"--max-mesh-bytes", "64MiB", "--upload-budget-bytes", "32MiB"}),
              HasSubstr("--upload-budget-bytes takes a size of at least --max-mesh-bytes, which is 64MiB, not 32MiB"));
  EXPECT_THAT(fault({"--stream-budget-bytes", "1MiB"}), HasSubstr("at least --stream-window-bytes"));
  const ServerOptions options = parse({"--max-mesh-bytes", "1000MiB", "--stream-window-bytes", "4GiB"}).options;
  EXPECT_EQ(options.upload_budget_bytes, 1ull << 30) << "a sixteenth of the memory";
  EXPECT_EQ(options.stream_budget_bytes, 4ull << 30) << "follows what it is for";
}

TEST(Options, HealthCheckTakesAnAddressOrThatOfTheServer) {
  EXPECT_EQ(parse({"--private", "--threads", "2"}).command, Command::kServePrivately);
  EXPECT_EQ(parse({"--health-check"}).command, Command::kHealthCheck);
  EXPECT_EQ(parse({"--health-check"}).health_check_address, "127.0.0.1:50051");
  EXPECT_EQ(parse({"--health-check", "--listen", "0.0.0.0:7"}).health_check_address, "localhost:7");
  EXPECT_EQ(parse({"--health-check"}, {{"CCSLICE_LISTEN", "127.0.0.1:7"}}).health_check_address, "127.0.0.1:7");
  EXPECT_EQ(parse({"--health-check", "there:1"}).health_check_address, "there:1");
  EXPECT_THAT(fault({"--health-check", "there"}), HasSubstr("--health-check takes an address"));
}

TEST(Options, HealthIsAskedWhereItIsServed) {
  EXPECT_EQ(parse({"--health-check", "--health-listen", "0.0.0.0:8"}).health_check_address, "localhost:8");
  EXPECT_THAT(fault({"--health-listen", "unix:/x"}), HasSubstr("--health-listen takes HOST:PORT"));
  EXPECT_THAT(fault({"--metrics-listen", "unix:/x"}), HasSubstr("--metrics-listen takes HOST:PORT"));
}

TEST(Options, IdentityIsWholeOrRefused) {
  EXPECT_THAT(fault({"--tls-cert", "c.pem"}), HasSubstr("--tls-cert and --tls-key go together"));
  EXPECT_THAT(fault({"--tls-client-ca", "c.pem"}), HasSubstr("--tls-client-ca needs TLS"));
  EXPECT_THAT(fault({"--token-file", "t", "--listen", "0.0.0.0:1"}), HasSubstr("would let tokens travel unencrypted"));
  EXPECT_EQ(fault({"--token-file", "t"}), "") << "this machine alone";
  EXPECT_EQ(fault({"--token-file", "t", "--listen", "0.0.0.0:1", "--allow-plaintext-tokens", "yes"}), "");
  EXPECT_EQ(fault({"--token-file", "t", "--listen", "0.0.0.0:1", "--tls-cert", "c", "--tls-key", "k"}), "");
  EXPECT_EQ(parse({"--max-concurrent-calls", "7"}).options.max_calls_per_client, 3u);
  const ParsedOptions hash = parse({"--hash-token", "farm", "write"});
  EXPECT_EQ(hash.command, Command::kHashToken);
  EXPECT_EQ(hash.token_name + " " + hash.token_role, "farm write");
}

TEST(Options, SecretsInAddressesDoNotShow) {
  const std::string refusal = fault({}, {{"CCSLICE_MESH_STORE", "redis://:hunter2@db/0"}});
  EXPECT_THAT(refusal, HasSubstr("CCSLICE_MESH_STORE takes dir:FOLDER"));
  EXPECT_EQ(refusal.find("hunter2"), std::string::npos);
}

TEST(Options, APrivateServerLeavesTheFleetAlone) {
  const ServerOptions options = parse({"--private"}, {{"CCSLICE_MESH_STORE", "dir:/srv"},
                                                      {"CCSLICE_TOKEN_FILE", "mine"},
                                                      {"CCSLICE_TLS_CERT", "c"},
                                                      {"CCSLICE_TLS_KEY", "k"},
                                                      {"CCSLICE_LISTEN", "0.0.0.0:1"},
                                                      {"CCSLICE_METRICS_LISTEN", "0.0.0.0:2"},
                                                      {"CCSLICE_WARM_MESHES", "5"}})
                                    .options;
  EXPECT_FALSE(options.mesh_store.place.has_value());
  EXPECT_EQ(options.token_file + options.tls.certificate + options.metrics_address, "");
  EXPECT_EQ(options.warm_meshes, 0u);
}

TEST(Options, HelpNamesEveryOptionBothWays) {
  const std::string help = help_text(kMachine);
  for (const char* text :
       {"--listen", "CCSLICE_LISTEN", "--threads", "CCSLICE_THREADS", "(default: 6)", "CCSLICE_CACHE_BYTES",
        "(default: 6GiB)", "--shutdown-grace", "CCSLICE_LOG_FORMAT", "--health-check", "Examples"}) {
    EXPECT_THAT(help, HasSubstr(text));
  }
}

TEST(OptionValues, SizesAndTimesHaveUnits) {
  EXPECT_EQ(parse_size("123", 0), 123u);
  EXPECT_EQ(parse_size("2K", 0), 2048u);
  EXPECT_EQ(parse_size("3GiB", 0), 3ull << 30);
  EXPECT_THROW(parse_size("-1", 0), std::invalid_argument);
  EXPECT_THROW(parse_size("1.5GiB", 0), std::invalid_argument);
  EXPECT_THROW(parse_size("99999999999GiB", 0), std::invalid_argument);
  EXPECT_THROW(parse_size("1", 2), std::invalid_argument);
  EXPECT_EQ(parse_duration("0").count(), 0);
  EXPECT_EQ(parse_duration("90s").count(), 90'000);
  EXPECT_THROW(parse_duration("90"), std::invalid_argument);
  EXPECT_EQ(show_duration(std::chrono::seconds(120)), "2m");
  EXPECT_EQ(show_size(3ull << 30), "3GiB");
}

TEST(Options, SlicersGetWhatTheOtherBudgetsLeave) {
  const ServerOptions large = parse({}, {}, {.cpus = 2, .memory_bytes = 16ull << 30}).options;
  EXPECT_EQ(large.scratch_budget_bytes + large.cache_bytes + large.preparation_budget_bytes +
                large.upload_budget_bytes + large.stream_budget_bytes + large.connection_budget_bytes + (256ull << 20),
            16ull << 30);
  EXPECT_EQ(parse({"--memory", "1GiB"}).options.scratch_budget_bytes, 256ull << 20);
  EXPECT_EQ(parse({"--memory", "512MiB"}).options.scratch_budget_bytes, 128ull << 20) << "a quarter";
  EXPECT_EQ(parse({"--cache-bytes", "64GiB"}).options.scratch_budget_bytes, 256ull << 20) << "nothing is left";
  EXPECT_GT(budgeted_memory(parse({"--cache-bytes", "64GiB"}).options), 64ull << 30);
  EXPECT_EQ(parse({"--scratch-budget-bytes", "3GiB"}).options.scratch_budget_bytes, 3ull << 30);
  EXPECT_EQ(parse({}, {{"CCSLICE_SCRATCH_BUDGET_BYTES", "1GiB"}}).options.scratch_budget_bytes, 1ull << 30);
  EXPECT_THAT(fault({"--scratch-budget-bytes", "1MiB"}), HasSubstr("at least 16MiB"));
}

TEST(ConnectionLimits, ShrinkInProportionWhereDescriptorsAreFewer) {
  ServerOptions options;
  options.max_connections = 10'000;
  options.max_connections_per_address = 7'500;
  EXPECT_EQ(connection_limits(options, 20'000).connections, 10'000u);
  EXPECT_EQ(connection_limits(options, 1'000).connections, 1'000u);
  EXPECT_EQ(connection_limits(options, 1'000).per_address, 750u);
  EXPECT_EQ(connection_limits(options, 1).per_address, 1u);
}

}  // namespace
}  // namespace ccslice::server
