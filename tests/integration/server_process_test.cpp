// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <gmock/gmock.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdlib>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "client/client.h"
#include "tests/integration/running_server.h"
#include "tests/server/test_meshes.h"
#include "tests/support/datagrams.h"
#include "tests/support/job_parts.h"

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::Not;
using SteadyClock = std::chrono::steady_clock;

/// Occupancy of a block of 10 mm, uncompressed.
v1::SliceRangeRequest slice_request(const std::string& mesh_id, double pitch_mm, std::uint32_t layers) {
  v1::SliceRangeRequest request;
  part_of(*request.mutable_job()).set_mesh_id(mesh_id);
  request.mutable_job()->mutable_grid()->mutable_pitch()->set_x_mm(pitch_mm);
  request.mutable_job()->mutable_grid()->mutable_pitch()->set_y_mm(pitch_mm);
  request.mutable_job()->mutable_grid()->mutable_pitch()->set_z_mm(pitch_mm);
  request.set_layer_count(layers);
  request.mutable_job()->add_planes()->mutable_occupancy();
  request.mutable_job()->mutable_planes(0)->set_encoding(v1::PLANE_ENCODING_RAW);
  return request;
}

/// A variable of the environment for programs that are started meanwhile.
class Variable {
 public:
  Variable(std::string name, const std::string& value) : name_(std::move(name)) {
    setenv(name_.c_str(), value.c_str(), 1);
  }
  ~Variable() { unsetenv(name_.c_str()); }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  std::string name_;
};

/// A stream that has begun.
class RunningSlice {
 public:
  RunningSlice(RunningServer& server, const v1::SliceRangeRequest& request)
      : reader_(server.stub().SliceRange(&context_, request)) {
    EXPECT_TRUE(reader_->Read(&message_)) << "the header";
  }
  /// Reads to the end; the number of whole layers.
  std::uint32_t read_all() {
    std::uint32_t layers = 0;
    while (reader_->Read(&message_)) layers += message_.has_layer_end() ? 1 : 0;
    status_ = reader_->Finish();
    return layers;
  }
  const grpc::Status& status() const { return status_; }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReader<v1::SliceRangeResponse>> reader_;
  v1::SliceRangeResponse message_;
  grpc::Status status_;
};

TEST(ServerProcess, DrainsOnSigterm) {
  RunningServer server;
  // 25 MB: more than goes out unread.
  RunningSlice slice(server, slice_request(server.upload(make_block(2, 10)), 0.01, 200));
  server.send_signal(SIGTERM);
  EXPECT_TRUE(server.logs("stopping", 5s));
  EXPECT_EQ(slice.read_all(), 200u) << "the running call comes to its end";
  EXPECT_TRUE(slice.status().ok()) << slice.status().error_message();
  const client::ProcessResult result = server.wait();
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.err, HasSubstr("stopped"));
}

TEST(ServerProcess, OutlivesItsTerminal) {
  RunningServer server;
  for (const int signal : {SIGHUP, SIGPIPE}) server.send_signal(signal);
  EXPECT_FALSE(server.upload(make_block(1, 10)).empty());
  server.send_signal(SIGTERM);
  EXPECT_EQ(server.wait().exit_code, 0);
}

TEST(ServerProcess, CancelsWhatOutlastsTheGrace) {
  RunningServer server({"--shutdown-grace", "300ms"});
  RunningSlice slice(server, slice_request(server.upload(make_block(2, 10)), 0.005, 1000));
  const auto start = SteadyClock::now();
  server.send_signal(SIGINT);
  EXPECT_EQ(server.wait().exit_code, 0);
  EXPECT_LT(SteadyClock::now() - start, 3s);
  EXPECT_LT(slice.read_all(), 1000u);
  EXPECT_FALSE(slice.status().ok());
}

TEST(ServerProcess, ASecondSignalHurriesIt) {
  RunningServer server({"--shutdown-grace", "1h"});
  RunningSlice slice(server, slice_request(server.upload(make_block(2, 10)), 0.005, 1000));
  const auto start = SteadyClock::now();
  server.send_signal(SIGTERM);
  EXPECT_TRUE(server.logs("stopping", 5s));
  server.send_signal(SIGTERM);
  EXPECT_EQ(server.wait().exit_code, 0);
  EXPECT_LT(SteadyClock::now() - start, 3s);
}

