// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <grpcpp/completion_queue.h>
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>

#include <memory>
#include <thread>
#include <utility>

#include "server/rpc/server/health_client.h"
#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"
#include "tests/support/job_parts.h"

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

TEST(Health, IsServingWhileTheServerRuns) {
  TestServer server;
  const std::string address = server.server().address();
  std::string explanation;
  EXPECT_TRUE(check_health(address, explanation)) << explanation;
  EXPECT_EQ(explanation, address + ": serving");
  server.stop();
  EXPECT_FALSE(check_health(address, explanation));
  EXPECT_FALSE(explanation.empty());
}

TEST(Drain, ServesWhatRunsRefusesWhatComesAndSaysSoToHealthChecks) {
  TestServer server;
  const std::string id = server.upload_good(make_block(2, 10));
  grpc::ClientContext context;
  v1::SliceRangeRequest request = slice_request(id, 0.01, 0, 200);
  request.mutable_job()->mutable_planes(0)->set_encoding(v1::PLANE_ENCODING_RAW);  // 25 MB: more than goes out unread.
  const auto reader = server.stub().SliceRange(&context, request);
  v1::SliceRangeResponse message;
  ASSERT_TRUE(reader->Read(&message));
  const auto other = server.new_stub();
  grpc::ClientContext warm_up;
  v1::GetServerInfoResponse info;
  ASSERT_TRUE(other->GetServerInfo(&warm_up, {}, &info).ok());

  std::thread drain([&] { (void)server.server().drain(30s); });
  std::string explanation;
  EXPECT_TRUE(eventually([&] { return !check_health(server.server().address(), explanation); }, 2s));
  EXPECT_EQ(explanation, server.server().address() + ": not serving");
  grpc::ClientContext late;
  const auto refused = other->SliceRange(&late, slice_request(id, 0.05, 0, 1));
  EXPECT_FALSE(refused->Read(&message));
  const Failure failure = failure_of(refused->Finish());
  EXPECT_EQ(failure.code, grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(failure.reason, "SERVER_DRAINING");

  bool summary = false;
  while (reader->Read(&message)) summary = message.has_summary();
  EXPECT_TRUE(summary) << "the running call came to its end";
  EXPECT_TRUE(reader->Finish().ok());
  drain.join();
}

TEST(Drain, CutsOffWhatOutlastsTheGraceAndSaysWhy) {
  TestServer server;
  const std::string id = server.upload_good(make_block(2, 10));
  Sliced sliced;
  v1::SliceRangeRequest request = slice_request(id, 0.005, 0, 100'000);  // Longer than the grace, however fast.
  request.mutable_job()->mutable_grid()->mutable_pitch()->set_z_mm(1e-4);
  std::thread client([&] { sliced = server.slice(request); });
  EXPECT_TRUE(eventually([&] { return server.server().state().admission.running() == 1; }, 5s));
  std::this_thread::sleep_for(100ms);
  const auto start = std::chrono::steady_clock::now();
  EXPECT_TRUE(server.server().drain(100ms));
  EXPECT_LT(std::chrono::steady_clock::now() - start, 1s);
  client.join();
  const Failure failure = failure_of(sliced.status);
  EXPECT_EQ(failure.code, grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(failure.reason, "SERVER_SHUTTING_DOWN") << failure.message;
}

TEST(Drain, CutsOffAPreparationAndSaysWhy) {
  ServerOptions options = test_options();
  options.preparation_budget_bytes = 1 << 30;
  TestServer server(options);
  grpc::Status status;
  std::thread client([&] { status = server.upload(make_block(60, 10)); });
  EXPECT_TRUE(eventually([&] { return server.server().state().admission.running() == 1; }, 5s));
  std::this_thread::sleep_for(100ms);
  (void)server.server().drain(0ms);
  client.join();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE) << status.error_message();
}

TEST(Drain, CutsOffCallsThatWaitForTheirClientAndSaysWhy) {
  TestServer server;
  const std::string id = server.upload_good(make_block(2, 10));
  grpc::ClientContext probing;
  const auto probe = server.stub().ProbePoints(&probing);
  v1::ProbePointsRequest points;
  points.set_mesh_id(id);
  for (const double x : {1.0, 1.0, 1.0}) points.add_points_mm(x);
  v1::ProbePointsResponse found;
  ASSERT_TRUE(probe->Write(points) && probe->Read(&found));
  grpc::ClientContext uploading;
  v1::UploadMeshResponse uploaded;
  const auto upload = server.stub().UploadMesh(&uploading, &uploaded);
  v1::UploadMeshRequest start;
  start.mutable_start()->set_mesh_id("sha256:" + std::string(64, 'a'));
  start.mutable_start()->set_size_bytes(1000);
  ASSERT_TRUE(upload->Write(start));
  EXPECT_TRUE(eventually([&] { return server.server().state().calls.open() == 2; }, 5s));
  std::this_thread::sleep_for(50ms);
  (void)server.server().drain(0ms);
  EXPECT_EQ(failure_of(probe->Finish()).reason, "SERVER_SHUTTING_DOWN");
  EXPECT_EQ(failure_of(upload->Finish()).reason, "SERVER_SHUTTING_DOWN");
}

TEST(Drain, CancelsClientsThatDontRead) {
  TestServer server;
  const std::string id = server.upload_good(make_block(2, 10));
  grpc::ClientContext context;
  v1::SliceRangeRequest request = slice_request(id, 0.005, 0, 100'000);  // Longer than the grace, however fast.
  request.mutable_job()->mutable_grid()->mutable_pitch()->set_z_mm(1e-4);
  const auto reader = server.stub().SliceRange(&context, request);
  v1::SliceRangeResponse message;
  ASSERT_TRUE(reader->Read(&message));
  const auto start = std::chrono::steady_clock::now();
  (void)server.server().drain(100ms);
  EXPECT_LT(std::chrono::steady_clock::now() - start, 1s);
  while (reader->Read(&message)) {
  }
  EXPECT_FALSE(reader->Finish().ok());
}

TEST(Drain, RefusesPlansToo) {
  TestServer server;
  const std::string id = server.upload_good(make_block(1, 10));
  server.server().state().calls.drain();
  v1::PlanSlicesRequest request;
  part_of(*request.mutable_job()).set_mesh_id(id);
  grpc::ClientContext context;
  v1::PlanSlicesResponse response;
  EXPECT_EQ(failure_of(server.stub().PlanSlices(&context, request, &response)).reason, "SERVER_DRAINING");
}

std::string bytes_of(const grpc::ByteBuffer& buffer) {
  std::string bytes;
  std::vector<grpc::Slice> slices;
  if (!buffer.Dump(&slices).ok()) return bytes;
  for (const grpc::Slice& part : slices) bytes.append(reinterpret_cast<const char*>(part.begin()), part.size());
  return bytes;
}

/// A conversation by hand, where no stubs are packaged: sends one message, reads the answers' bytes.
class Conversation {
 public:
  Conversation(const std::shared_ptr<grpc::Channel>& channel, const std::string& method, const std::string& bytes)
      : stub_(channel), call_(stub_.PrepareCall(&context_, method, &queue_)) {
    call_->StartCall(this);
    if (!await()) return;
    const grpc::Slice slice(bytes);
    call_->Write(grpc::ByteBuffer(&slice, 1), grpc::WriteOptions().set_last_message(), this);
    await();
  }
  ~Conversation() {
    context_.TryCancel();
    finish();
    queue_.Shutdown();
    void* tag = nullptr;
    for (bool ok = false; queue_.Next(&tag, &ok);) {
    }
  }

  /// The next answer; empty if there is none.
  std::string read() {
    grpc::ByteBuffer answer;
    call_->Read(&answer, this);
    return await() ? bytes_of(answer) : "";
  }
  void finish() {
    if (std::exchange(finished_, true)) return;
    call_->Finish(&status_, this);
    await();
  }

 private:
  bool await() {
    void* tag = nullptr;
    bool ok = false;
    return queue_.Next(&tag, &ok) && ok;
  }

  grpc::ClientContext context_;
  grpc::CompletionQueue queue_;
  grpc::GenericStub stub_;
  std::unique_ptr<grpc::GenericClientAsyncReaderWriter> call_;
  grpc::Status status_;
  bool finished_ = false;
};

TEST(Drain, TellsWhoeverWatchesTheHealthAndDoesntWaitForHim) {
  TestServer server;
  Conversation watch(server.channel(), "/grpc.health.v1.Health/Watch", "");
  EXPECT_EQ(watch.read(), std::string("\x08\x01")) << "SERVING";
  const auto start = std::chrono::steady_clock::now();
  std::thread drain([&] { EXPECT_TRUE(server.server().drain(30s)); });
  EXPECT_EQ(watch.read(), std::string("\x08\x02")) << "NOT_SERVING";
  EXPECT_EQ(watch.read(), "") << "the stream has ended";
  drain.join();
  EXPECT_LT(std::chrono::steady_clock::now() - start, 2s);
}

TEST(Reflection, ListsTheService) {
  TestServer server;
  const std::string list_services("\x3a\x00", 2);  // ServerReflectionRequest{list_services: ""}.
  Conversation reflection(server.channel(), "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
                          list_services);
  const std::string answer = reflection.read();
  EXPECT_NE(answer.find("ccslice.v1.SlicerService"), std::string::npos);
}

TEST(Reflection, DescribesTheService) {
  TestServer server;
  const std::string name = "ccslice.v1.SlicerService";
  // ServerReflectionRequest{file_containing_symbol: name}.
  const std::string describe = std::string("\x22") + static_cast<char>(name.size()) + name;
  Conversation reflection(server.channel(), "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", describe);
  EXPECT_NE(reflection.read().find("ccslice.v1.TessellateBoundaryRequest"), std::string::npos);
}

}  // namespace
}  // namespace ccslice::server
