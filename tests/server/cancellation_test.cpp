// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

//
// Clients that cancel, run out of time, read slowly or vanish: the work stops, memory stays bounded, nothing is left
// over.

#include <gtest/gtest.h>

#include <thread>

#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"
#include "tests/support/processor_time.h"

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;
using SteadyClock = std::chrono::steady_clock;

/// Fine enough that a layer takes far longer than the limits tested.
v1::SliceRangeRequest endless_request(const std::string& id) {
  v1::SliceRangeRequest request = slice_request(id, 0.002, 0, 2000);
  v1::PlaneSpec& channel = *request.mutable_job()->add_planes();
  channel.mutable_channel()->set_name("x");
  channel.set_sample_type(v1::SAMPLE_TYPE_FLOAT32);
  return request;
}

class Cancellation : public ::testing::Test {
 protected:
  /// Expects that all work ends, and takes little of the processor until then: 100 ms of each worker, and what
  /// cleaning up adds.
  void expect_it_stops() {
    const ProcessorTime used;
    server_.server().state().executor.wait_idle();
    EXPECT_TRUE(eventually([this] { return server_.server().state().admission.running() == 0; }, 30s));
    EXPECT_LT(used.seconds(), 0.5);
  }

  static ServerOptions options() {
    ServerOptions options = test_options();
    options.stream_window_bytes = 256 << 20;
    options.stream_budget_bytes = 512 << 20;
    options.scratch_budget_bytes = 2ull << 30;
    return options;
  }

  TestServer server_{options()};
  const std::string id_ = server_.upload_good(make_block(2, 10));
};

TEST_F(Cancellation, StopsTheWorkSoon) {
  grpc::ClientContext context;
  const auto reader = server_.stub().SliceRange(&context, endless_request(id_));
  v1::SliceRangeResponse message;
  ASSERT_TRUE(reader->Read(&message)) << "the header";
  std::this_thread::sleep_for(100ms);
  context.TryCancel();
  EXPECT_FALSE(reader->Read(&message) && reader->Read(&message));
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::CANCELLED);
  expect_it_stops();
}

TEST_F(Cancellation, ADeadlineStopsTheWorkSoon) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + 200ms);
  const auto reader = server_.stub().SliceRange(&context, endless_request(id_));
  v1::SliceRangeResponse message;
  while (reader->Read(&message)) {
  }
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  expect_it_stops();
}

TEST_F(Cancellation, AVanishedClientLeavesNothingBehind) {
  {
    // Its connection goes with it.
    const auto stub = server_.new_stub();
    grpc::ClientContext context;
    const auto reader = stub->SliceRange(&context, endless_request(id_));
    v1::SliceRangeResponse message;
    ASSERT_TRUE(reader->Read(&message));
    context.TryCancel();
  }
  expect_it_stops();
  EXPECT_TRUE(server_.server().state().cache.erase(id_));
  EXPECT_TRUE(eventually([this] { return server_.server().state().cache.use().used_bytes == 0; }, 1s))
      << "the mesh is no longer in use";
}

TEST_F(Cancellation, ASlowReaderHoldsABoundedWindowAndNoThread) {
  v1::SliceRangeRequest request = slice_request(id_, 0.005, 0, 1000);
  request.mutable_job()->mutable_planes(0)->set_encoding(v1::PLANE_ENCODING_RAW);  // 400 MB in all.
  const std::size_t before = resident_bytes();
  grpc::ClientContext context;
  const auto stub = server_.new_stub();
  const auto reader = stub->SliceRange(&context, request);
  v1::SliceRangeResponse message;
  ASSERT_TRUE(reader->Read(&message));
  server_.server().state().executor.wait_idle();  // The workers are free although the client doesn't read.
  EXPECT_LT(resident_bytes(), before + (128 << 20));
  const Sliced other = server_.slice(slice_request(id_, 0.5, 0, 10));
  EXPECT_TRUE(other.status.ok()) << "others are served meanwhile";
  std::uint32_t layers = 0;
  while (layers < 40 && reader->Read(&message)) layers += message.has_layer_end() ? 1 : 0;
  EXPECT_EQ(layers, 40u) << "the stream goes on once it is read";
  context.TryCancel();
  while (reader->Read(&message)) {
  }
  reader->Finish();
}