TEST(ServerProcess, NoticesAClientThatWasKilled) {
  RunningServer server;
  const client::TemporaryFolder folder;
  const std::string mesh = (folder.path() / "ring.ccmesh").string();
  const auto run = [&](const std::vector<std::string>& command) {
    return client::Process(command, folder.path()).wait();
  };
  const client::ProcessResult made = run({CCSLICE_BINARY, "models", "ring", "-o", mesh});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  {
    client::Process client({CCSLICE_BINARY, "slice", mesh, "--server", server.address(), "--pitch", "0.01", "-o",
                            (folder.path() / "layers").string()},
                           folder.path());
    ASSERT_TRUE(server.logs("UploadMesh from", 20s)) << client::read_whole(folder.path() / "stderr");
    std::this_thread::sleep_for(300ms);
  }  // Killed.
  EXPECT_TRUE(server.logs("SliceRange from", 5s)) << "the call ended: " << server.log();
  EXPECT_THAT(server.log(), HasSubstr("CANCELLED"));
  EXPECT_FALSE(server.upload(make_block(1, 10)).empty()) << "it still serves";
}

/// A slicing job in this process whose servers are killed one after the other.
class KilledServers {
 public:
  /// How long each one is away.
  explicit KilledServers(std::vector<std::chrono::milliseconds> absences) : absences_(std::move(absences)) {}
  ~KilledServers() {
    if (restart_.joinable()) restart_.join();
  }

  /// Digests of the layers, and for each absence the time from the server's return to the next layer.
  std::vector<std::string> slice(const std::shared_ptr<const client::MeshBytes>& mesh, v1::SliceRangeRequest request) {
    server_ = std::make_unique<RunningServer>();
    address_ = server_->address();
    client::Client client({.address = address_});
    client.ensure_uploaded(mesh);
    part_of(*request.mutable_job()).set_mesh_id(mesh->id());
    std::vector<std::string> digests;
    client.slice(request, [&](const v1::SliceHeader&, const client::Layer& layer) {
      digests.push_back(client::sha256_of(layer.planes[0].encoded));
      see_layer();
    });
    return digests;
  }
  const std::vector<std::chrono::milliseconds>& waits() const { return waits_; }

 private:
  void see_layer() {
    if (away_ && back_) {  // Layers that come while it is away were under way before.
      waits_.push_back(std::chrono::duration_cast<std::chrono::milliseconds>(SteadyClock::now() - back_since_));
      restart_.join();
      away_ = back_ = false;
    }
    if (away_ || waits_.size() == absences_.size()) return;
    server_->send_signal(SIGKILL);
    server_->wait();
    away_ = true;
    restart_ = std::thread([this, absence = absences_[waits_.size()]] {
      std::this_thread::sleep_for(absence);
      server_ = std::make_unique<RunningServer>(std::vector<std::string>{"--listen", address_});
      back_since_ = SteadyClock::now();
      back_ = true;
    });
  }

  const std::vector<std::chrono::milliseconds> absences_;
  std::unique_ptr<RunningServer> server_;
  std::string address_;
  bool away_ = false;
  std::atomic<bool> back_{false};
  SteadyClock::time_point back_since_;
  std::vector<std::chrono::milliseconds> waits_;
  std::thread restart_;
};

TEST(ServerProcess, ItsClientsGoOnAsSoonAsItIsBack) {
  const auto mesh = std::make_shared<const client::MeshBytes>(make_box(2, 10));
  const v1::SliceRangeRequest request = slice_request("", 0.01, 600);
  const std::vector<std::string> undisturbed = KilledServers({}).slice(mesh, request);
  KilledServers servers({200ms, 700ms, 1500ms});
  EXPECT_EQ(servers.slice(mesh, request), undisturbed);
  ASSERT_EQ(servers.waits().size(), 3u);
  std::vector<std::chrono::milliseconds> waits = servers.waits();
  std::ranges::sort(waits);
  RecordProperty("median_wait_ms", static_cast<int>(waits[1].count()));
  EXPECT_LT(waits[1], 2s) << "half a second on a machine that does nothing else";
}

