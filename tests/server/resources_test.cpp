// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What clients can make the server hold: memory and places among the running calls, by requests that are hostile,
// stalled or silent.

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "core/contour/contour.h"
#include "server/service/meshes/mesh_id.h"
#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"
#include "tests/support/job_parts.h"

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

TEST(Resources, AStalledReaderOfContoursHoldsItsWindow) {
  if (kKeepsFreedMemory) GTEST_SKIP() << "freed memory stays";
  ServerOptions options = test_options();
  options.stream_window_bytes = 8 << 20;
  TestServer server(options);
  const std::string id = server.upload_good(make_block(3, 10));
  v1::SliceRangeRequest request = slice_request(id, 0.005, 0, 1800);
  request.mutable_job()->clear_planes();
  request.mutable_job()->mutable_contours();
  request.mutable_job()->mutable_tolerances()->set_contour_mm(
      server.server().state().slice_limits.min_contour_tolerance_mm);
  const Sliced one = [&] {
    v1::SliceRangeRequest single = request;
    single.set_first_layer(900);
    single.set_layer_count(1);
    return server.slice(single);
  }();
  ASSERT_TRUE(one.status.ok()) << one.status.error_message();
  const std::size_t layer_bytes = one.contour_points.at(900) * sizeof(ContourPoint);
  RecordProperty("layer_bytes", static_cast<int>(layer_bytes));
  const std::size_t before = resident_bytes();
  grpc::ClientContext context;
  const auto stub = server.new_stub();
  const auto reader = stub->SliceRange(&context, request);
  v1::SliceRangeResponse message;
  ASSERT_TRUE(reader->Read(&message));
  server.server().state().executor.wait_idle();
  const std::size_t held = resident_bytes() - std::min(before, resident_bytes());
  RecordProperty("held_bytes", static_cast<int>(held));
  EXPECT_LT(held, (8u << 20) + 6 * layer_bytes + (24u << 20)) << "of " << 1800 * layer_bytes;
  context.TryCancel();
  reader->Finish();
}

TEST(Resources, StreamsForWhichNothingIsLeftAreToldToComeBack) {
  ServerOptions options = test_options();
  options.stream_window_bytes = 4 << 20;
  options.stream_budget_bytes = 4 << 20;
  options.admission_wait = 50ms;
  TestServer server(options);
  const std::string id = server.upload_good(make_block(2, 10));
  v1::SliceRangeRequest request = slice_request(id, 0.01, 0, 900);  // Some 100 MB: far more than the transport holds.
  request.mutable_job()->mutable_planes(0)->set_encoding(v1::PLANE_ENCODING_RAW);
  // Unread, the first one keeps its layers.
  grpc::ClientContext first_context;
  const auto stub = server.new_stub();
  const auto first = stub->SliceRange(&first_context, request);
  v1::SliceRangeResponse message;
  ASSERT_TRUE(first->Read(&message));
  const std::uint64_t held = server.server().state().streams.used_bytes();
  EXPECT_GT(held, 0u);
  EXPECT_LE(held, 4u << 20);
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientReader<v1::SliceRangeResponse>>> readers;
  Failure failure;
  for (int i = 0; i < 64 && failure.reason.empty(); ++i) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    readers.push_back(stub->SliceRange(contexts.back().get(), request));
    if (!readers.back()->Read(&message)) {
      failure = failure_of(readers.back()->Finish());
      readers.pop_back();
    }
    EXPECT_LE(server.server().state().streams.used_bytes(), 4u << 20);
  }
  EXPECT_EQ(failure.reason, "SERVER_BUSY");
  EXPECT_EQ(failure.code, grpc::StatusCode::UNAVAILABLE);
  EXPECT_TRUE(failure.retry);
  first_context.TryCancel();
  for (const auto& context : contexts) context->TryCancel();
  first->Finish();
  for (const auto& reader : readers) reader->Finish();
  EXPECT_TRUE(eventually([&] { return server.server().state().streams.used_bytes() == 0; }, 2s));
  EXPECT_TRUE(server.slice(slice_request(id, 0.5, 0, 10)).status.ok());
}