/// Of voxels of a shape that no other test has, so that its mask has to be made.
v1::SliceRangeRequest halftoned_request(const std::string& id, double shape) {
  v1::SliceRangeRequest request = slice_request(id, 0.5, 0, 1);
  request.mutable_job()->mutable_grid()->mutable_pitch()->set_z_mm(0.5 * shape);
  request.mutable_job()->clear_planes();
  request.mutable_job()->add_planes()->mutable_materials();
  for (const char* name : {"hard", "soft"}) {
    v1::PrintMaterial& material = *request.mutable_job()->mutable_printing()->add_materials();
    material.set_name(name);
    material.set_rgba(name[0] == 'h' ? 0x101010ff : 0x202020ff);
    v1::BlendStop& stop = *request.mutable_job()->mutable_printing()->mutable_map()->mutable_blend()->add_stops();
    stop.set_material(name);
    stop.set_value(name[0] == 'h' ? 0 : 1);
  }
  request.mutable_job()->mutable_printing()->mutable_map()->mutable_blend()->set_channel("x");
  request.mutable_job()->mutable_printing()->mutable_halftone()->set_method(v1::HALFTONE_METHOD_BLUE_NOISE);
  return request;
}

TEST_F(Cancellation, NobodyWaitsForTheMaskOfAnotherJob) {
  ASSERT_TRUE(server_.slice(halftoned_request(id_, 1)).status.ok()) << "its mask is there from now on";
  grpc::ClientContext context;
  const auto stub = server_.new_stub();
  const auto reader = stub->SliceRange(&context, halftoned_request(id_, 3));
  v1::SliceRangeResponse message;
  ASSERT_TRUE(reader->Read(&message) && message.has_header());
  std::this_thread::sleep_for(50ms);
  EXPECT_TRUE(server_.slice(halftoned_request(id_, 1)).status.ok());
  EXPECT_EQ(server_.server().state().admission.running(), 1u) << "the mask is still being made";
  context.TryCancel();
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::CANCELLED);
  expect_it_stops();
}

TEST_F(Cancellation, AStoppedProbeEnds) {
  grpc::ClientContext context;
  const auto stream = server_.stub().ProbePoints(&context);
  v1::ProbePointsRequest request;
  request.set_mesh_id(id_);
  for (int i = 0; i < 3; ++i) request.add_points_mm(5);
  ASSERT_TRUE(stream->Write(request));
  v1::ProbePointsResponse response;
  ASSERT_TRUE(stream->Read(&response));
  context.TryCancel();
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_TRUE(eventually([this] { return server_.server().state().admission.running() == 0; }, 1s));
}

TEST_F(Cancellation, AnAbandonedUploadLeavesNothingBehind) {
  {
    grpc::ClientContext context;
    v1::UploadMeshResponse response;
    const auto writer = server_.stub().UploadMesh(&context, &response);
    v1::UploadMeshRequest message;
    message.mutable_start()->set_mesh_id("sha256:" + std::string(64, 'a'));
    message.mutable_start()->set_size_bytes(2 << 20);
    writer->Write(message);
    message.set_chunk(std::string(1 << 20, 'x'));
    writer->Write(message);
    EXPECT_TRUE(eventually([this] { return server_.server().state().uploads.used_bytes() == 1 << 20; }, 2s));
    context.TryCancel();
    writer->Finish();
  }
  EXPECT_TRUE(eventually([this] { return server_.server().state().uploads.used_bytes() == 0; }, 2s));
  EXPECT_TRUE(eventually([this] { return server_.server().state().admission.running() == 0; }, 1s));
}

TEST_F(Cancellation, DestroyingTheServerEndsRunningCalls) {
  grpc::ClientContext context;
  const auto reader = server_.stub().SliceRange(&context, endless_request(id_));
  v1::SliceRangeResponse message;
  ASSERT_TRUE(reader->Read(&message));
  const auto start = SteadyClock::now();
  server_.stop();
  EXPECT_LT(SteadyClock::now() - start, 1s);
  while (reader->Read(&message)) {
  }
  EXPECT_FALSE(reader->Finish().ok());
}

}  // namespace
}  // namespace ccslice::server