TEST(ServerProcess, TellsOfCutCallsOnlyWhereThereAreSome) {
  RunningServer server({"--shutdown-grace", "0"});
  server.send_signal(SIGTERM);
  const client::ProcessResult result = server.wait();
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.err, HasSubstr("stopped"));
  EXPECT_THAT(result.err, testing::Not(HasSubstr("still open")));
}

TEST(ServerProcess, AnswersItsOwnHealthCheck) {
  std::string address;
  {
    RunningServer server;
    address = server.address();
    const client::ProcessResult healthy = run_ccsliced({"--health-check", address});
    EXPECT_EQ(healthy.exit_code, 0) << healthy.out;
    EXPECT_THAT(healthy.out, HasSubstr("serving"));
  }
  EXPECT_EQ(run_ccsliced({"--health-check", address}).exit_code, 1);
}

TEST(ServerProcess, SaysInASentenceThatItsPortIsTaken) {
  RunningServer server;
  const client::ProcessResult second = run_ccsliced({"--listen", server.address()});
  EXPECT_EQ(second.exit_code, 1);
  EXPECT_EQ(second.err, "ccsliced: can't listen on " + server.address() +
                            ": Address already in use; choose another address with --listen\n");
}

TEST(ServerProcess, TeachesItsOptions) {
  const client::ProcessResult help = run_ccsliced({"--help"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_THAT(help.out, HasSubstr("CCSLICE_CACHE_BYTES"));
}

TEST(ServerProcess, HasTheVersionOfTheCommandLine) {
  const client::ProcessResult version = run_ccsliced({"--version"});
  EXPECT_EQ(version.exit_code, 0);
  EXPECT_THAT(version.out, MatchesRegex("ccsliced [0-9]+\\.[0-9]+\\.[0-9]+(\\+[0-9]+\\.g[0-9a-f]+)? \\(engine .*"));
  const client::TemporaryFolder folder;
  const std::string own = client::Process({CCSLICE_BINARY, "--version"}, folder.path()).wait().out;
  EXPECT_THAT(version.out, HasSubstr("ccsliced " + own.substr(0, own.find('\n')) + " (engine"));
}

TEST(ServerProcess, RefusesWrongOptionsAndAddressesWithAMessage) {
  const client::ProcessResult wrong = run_ccsliced({"--threads", "many"});
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("--threads takes a whole number"));
  RunningServer server;
  const client::ProcessResult taken = run_ccsliced({"--listen", server.address()});
  EXPECT_EQ(taken.exit_code, 1);
  EXPECT_THAT(taken.err, HasSubstr("can't listen on " + server.address()));
  const client::ProcessResult escaped = run_ccsliced({"--token-file", "tokens\033[31m"});
  EXPECT_EQ(escaped.exit_code, 1);
  EXPECT_THAT(escaped.err, AllOf(HasSubstr("tokens?[31m"), Not(HasSubstr("\033"))));
}

TEST(ServerProcess, RefusesVariablesThatNoProgramReads) {
  const Variable misspelled("CCSLICE_MEMROY", "1GiB");
  for (const std::vector<std::string>& options :
       {std::vector<std::string>{"--listen", "127.0.0.1:0"}, std::vector<std::string>{"--private"}}) {
    const client::ProcessResult result = run_ccsliced(options);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("CCSLICE_MEMROY; did you mean CCSLICE_MEMORY?"));
  }
  EXPECT_EQ(run_ccsliced({"--help"}).exit_code, 0) << "it teaches the right ones";
}

TEST(ServerProcess, TakesVariablesOfOtherPrograms) {
  const Variable client("CCSLICE_SERVER", "elsewhere:1"), farm("CCSLICE_FARM_FOLDER", "/jobs");
  RunningServer server;
  EXPECT_FALSE(server.upload(make_block(1, 10)).empty());
}

