// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// How the ccslice program gets to its servers: several of them, TLS and tokens.

#include "client/cli/session/session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "client/cli/base/exit_codes.h"
#include "tests/client/certificates.h"
#include "tests/client/command_line.h"
#include "tests/client/fake_slicer.h"

namespace ccslice::client {
namespace {

using testing::AllOf;
using testing::Each;
using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;

constexpr const char* kNobody = "127.0.0.1:1";

class SessionTest : public CommandLine {
 protected:
  /// With variables such as "CCSLICE_CA=ca.pem".
  ProcessResult run_with(const std::vector<std::string>& variables, const std::vector<std::string>& arguments) {
    std::vector<std::string> command = {"/usr/bin/env"};
    command.insert(command.end(), variables.begin(), variables.end());
    command.push_back(CCSLICE_BINARY);
    command.insert(command.end(), arguments.begin(), arguments.end());
    return Process(command, folder_.path()).wait();
  }
  std::string write_token(const std::string& content) const {
    const std::string token = path("token");
    std::ofstream(token, std::ios::binary) << content;
    fs::permissions(token, fs::perms::owner_read | fs::perms::owner_write);
    return token;
  }
};

TEST_F(SessionTest, ListsOfAddressesAreChecked) {
  for (const char* list : {"a:1,,b:1", ",a:1", "a:1,", "a:1,b:1,a:1", "a:1,b:99999", "a:1 ,b:1"}) {
    const ProcessResult result = run_alone({"info", std::string("--server=") + list});
    EXPECT_EQ(result.exit_code, cli::kExitUsage) << list;
    EXPECT_THAT(result.err, HasSubstr("--server takes an address HOST:PORT, or several")) << list;
  }
}

TEST_F(SessionTest, OneDeadOfTwoIsNoMatter) {
  const std::string both = std::string(kNobody) + "," + server_->address();
  const auto begin = std::chrono::steady_clock::now();
  const ProcessResult slice =
      run_alone({"slice", box_, "--server", both, "--pitch", "1", "--occupancy", "-o", path("a")});
  EXPECT_EQ(slice.exit_code, cli::kExitOk) << slice.err;
  EXPECT_EQ(run_with({"CCSLICE_SERVER=" + both}, {"info"}).exit_code, cli::kExitOk);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(10));
}

TEST_F(SessionTest, AllDeadAreNamed) {
  const ProcessResult result = run_alone({"info", "--server", "127.0.0.1:1,127.0.0.1:2"});
  EXPECT_EQ(result.exit_code, cli::kExitUnreachable);
  EXPECT_THAT(result.err, AllOf(HasSubstr("no ccslice server answers at 127.0.0.1:1,127.0.0.1:2"),
                                HasSubstr("127.0.0.1:1: failed to connect"),
                                HasSubstr("127.0.0.1:2: failed to connect"), HasSubstr("--server")));
}

// Nobody listens at the proxy.
TEST_F(SessionTest, ProxiesAreNotAskedForTheWayToThisMachine) {
  for (const char* variable : {"grpc_proxy", "https_proxy", "http_proxy"}) {
    const std::string proxy = std::string(variable) + "=http://" + kNobody;
    const std::string port = server_->address().substr(server_->address().rfind(':'));
    for (const std::string& address : {"127.0.0.1" + port, "localhost" + port, "ipv4:127.0.0.1" + port,
                                       std::string(kNobody) + ",127.0.0.1" + port}) {
      const ProcessResult result = run_with({proxy}, {"info", "--server", address});
      EXPECT_EQ(result.exit_code, cli::kExitOk) << variable << ' ' << address << ' ' << result.err;
    }
  }
}

TEST_F(SessionTest, AProxyOnTheWayIsNamed) {
  const std::string proxy = std::string("http_proxy=http://") + kNobody;
  const ProcessResult result = run_with({proxy}, {"info", "--server", "slicer.invalid:50051", "--patience", "0"});
  EXPECT_EQ(result.exit_code, cli::kExitUnreachable);
  EXPECT_THAT(result.err,
              AllOf(HasSubstr("through the proxy that the environment's http_proxy names"), HasSubstr("no_proxy")));
  const ProcessResult around =
      run_with({proxy, "no_proxy=.invalid"}, {"info", "--server", "slicer.invalid:50051", "--patience", "0"});
  EXPECT_EQ(around.exit_code, cli::kExitUnreachable);
  EXPECT_THAT(around.err, Not(HasSubstr("proxy")));
}

TEST_F(SessionTest, TheTokenOfTheFlagsOrTheVariablesFileGoesWithCalls) {
  FakeSlicer fake;
  const std::string token = write_token("s3cret\n");
  EXPECT_EQ(run_alone({"info", "--server", fake.address(), "--token-file", token}).exit_code, cli::kExitOk);
  EXPECT_EQ(run_with({"CCSLICE_TOKEN_FILE=" + token}, {"info", "--server", fake.address()}).exit_code, cli::kExitOk);
  EXPECT_EQ(fake.metadata().size(), 2u);
  EXPECT_THAT(fake.metadata(), Each(EndsWith("authorization=Bearer s3cret")));
}

TEST_F(SessionTest, FilesOfTokensThatAreNoGoodAreNamedWithoutTheirContent) {
  const std::vector<std::string> command = {"info", "--server", server_->address(), "--token-file"};
  const auto run_with_token = [&](const std::string& token) {
    std::vector<std::string> words = command;
    words.push_back(token);
    return run_alone(words);
  };
  for (const std::string& content :
       {std::string(), std::string("s3cret of two words"), std::string("s3cret\0\1", 8), std::string(5000, 's')}) {
    const ProcessResult result = run_with_token(write_token(content));
    EXPECT_EQ(result.exit_code, cli::kExitInput) << result.err;
    EXPECT_THAT(result.err, AllOf(HasSubstr(path("token")), Not(HasSubstr("s3cret")), Not(HasSubstr("sssss"))));
  }
  const ProcessResult missing = run_with_token(path("nowhere"));
  EXPECT_EQ(missing.exit_code, cli::kExitInput);
  EXPECT_THAT(missing.err, HasSubstr("nowhere can't be read: No such file"));
}

TEST_F(SessionTest, TokensThatEverybodyCanReadAreWarnedOf) {
  const std::string token = write_token("s3cret");
  const std::vector<std::string> command = {"info", "--server", server_->address(), "--token-file", token};
  EXPECT_THAT(run_alone(command).err, Not(HasSubstr("warning")));
  fs::permissions(token, fs::perms::others_read, fs::perm_options::add);
  const ProcessResult result = run_alone(command);
  EXPECT_EQ(result.exit_code, cli::kExitOk);
  EXPECT_THAT(result.err,
              AllOf(HasSubstr("can read the token in " + token), HasSubstr("chmod"), Not(HasSubstr("s3cret"))));
}

TEST_F(SessionTest, SpeaksTls) {
  Certificates certificates;
  certificates.make_authority("ca");
  certificates.make_authority("stranger");
  certificates.make_for("server", "DNS:localhost", "ca");
  certificates.make_for("other", "DNS:other.example", "ca");
  certificates.make_for("client", "DNS:client", "ca");
  FakeSlicer server(certificates.of_server("server", "ca")), other(certificates.of_server("other"));
  const auto named = [](const FakeSlicer& fake) {
    return "localhost" + fake.address().substr(fake.address().rfind(':'));
  };
  const std::string ca = certificates.path("ca.pem"), cert = certificates.path("client.pem"),
                    key = certificates.path("client.key");

  const ProcessResult flags = run_alone({"info", "--server", named(server), "--ca", ca, "--cert", cert, "--key", key});
  EXPECT_EQ(flags.exit_code, cli::kExitOk) << flags.err;
  const ProcessResult variables = run_with({"CCSLICE_CA=" + ca, "CCSLICE_CERT=" + cert, "CCSLICE_KEY=" + key},
                                           {"info", "--server", "https://" + named(server)});
  EXPECT_EQ(variables.exit_code, cli::kExitOk) << variables.err;

  const std::vector<std::vector<std::string>> wrong = {
      {"--server", named(server), "--ca", ca},
      {"--server", named(server), "--ca", certificates.path("stranger.pem"), "--cert", cert, "--key", key},
      {"--server", named(other), "--ca", ca},
      {"--server", "https://" + named(other)}};
  for (std::vector<std::string> words : wrong) {
    words.insert(words.begin(), "info");
    const ProcessResult result = run_alone(words);
    EXPECT_EQ(result.exit_code, cli::kExitUnreachable) << result.err;
    EXPECT_THAT(result.err, AllOf(HasSubstr("certificate"), HasSubstr("--ca"), Not(HasSubstr("ssl_transport"))))
        << words.back();
  }
  EXPECT_THAT(run_alone({"info", "--server", named(other)}).err, HasSubstr("if it serves TLS, give --ca"));
  const ProcessResult half = run_alone({"info", "--server", named(server), "--cert", cert});
  EXPECT_EQ(half.exit_code, cli::kExitInput);
  EXPECT_THAT(half.err, HasSubstr("is a certificate without a key"));
}

TEST_F(SessionTest, SplitsAJobOverServersWithTheSameBytes) {
  server::Server other(local_server_options());
  const std::vector<std::string> command = {"slice",       box_,
                                            "--pitch",     "0.05",
                                            "--occupancy", "--no-contact-sheet",
                                            "--server",    server_->address() + "," + other.address()};
  const auto slice = [&](const std::vector<std::string>& rest) {
    std::vector<std::string> words = command;
    words.insert(words.end(), rest.begin(), rest.end());
    return run_alone(words);
  };
  const ProcessResult one = slice({"-o", path("one")}), two = slice({"-o", path("two"), "--split", "2"});
  ASSERT_EQ(one.exit_code, cli::kExitOk) << one.err;
  ASSERT_EQ(two.exit_code, cli::kExitOk) << two.err;
  EXPECT_EQ(files_in("one"), files_in("two"));
  EXPECT_GT(files_in("one"), 32u) << "more than two of the least blocks";
  for (const fs::directory_entry& file : fs::directory_iterator(path("one"))) {
    EXPECT_EQ(read_whole(file.path()), read_whole(fs::path(path("two")) / file.path().filename())) << file.path();
  }
  for (const char* split : {"0", "65", "x"}) {
    EXPECT_EQ(slice({"-o", path("three"), "--split", split}).exit_code, cli::kExitUsage) << split;
  }
}

TEST_F(SessionTest, AServerOfItsOwnGetsNoTokenAndNoTls) {
  const ProcessResult result =
      run_with({"CCSLICE_TOKEN_FILE=" + path("nowhere"), "CCSLICE_CA=" + path("nowhere")}, {"info", "--local"});
  EXPECT_EQ(result.exit_code, cli::kExitOk) << result.err;
}

}  // namespace
}  // namespace ccslice::client
