// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The command line without a server: it starts one of its own. Nobody listens at the default address in these tests,
// or it isn't asked.

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "client/cli/base/exit_codes.h"
#include "client/cli/session/private_server.h"
#include "client/client.h"
#include "client/client_error.h"
#include "tests/client/process.h"

namespace ccslice::client {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::Not;

/// The sockets' folders of all private servers that live in this folder for temporary files.
std::set<std::string> private_folders(const fs::path& temporary) {
  std::set<std::string> folders;
  for (const fs::directory_entry& entry : fs::directory_iterator(temporary)) {
    const std::string name = entry.path().filename();
    if (name.starts_with("ccsliced-")) folders.insert(name);
  }
  return folders;
}

/// Whether it comes true in time.
template <typename Condition>
bool comes_true(Condition condition) {
  for (int i = 0; i < 1000 && !condition(); ++i) std::this_thread::sleep_for(10ms);
  return condition();
}

class PrivateServerTest : public testing::Test {
 protected:
  PrivateServerTest() { fs::create_directory(temporary_); }

  /// ccslice with an environment in which servers keep their sockets in temporary_.
  std::vector<std::string> command(const std::vector<std::string>& arguments,
                                   const std::vector<std::string>& variables = {}) const {
    std::vector<std::string> words = {"/usr/bin/env", "-u", "CCSLICE_SERVER", "TMPDIR=" + temporary_.string()};
    words.insert(words.end(), variables.begin(), variables.end());
    words.push_back(CCSLICE_BINARY);
    words.insert(words.end(), arguments.begin(), arguments.end());
    return words;
  }
  ProcessResult run(const std::vector<std::string>& arguments, const std::vector<std::string>& variables = {}) const {
    return Process(command(arguments, variables), folder_.path()).wait();
  }
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  /// A program that isn't the server it is taken for.
  std::string script(const std::string& name, const std::string& text) const {
    std::ofstream(path(name)) << "#!/bin/sh\n" << text << "\n";
    fs::permissions(path(name), fs::perms::owner_all);
    return path(name);
  }
  std::string ring() const {
    const std::string file = path("ring.ccmesh");
    EXPECT_EQ(run({"models", "ring", "-o", file}).exit_code, cli::kExitOk);
    return file;
  }