TEST(ServerProcess, TellsItsServiceManagerWhenItServesReloadsAndStops) {
  const Datagrams manager;
  const Variable socket("NOTIFY_SOCKET", manager.name());
  RunningServer server({"--drain-delay", "100ms", "--shutdown-grace", "25s"});
  EXPECT_EQ(manager.next(5s), "READY=1\nSTATUS=serves on " + server.address());
  server.send_signal(SIGHUP);
  EXPECT_THAT(manager.next(5s), MatchesRegex("RELOADING=1\nMONOTONIC_USEC=[0-9]+"));
  EXPECT_EQ(manager.next(5s), "READY=1\nSTATUS=serves on " + server.address());
  server.send_signal(SIGTERM);
  EXPECT_THAT(manager.next(5s), AllOf(HasSubstr("STOPPING=1\n"), HasSubstr("\nEXTEND_TIMEOUT_USEC=35100000")));
  EXPECT_EQ(server.wait().exit_code, 0);
  EXPECT_EQ(manager.next(0s), "") << "no more";
}

TEST(ServerProcess, ServesWithoutItsServiceManagerAndNeverPrivatelyForOne) {
  const Variable socket("NOTIFY_SOCKET", "/nowhere/notify");
  RunningServer server;
  EXPECT_TRUE(server.logs("can't tell the service manager at NOTIFY_SOCKET=/nowhere/notify: No such file", 5s));
  const Datagrams manager;
  const Variable other("NOTIFY_SOCKET", manager.name());
  const client::TemporaryFolder folder;
  EXPECT_EQ(client::Process({CCSLICE_BINARY, "info", "--local"}, folder.path()).wait().exit_code, 0);
  EXPECT_EQ(manager.next(0s), "") << "the command's own server says nothing";
}

TEST(ServerProcess, LogsJsonLines) {
  RunningServer server({"--log-format", "json"});
  v1::GetMeshRequest request;
  request.set_mesh_id("not \"an\" id\n");
  grpc::ClientContext context;
  v1::GetMeshResponse response;
  EXPECT_FALSE(server.stub().GetMesh(&context, request, &response).ok());
  server.send_signal(SIGTERM);
  std::istringstream lines(server.wait().err);
  int count = 0, calls = 0;
  for (std::string line; std::getline(lines, line); ++count) {
    google::protobuf::Struct object;
    ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(line, &object).ok()) << line;
    for (const char* field : {"time", "level", "message"}) EXPECT_TRUE(object.fields().contains(field)) << line;
    if (!object.fields().contains("method")) continue;
    ++calls;
    EXPECT_EQ(object.fields().at("method").string_value(), "GetMesh");
    EXPECT_EQ(object.fields().at("reason").string_value(), "MESH_ID_INVALID");
    EXPECT_EQ(object.fields().at("client").string_value(), "ipv4:127.0.0.1");
    EXPECT_EQ(object.fields().at("request_id").string_value().size(), 32u);
  }
  EXPECT_GE(count, 4);
  EXPECT_EQ(calls, 1);
}

TEST(ServerProcess, LetsNobodyForgeALineOfItsLog) {
  RunningServer server;
  v1::PlanSlicesRequest request;
  part_of(*request.mutable_job()).set_mesh_id(server.upload(make_block(1, 10)));
  request.mutable_job()->mutable_grid()->mutable_pitch()->set_x_mm(1);
  request.mutable_job()->mutable_grid()->mutable_pitch()->set_y_mm(1);
  request.mutable_job()->mutable_grid()->mutable_pitch()->set_z_mm(1);
  request.mutable_job()->add_planes()->mutable_channel()->set_name("x\n2026-11-21 00:00:00.000 info: forged\x1b[2J" +
                                                                   std::string(5000, 'y'));
  grpc::ClientContext context;
  v1::PlanSlicesResponse response;
  EXPECT_FALSE(server.stub().PlanSlices(&context, request, &response).ok());
  server.send_signal(SIGTERM);
  const std::string log = server.wait().err;
  EXPECT_THAT(log, HasSubstr("\"x?2026-11-21 00:00:00.000 info: forged?[2Jyyy"));
  std::istringstream lines(log);
  for (std::string line; std::getline(lines, line);) {
    EXPECT_LT(line.size(), 3000u);
    EXPECT_FALSE(line.starts_with("2026-11-21 00:00:00.000 info: forged")) << line;
    EXPECT_EQ(line.find('\x1b'), std::string::npos);
  }
}

}  // namespace
}  // namespace ccslice::server