TEST(Resources, AJobThatNeverFitsIsRefusedWithWhatItTakes) {
  ServerOptions options = test_options();
  options.scratch_budget_bytes = 16 << 20;
  TestServer server(options);
  const std::string id = server.upload_good(make_block(2, 10));
  v1::SliceRangeRequest request = slice_request(id, 0.005, 0, 100);
  request.mutable_job()->mutable_planes(0)->set_encoding(v1::PLANE_ENCODING_RAW);
  request.mutable_job()->mutable_planes(0)->set_sample_type(v1::SAMPLE_TYPE_FLOAT32);
  request.mutable_job()->mutable_planes(0)->mutable_channel()->set_name("x");
  const Failure failure = server.slice_failure(request);
  EXPECT_EQ(failure.reason, "JOB_EXCEEDS_MEMORY") << failure.message;
  EXPECT_EQ(failure.code, grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_FALSE(failure.retry);
  EXPECT_NE(failure.message.find("has 16 MiB"), std::string::npos) << failure.message;
  EXPECT_EQ(server.server().state().scratch.used_bytes(), 0u);
  EXPECT_TRUE(server.slice(slice_request(id, 1, 0, 10)).status.ok());
}

TEST(Resources, TrianglesThatNeverFitAreRefusedWithWhatTheyTake) {
  ServerOptions options = test_options();
  options.scratch_budget_bytes = 16 << 20;
  TestServer server(options);
  v1::TessellateBoundaryRequest request;
  request.set_mesh_id(server.upload_good(make_block(2, 10)));
  request.set_chord_tolerance_mm(0.0003);
  grpc::ClientContext context;
  const auto reader = server.stub().TessellateBoundary(&context, request);
  v1::TessellateBoundaryResponse message;
  EXPECT_FALSE(reader->Read(&message));
  const Failure failure = failure_of(reader->Finish());
  EXPECT_EQ(failure.reason, "JOB_EXCEEDS_MEMORY") << failure.message;
  EXPECT_NE(failure.message.find("has 16 MiB"), std::string::npos) << failure.message;
  EXPECT_NE(failure.message.find("chord_tolerance_mm"), std::string::npos) << failure.message;
  EXPECT_EQ(server.server().state().streams.used_bytes(), 0u);
}

TEST(Resources, AnUploadOfEmptyNamesIsRefusedBeforeItTakesMemory) {
  if (kKeepsFreedMemory) GTEST_SKIP() << "freed memory stays";
  ServerOptions options = test_options();
  options.preparation_budget_bytes = 1 << 30;
  TestServer server(options);
  std::string names(48 << 20, '\0');
  for (std::size_t i = 0; i < names.size(); i += 2) names[i] = '\x12';
  const std::string id = mesh_id_of(names);
  const std::size_t before = resident_bytes();
  std::atomic<bool> over = false;
  std::size_t peak = 0;
  std::thread watcher([&] {
    while (!over) {
      peak = std::max(peak, resident_bytes());
      std::this_thread::sleep_for(1ms);
    }
  });
  const Failure failure = failure_of(server.upload(id, names.size(), names));
  over = true;
  watcher.join();
  EXPECT_EQ(failure.reason, "MESH_TOO_LARGE") << failure.message;
  EXPECT_LT(peak, before + (150u << 20)) << "the bytes, and what gRPC holds of them";
}

TEST(Resources, AMeshThatTakesMoreThanTheServerHasIsRefused) {
  ServerOptions options = test_options();
  options.preparation_budget_bytes = 1 << 20;
  TestServer server(options);
  const Failure failure = failure_of(server.upload(make_block(10, 10)));
  EXPECT_EQ(failure.code, grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(failure.reason, "MESH_EXCEEDS_MEMORY");
  EXPECT_TRUE(server.upload(make_block(2, 10)).ok());
  EXPECT_EQ(server.server().state().preparations.used_bytes(), 0u);
}

TEST(Resources, AMeshThatFindsNoMemoryToBePreparedInWaitsForIt) {
  ServerOptions options = test_options();
  options.preparation_budget_bytes = 64 << 20;
  TestServer server(options);
  ServiceState& state = server.server().state();
  std::optional<PreparationMemory::Share> others(std::in_place, state.preparation_memory);
  ASSERT_TRUE(others->resize(64 << 20));
  std::future<grpc::Status> upload = std::async(std::launch::async, [&] { return server.upload(make_block(2, 10)); });
  EXPECT_EQ(upload.wait_for(500ms), std::future_status::timeout);
  others.reset();
  const grpc::Status status = upload.get();
  EXPECT_TRUE(status.ok()) << status.error_message();
}

TEST(Resources, AFinishedUploadThatWaitsForItsPreparationHasItsBytesOnLoanOnly) {
  const v1::ControlMesh mesh = make_block(16, 10);
  ServerOptions options = test_options();
  options.preparation_budget_bytes = 64 << 20;
  options.upload_budget_bytes = mesh.ByteSizeLong() + 1000;
  options.upload_loan = 500ms;
  TestServer server(options);
  ServiceState& state = server.server().state();
  std::optional<PreparationMemory::Share> prepared(std::in_place, state.preparation_memory);
  ASSERT_TRUE(prepared->resize(64 << 20));
  std::future<grpc::Status> upload = std::async(std::launch::async, [&] { return server.upload(mesh); });
  ASSERT_TRUE(eventually([&] { return state.uploads.used_bytes() == mesh.ByteSizeLong(); }, 5s));
  const auto ends_within = [&](std::chrono::milliseconds limit) {
    return eventually(
        [&] {
          server.server().sweep();
          return upload.wait_for(0s) == std::future_status::ready;
        },
        limit);
  };
  EXPECT_FALSE(ends_within(2s)) << "nobody else wants it";
  MemoryBudget::Share other(state.uploads, "other");
  EXPECT_FALSE(other.resize(2000));
  EXPECT_TRUE(ends_within(5s));
  prepared.reset();
  const Failure failure = failure_of(upload.get());
  EXPECT_EQ(failure.reason, "SERVER_BUSY");
  EXPECT_TRUE(failure.retry);
  EXPECT_NE(failure.message.find("too many bytes of uploads"), std::string::npos) << failure.message;
  EXPECT_TRUE(other.resize(2000));
}

TEST(Resources, PlansTakeAPlaceAmongTheCalls) {
  ServerOptions options = test_options();
  options.max_concurrent_calls = 1;
  options.max_waiting_calls = 0;
  TestServer server(options);
  v1::PlanSlicesRequest request;
  part_of(*request.mutable_job()).set_mesh_id(server.upload_good(make_block(1, 10)));
  Admission& admission = server.server().state().admission;
  EXPECT_TRUE(eventually([&] { return admission.running() == 0; }, 1s));
  Admission::Place place(admission);
  admission.request(place, [](const std::exception_ptr& refusal) { EXPECT_FALSE(refusal); });
  grpc::ClientContext context;
  v1::PlanSlicesResponse response;
  EXPECT_EQ(failure_of(server.stub().PlanSlices(&context, request, &response)).reason, "SERVER_BUSY");
}

TEST(Resources, PointCallsThatSendNothingTakeNoPlace) {
  TestServer server;
  const std::string id = server.upload_good(make_block(1, 10));
  ServiceState& state = server.server().state();
  EXPECT_TRUE(eventually([&] { return state.calls.open() == 0; }, 2s));
  grpc::ClientContext probe_contexts[40], evaluate_contexts[40];
  std::vector<std::unique_ptr<grpc::ClientReaderWriter<v1::ProbePointsRequest, v1::ProbePointsResponse>>> probes;
  std::vector<std::unique_ptr<grpc::ClientReaderWriter<v1::EvaluatePointsRequest, v1::EvaluatePointsResponse>>>
      evaluations;
  for (auto& context : probe_contexts) probes.push_back(server.stub().ProbePoints(&context));
  for (auto& context : evaluate_contexts) evaluations.push_back(server.stub().EvaluatePoints(&context));
  EXPECT_TRUE(eventually([&] { return state.calls.open() == 80; }, 5s));
  EXPECT_EQ(state.admission.running(), 0u);
  EXPECT_EQ(state.admission.waiting(), 0u);
  EXPECT_TRUE(server.slice(slice_request(id, 1, 0, 2)).status.ok());
  for (const auto& probe : probes) probe->WritesDone();
  for (const auto& probe : probes) EXPECT_TRUE(probe->Finish().ok());
  for (auto& context : evaluate_contexts) context.TryCancel();
  for (const auto& evaluation : evaluations) {
    EXPECT_EQ(evaluation->Finish().error_code(), grpc::StatusCode::CANCELLED);
  }
  EXPECT_TRUE(eventually([&] { return state.calls.open() == 0; }, 2s));
}

TEST(Resources, ACancelledPlanIsAnsweredWhileTheWorkersAreBusy) {
  TestServer server;
  ServiceState& state = server.server().state();
  v1::PlanSlicesRequest request;
  part_of(*request.mutable_job()).set_mesh_id(server.upload_good(make_block(1, 10)));
  std::promise<void> open;
  const auto opened = open.get_future().share();
  const std::size_t processors = state.executor.threads() + 1;
  std::atomic<std::size_t> busy = 0;
  for (std::size_t i = 0; i < processors; ++i) {
    state.executor.make_lane("somebody else", Pieces::kInteractive).post([&busy, opened] {
      ++busy;
      opened.wait();
    });
  }
  EXPECT_TRUE(eventually([&] { return busy == processors; }, 5s));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + 200ms);
  v1::PlanSlicesResponse response;
  EXPECT_EQ(server.stub().PlanSlices(&context, request, &response).error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  EXPECT_TRUE(eventually([&] { return state.admission.running() == 0; }, 100ms));
  open.set_value();
}

/// A client that neither sends nor reads.
class SilentClient : public ::testing::Test {
 protected:
  static ServerOptions options() {
    ServerOptions options = test_options();
    options.idle_timeout = 500ms;
    return options;
  }

  /// Its id. No call is open any more, so that the next one that is will be the one to look at.
  std::string upload(const v1::ControlMesh& mesh) {
    const std::string id = server_.upload_good(mesh);
    EXPECT_TRUE(eventually([this] { return server_.server().state().calls.open() == 0; }, 2s));
    return id;
  }

  /// Sweeps until the one call has ended.
  void be_silent() {
    EXPECT_TRUE(eventually([this] { return server_.server().state().calls.open() == 1; }, 2s));
    server_.server().sweep();
    EXPECT_EQ(server_.server().state().calls.open(), 1u) << "it has time";
    EXPECT_TRUE(eventually(
        [this] {
          server_.server().sweep();
          return server_.server().state().admission.running() == 0 && server_.server().state().calls.open() == 0;
        },
        5s));
    EXPECT_TRUE(eventually([this] { return server_.server().state().calls.open() == 0; }, 2s));
  }

  /// What the client is told then.
  template <class Stream>
  Failure failure_after_silence(Stream& stream) {
    be_silent();
    return failure_of(stream.Finish());
  }

  /// What it is told when it reads at last what had come before.
  template <class Response, class Stream>
  Failure failure_after_stall(Stream& stream) {
    be_silent();
    Response response;
    while (stream.Read(&response)) {
    }
    return failure_of(stream.Finish());
  }

  /// Some 100 MB of layers: far more than the transport holds.
  v1::SliceRangeRequest large_request(const std::string& id) {
    v1::SliceRangeRequest request = slice_request(id, 0.01, 0, 900);
    request.mutable_job()->mutable_planes(0)->set_encoding(v1::PLANE_ENCODING_RAW);
    return request;
  }

  void expect_stalled(const Failure& failure) {
    EXPECT_EQ(failure.code, grpc::StatusCode::UNAVAILABLE);
    EXPECT_EQ(failure.message.substr(0, 16), "STREAM_STALLED: ");
  }

  void expect_idle(const Failure& failure) {
    EXPECT_EQ(failure.code, grpc::StatusCode::DEADLINE_EXCEEDED);
    EXPECT_EQ(failure.reason, "STREAM_IDLE");
  }

  TestServer server_{options()};
};

TEST_F(SilentClient, LosesItsProbe) {
  grpc::ClientContext context;
  const auto stream = server_.stub().ProbePoints(&context);
  expect_idle(failure_after_silence(*stream));
}

TEST_F(SilentClient, LosesItsEvaluationAfterTheBatchesBefore) {
  const std::string id = upload(make_block(1, 10));
  grpc::ClientContext context;
  const auto stream = server_.stub().EvaluatePoints(&context);
  v1::EvaluatePointsRequest request;
  request.set_mesh_id(id);
  request.add_limit_cells(0);
  for (int i = 0; i < 3; ++i) request.add_uvw(0.5);
  ASSERT_TRUE(stream->Write(request));
  v1::EvaluatePointsResponse response;
  ASSERT_TRUE(stream->Read(&response));
  expect_idle(failure_after_silence(*stream));
}

TEST_F(SilentClient, LosesItsUpload) {
  grpc::ClientContext context;
  v1::UploadMeshResponse response;
  const auto writer = server_.stub().UploadMesh(&context, &response);
  v1::UploadMeshRequest message;
  message.mutable_start()->set_mesh_id("sha256:" + std::string(64, 'a'));
  message.mutable_start()->set_size_bytes(2 << 20);
  writer->Write(message);
  message.set_chunk(std::string(1 << 10, 'x'));
  writer->Write(message);
  expect_idle(failure_after_silence(*writer));
  EXPECT_TRUE(eventually([this] { return server_.server().state().uploads.used_bytes() == 0; }, 2s));
}

TEST_F(SilentClient, LosesTheLayersThatItDoesNotRead) {
  const std::string id = upload(make_block(2, 10));
  grpc::ClientContext context;
  const auto reader = server_.stub().SliceRange(&context, large_request(id));
  v1::SliceRangeResponse message;
  ASSERT_TRUE(reader->Read(&message));
  EXPECT_TRUE(eventually([this] { return server_.server().state().streams.used_bytes() > 0; }, 2s));
  expect_stalled(failure_after_stall<v1::SliceRangeResponse>(*reader));
  EXPECT_EQ(server_.server().state().streams.used_bytes(), 0u);
  EXPECT_TRUE(server_.server().state().cache.erase(id));
  EXPECT_EQ(server_.server().state().cache.use().used_bytes, 0u) << "the mesh isn't in use any more";
}

TEST_F(SilentClient, LosesAnswersThatItDoesNotRead) {
  const std::string id = upload(make_block(1, 10));
  grpc::ClientContext context;
  const auto stream = server_.stub().EvaluatePoints(&context);
  v1::EvaluatePointsRequest request;
  request.set_mesh_id(id);
  for (int i = 0; i < 4096; ++i) {
    request.add_limit_cells(0);
    for (int a = 0; a < 3; ++a) request.add_uvw(0.5);
  }
  std::thread writer([&] {
    while (stream->Write(request)) {
    }
  });
  expect_stalled(failure_after_stall<v1::EvaluatePointsResponse>(*stream));
  writer.join();
}

TEST_F(SilentClient, KeepsItsStreamWhileItReadsNowAndThen) {
  const std::string id = upload(make_block(2, 10));
  grpc::ClientContext context;
  const auto reader = server_.stub().SliceRange(&context, large_request(id));
  v1::SliceRangeResponse message;
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(reader->Read(&message)) << i;
    std::this_thread::sleep_for(100ms);
    server_.server().sweep();
  }
  context.TryCancel();
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::CANCELLED);
}

}  // namespace
}  // namespace ccslice::server