  TemporaryFolder folder_;
  const fs::path temporary_ = folder_.path() / "tmp";
};

TEST_F(PrivateServerTest, ServesOneCommandAndEndsWithIt) {
  const ProcessResult result = run({"slice", ring(), "--pitch", "2", "--local", "-o", path("out")});
  EXPECT_EQ(result.exit_code, cli::kExitOk) << result.err;
  EXPECT_THAT(result.err, HasSubstr("for this command alone"));
  EXPECT_TRUE(fs::exists(path("out") + "/manifest.json"));
  EXPECT_THAT(private_folders(temporary_), testing::IsEmpty());
}

TEST_F(PrivateServerTest, IsStartedWhereNobodyIsNamedAndNobodyAnswers) {
  bool nobody = false;
  try {
    Client({.address = "localhost:50051", .retry = {.max_attempts = 1}}).server_info();
  } catch (const ClientError&) {
    nobody = true;
  }
  if (!nobody) GTEST_SKIP() << "a server listens at localhost:50051";
  const ProcessResult result = run({"info"});
  EXPECT_EQ(result.exit_code, cli::kExitOk) << result.err;
  EXPECT_THAT(result.err, HasSubstr("for this command alone"));
  const ProcessResult refused = run({"info", "--no-local"});
  EXPECT_EQ(refused.exit_code, cli::kExitUnreachable);
  EXPECT_THAT(refused.err, HasSubstr("start ccsliced there"));
}

TEST_F(PrivateServerTest, SaysThatWhatItHoldsEndsWithIt) {
  const std::string mesh = ring();
  const ProcessResult result = run({"upload", mesh, "--local"});
  EXPECT_EQ(result.exit_code, cli::kExitOk) << result.err;
  EXPECT_THAT(result.err, HasSubstr("so does what it holds"));
  EXPECT_EQ(run({"upload", mesh, "--local", "--quiet"}).err, "");
}

TEST_F(PrivateServerTest, TwoAtOnceDontMeet) {
  const std::string mesh = ring();
  fs::create_directory(path("one")), fs::create_directory(path("other"));
  Process one(command({"slice", mesh, "--pitch", "1", "--local", "-o", path("a")}), path("one"));
  Process other(command({"slice", mesh, "--pitch", "1", "--local", "-o", path("b")}), path("other"));
  EXPECT_EQ(one.wait().exit_code, cli::kExitOk);
  EXPECT_EQ(other.wait().exit_code, cli::kExitOk);
  EXPECT_THAT(private_folders(temporary_), testing::IsEmpty());
}

TEST_F(PrivateServerTest, EndsAfterItsClientIsKilled) {
  // A job that takes minutes: it is in the middle when it is killed.
  Process process(command({"slice", ring(), "--pitch", "0.01", "--local", "-o", path("out")}), folder_.path());
  ASSERT_TRUE(comes_true([&] { return fs::exists(path("out")); }));
  EXPECT_EQ(private_folders(temporary_).size(), 1u);
  process.send_signal(SIGKILL);
  process.wait();
  EXPECT_TRUE(comes_true([&] { return private_folders(temporary_).empty(); }));
}

TEST_F(PrivateServerTest, IsInterruptedWithItsClient) {
  Process process(command({"slice", ring(), "--pitch", "0.01", "--local", "-o", path("out")}), folder_.path());
  ASSERT_TRUE(comes_true([&] { return fs::exists(path("out")); }));
  process.send_signal(SIGINT);
  EXPECT_EQ(process.wait().exit_code, cli::kExitInterrupted);
  EXPECT_THAT(private_folders(temporary_), testing::IsEmpty());
}

TEST_F(PrivateServerTest, IsNotStartedWhereAServerIsNamed) {
  const std::vector<std::string> nobody = {"CCSLICE_SERVER=127.0.0.1:1"};
  EXPECT_EQ(run({"info"}, nobody).exit_code, cli::kExitUnreachable);
  EXPECT_EQ(run({"info", "--server", "127.0.0.1:1"}).exit_code, cli::kExitUnreachable);
  EXPECT_EQ(run({"info", "--server", "127.0.0.1:1", "--local"}).exit_code, cli::kExitUsage);
  EXPECT_EQ(run({"info", "--server", "127.0.0.1:1", "--no-local"}).exit_code, cli::kExitUnreachable);
  EXPECT_EQ(run({"info", "--local"}, nobody).exit_code, cli::kExitOk) << "the flag wins over the variable";
}

TEST_F(PrivateServerTest, ProgramsThatArentTheServerAreNamed) {
  const auto error_with = [&](const std::string& program) {
    const ProcessResult result = run({"info", "--local"}, {"CCSLICED=" + program});
    EXPECT_EQ(result.exit_code, cli::kExitUnreachable);
    EXPECT_THAT(result.err, HasSubstr(program));
    EXPECT_THAT(result.err, HasSubstr("--server"));
    return result.err;
  };
  EXPECT_THAT(error_with(path("none")), HasSubstr("can't be started"));
  EXPECT_THAT(error_with(script("older", "echo 'unknown option' >&2; exit 2")), HasSubstr("another version"));
  EXPECT_THAT(error_with(script("other", "echo hello; cat")), HasSubstr("another version"));
  EXPECT_EQ(run({"info", "--local"}, {"CCSLICED=" + script("liar", "echo unix:/nowhere; cat")}).exit_code,
            cli::kExitUnreachable);
}

TEST_F(PrivateServerTest, WithoutAProgramTheRemedyIsSaid) {
  const std::string alone = path("ccslice");
  fs::copy_file(CCSLICE_BINARY, alone);
  std::vector<std::string> words = command({"info", "--local"}, {"PATH=/nonexistent"});
  *std::find(words.begin(), words.end(), CCSLICE_BINARY) = alone;
  const ProcessResult result = Process(words, folder_.path()).wait();
  EXPECT_EQ(result.exit_code, cli::kExitUnreachable);
  EXPECT_THAT(result.err, HasSubstr("no ccsliced"));
}

TEST_F(PrivateServerTest, IsWaitedForWithinTheTimeout) {
  const auto begin = std::chrono::steady_clock::now();
  const ProcessResult result = run({"info", "--local", "--timeout", "0.5"}, {"CCSLICED=" + script("slow", "cat")});
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 10s) << "less than a server may take to start";
  EXPECT_EQ(result.exit_code, cli::kExitUnreachable);
  EXPECT_THAT(result.err, HasSubstr("in time"));
}

TEST_F(PrivateServerTest, WaitingForItCanBeCancelled) {
  const std::string slow = script("slow", "cat");
  Cancellation cancellation;
  std::thread soon([&] {
    std::this_thread::sleep_for(50ms);
    cancellation.cancel();
  });
  try {
    const cli::PrivateServer server(slow, {.cancellation = &cancellation});
    ADD_FAILURE() << server.address();
  } catch (const ClientError& error) {
    EXPECT_EQ(error.reason(), local_reason::kCancelledHere);
  }
  soon.join();
}

}  // namespace
}  // namespace ccslice::client
