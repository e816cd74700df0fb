// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <gmock/gmock.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include <csignal>
#include <sstream>

#include "tests/integration/running_server.h"
#include "tests/server/test_meshes.h"

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using SteadyClock = std::chrono::steady_clock;

/// Occupancy of a block of 10 mm, uncompressed.
v1::SliceRangeRequest slice_request(const std::string& mesh_id, double pitch_mm, std::uint32_t layers) {
  v1::SliceRangeRequest request;
  request.set_mesh_id(mesh_id);
  request.mutable_grid()->mutable_pitch()->set_x_mm(pitch_mm);
  request.mutable_grid()->mutable_pitch()->set_y_mm(pitch_mm);
  request.mutable_grid()->mutable_pitch()->set_z_mm(pitch_mm);
  request.set_layer_count(layers);
  request.add_planes()->mutable_occupancy();
  request.mutable_planes(0)->set_encoding(v1::PLANE_ENCODING_RAW);
  return request;
}

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

TEST(ServerProcess, TeachesItsOptions) {
  const client::ProcessResult help = run_ccsliced({"--help"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_THAT(help.out, HasSubstr("CCSLICE_CACHE_BYTES"));
  EXPECT_EQ(run_ccsliced({"--version"}).exit_code, 0);
}

TEST(ServerProcess, RefusesWrongOptionsAndAddressesWithAMessage) {
  const client::ProcessResult wrong = run_ccsliced({"--threads", "many"});
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("--threads takes a whole number"));
  RunningServer server;
  const client::ProcessResult taken = run_ccsliced({"--listen", server.address()});
  EXPECT_EQ(taken.exit_code, 1);
  EXPECT_THAT(taken.err, HasSubstr("can't listen on " + server.address()));
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
  int count = 0;
  for (std::string line; std::getline(lines, line); ++count) {
    google::protobuf::Struct object;
    ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(line, &object).ok()) << line;
    EXPECT_EQ(object.fields().size(), 3u);
    EXPECT_TRUE(object.fields().contains("time"));
  }
  EXPECT_GE(count, 4);
}

TEST(ServerProcess, LetsNobodyForgeALineOfItsLog) {
  RunningServer server;
  v1::PlanSlicesRequest request;
  request.set_mesh_id(server.upload(make_block(1, 10)));
  request.mutable_grid()->mutable_pitch()->set_x_mm(1);
  request.mutable_grid()->mutable_pitch()->set_y_mm(1);
  request.mutable_grid()->mutable_pitch()->set_z_mm(1);
  request.add_planes()->mutable_channel()->set_name("x\n2026-11-21 00:00:00.000 info: forged\x1b[2J" +
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
