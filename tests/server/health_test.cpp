// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <grpcpp/completion_queue.h>
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>

#include <thread>

#include "server/rpc/health_client.h"
#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"

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
  request.mutable_planes(0)->set_encoding(v1::PLANE_ENCODING_RAW);  // 25 MB: more than goes out unread.
  const auto reader = server.stub().SliceRange(&context, request);
  v1::SliceRangeResponse message;
  ASSERT_TRUE(reader->Read(&message));
  const auto other = server.new_stub();
  grpc::ClientContext warm_up;
  v1::GetServerInfoResponse info;
  ASSERT_TRUE(other->GetServerInfo(&warm_up, {}, &info).ok());

  std::thread drain([&] { server.server().drain(30s); });
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
  v1::SliceRangeRequest request = slice_request(id, 0.005, 0, 1000);
  std::thread client([&] { sliced = server.slice(request); });
  EXPECT_TRUE(eventually([&] { return server.server().state().calls.running() == 1; }, 5s));
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
  TestServer server;
  grpc::Status status;
  std::thread client([&] { status = server.upload(make_block(60, 10)); });
  EXPECT_TRUE(eventually([&] { return server.server().state().calls.running() == 1; }, 5s));
  std::this_thread::sleep_for(100ms);
  server.server().drain(0ms);
  client.join();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE) << status.error_message();
}

TEST(Drain, CancelsClientsThatDontRead) {
  TestServer server;
  const std::string id = server.upload_good(make_block(2, 10));
  grpc::ClientContext context;
  const auto reader = server.stub().SliceRange(&context, slice_request(id, 0.005, 0, 1000));
  v1::SliceRangeResponse message;
  ASSERT_TRUE(reader->Read(&message));
  const auto start = std::chrono::steady_clock::now();
  server.server().drain(100ms);
  EXPECT_LT(std::chrono::steady_clock::now() - start, 1s);
  while (reader->Read(&message)) {
  }
  EXPECT_FALSE(reader->Finish().ok());
}

/// A conversation by hand: the stubs of grpc.reflection.v1alpha aren't packaged. Sends one message, returns the
/// answer's bytes.
std::string converse(const std::shared_ptr<grpc::Channel>& channel, const std::string& method,
                     const std::string& bytes) {
  grpc::GenericStub stub(channel);
  grpc::ClientContext context;
  grpc::CompletionQueue queue;
  const auto call = stub.PrepareCall(&context, method, &queue);
  void* tag = nullptr;
  bool ok = false;
  const auto await = [&] { return queue.Next(&tag, &ok) && ok; };
  call->StartCall(&ok);
  if (!await()) return "";
  const grpc::Slice slice(bytes);
  call->Write(grpc::ByteBuffer(&slice, 1), grpc::WriteOptions().set_last_message(), nullptr);
  if (!await()) return "";
  grpc::ByteBuffer answer;
  call->Read(&answer, nullptr);
  if (!await()) return "";
  std::vector<grpc::Slice> slices;
  std::string text;
  if (answer.Dump(&slices).ok()) {
    for (const grpc::Slice& part : slices) text.append(reinterpret_cast<const char*>(part.begin()), part.size());
  }
  grpc::Status status;
  call->Finish(&status, nullptr);
  await();
  return text;
}

TEST(Reflection, ListsTheService) {
  TestServer server;
  const std::string list_services("\x3a\x00", 2);  // ServerReflectionRequest{list_services: ""}.
  const std::string answer =
      converse(server.channel(), "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", list_services);
  EXPECT_NE(answer.find("ccslice.v1.SlicerService"), std::string::npos);
}

}  // namespace
}  // namespace ccslice::server
