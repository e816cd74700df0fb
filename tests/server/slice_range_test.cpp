// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>
#include <zlib.h>
#include <zstd.h>

#include <bit>
#include <cmath>
#include <cstring>

#include "server/service/mesh_id.h"
#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"

namespace ccslice::server {
namespace {

std::string unzstd(const std::string& frame) {
  std::string bytes(ZSTD_getFrameContentSize(frame.data(), frame.size()), 0);
  bytes.resize(ZSTD_decompress(bytes.data(), bytes.size(), frame.data(), frame.size()));
  return bytes;
}

std::uint64_t bits_of(const std::string& bytes) {
  std::uint64_t bits = 0;
  for (const char byte : bytes) bits += static_cast<std::uint64_t>(std::popcount(static_cast<unsigned char>(byte)));
  return bits;
}

TEST(SliceRange, DeliversABoxAsItIs) {
  TestServer server;
  v1::SliceRangeRequest request = slice_request(server.upload_good(make_box(2, 10)), 0.5, 0, 20);
  v1::PlaneSpec& channel = *request.add_planes();
  channel.mutable_channel()->set_name("x");
  channel.set_sample_type(v1::SAMPLE_TYPE_FLOAT32);
  channel.set_encoding(v1::PLANE_ENCODING_RAW);
  request.set_contours(true);
  const Sliced sliced = server.slice(request);
  ASSERT_TRUE(sliced.status.ok()) << sliced.status.error_message();
  EXPECT_EQ(sliced.header.grid().extent().columns(), 20u);
  EXPECT_EQ(sliced.header.planes(0).sample_type(), v1::SAMPLE_TYPE_BIT);
  EXPECT_EQ(sliced.header.planes(0).encoding(), v1::PLANE_ENCODING_RAW_ZSTD);
  ASSERT_EQ(sliced.ends.size(), 20u);
  for (const auto& [index, end] : sliced.ends) {
    EXPECT_EQ(end.layer(), index);
    EXPECT_EQ(end.voxel_count(), 400u);
    EXPECT_EQ(end.statistics().voxels_unresolved(), 0u);
    const std::string occupancy = unzstd(sliced.planes.at(index)[0]);
    EXPECT_EQ(occupancy.size(), end.planes(0).raw_bytes());
    EXPECT_EQ(bits_of(occupancy), 400u);
    EXPECT_EQ(crc32(0, reinterpret_cast<const Bytef*>(occupancy.data()), static_cast<uInt>(occupancy.size())),
              end.planes(0).crc32());
    EXPECT_EQ(sliced.begins.at(index).contour_loops(), 1u);
    EXPECT_GE(sliced.contour_points.at(index), 4u);
    float samples[400];
    ASSERT_EQ(sliced.planes.at(index)[1].size(), sizeof samples);
    std::memcpy(samples, sliced.planes.at(index)[1].data(), sizeof samples);
    for (int i = 0; i < 400; ++i) ASSERT_NEAR(samples[i], 0.25 + 0.5 * (i % 20), 1e-5);
  }
  EXPECT_EQ(sliced.summary.layers(), 20u);
  EXPECT_EQ(sliced.summary.voxel_count(), 8000u);
}

TEST(SliceRange, SendsAllChannelsAsOneExr) {
  TestServer server;
  v1::SliceRangeRequest request = slice_request(server.upload_good(make_box(2, 10)), 0.5, 0, 1);
  request.mutable_planes(0)->mutable_channels();
  request.mutable_planes(0)->set_encoding(v1::PLANE_ENCODING_EXR);
  const Sliced sliced = server.slice(request);
  ASSERT_TRUE(sliced.status.ok()) << sliced.status.error_message();
  EXPECT_EQ(sliced.header.planes(0).sample_type(), v1::SAMPLE_TYPE_FLOAT32);
  ASSERT_EQ(sliced.header.planes(0).channels().names_size(), 1);
  EXPECT_EQ(sliced.header.planes(0).channels().names(0), "x");
  EXPECT_TRUE(sliced.planes.at(0)[0].starts_with("\x76\x2f\x31\x01"));
  EXPECT_EQ(sliced.ends.at(0).planes(0).raw_bytes(), 4u * 20 * 20);
}

TEST(SliceRange, SendsEmptyLayersToo) {
  TestServer server;
  v1::SliceRangeRequest request = slice_request(server.upload_good(make_box(1, 10)), 0.5, 0, 6);
  request.mutable_grid()->mutable_origin_mm()->set_z(9);
  request.mutable_grid()->mutable_extent()->set_columns(20);
  request.mutable_grid()->mutable_extent()->set_rows(20);
  request.mutable_grid()->mutable_extent()->set_layers(6);
  const Sliced sliced = server.slice(request);
  ASSERT_TRUE(sliced.status.ok()) << sliced.status.error_message();
  ASSERT_EQ(sliced.ends.size(), 6u);
  EXPECT_FALSE(sliced.ends.at(1).empty());
  EXPECT_TRUE(sliced.ends.at(2).empty());
  EXPECT_TRUE(sliced.ends.at(5).empty());
  EXPECT_EQ(sliced.summary.empty_layers(), 4u);
}

TEST(SliceRange, GivesTheSameBytesForAnyThreadsAndAnySplit) {
  const v1::ControlMesh mesh = make_block(3, 10);
  ServerOptions one_thread = test_options();
  one_thread.threads = 1;
  TestServer single(one_thread);
  TestServer server;
  const std::string id = server.upload_good(mesh);
  single.upload_good(mesh);
  const auto request = [&](std::uint32_t first, std::uint32_t count) {
    v1::SliceRangeRequest all = slice_request(id, 0.25, first, count);
    all.add_planes()->mutable_channel()->set_name("x");
    all.set_contours(true);
    return all;
  };
  const Sliced whole = single.slice(request(0, 24));
  ASSERT_TRUE(whole.status.ok()) << whole.status.error_message();
  ASSERT_EQ(whole.layer_bytes.size(), 24u);
  EXPECT_EQ(server.slice(request(0, 24)).layer_bytes, whole.layer_bytes);
  for (std::uint32_t split = 1; split <= 8; ++split) {  // Every layer of a slab.
    auto parts = server.slice(request(0, split)).layer_bytes;
    parts.merge(server.slice(request(split, 24 - split)).layer_bytes);
    EXPECT_EQ(parts, whole.layer_bytes) << "split at " << split;
  }
}

TEST(SliceRange, KeepsMessagesBelowTheChunkSizeAsked) {
  TestServer server;
  v1::SliceRangeRequest request = slice_request(server.upload_good(make_block(2, 10)), 0.05, 60, 2);
  request.mutable_planes(0)->set_encoding(v1::PLANE_ENCODING_RAW);
  request.set_contours(true);
  request.set_max_chunk_bytes(4096);
  const Sliced sliced = server.slice(request);
  ASSERT_TRUE(sliced.status.ok()) << sliced.status.error_message();
  EXPECT_LE(sliced.largest_message, 4096u + 64);
  EXPECT_GT(sliced.planes.at(60)[0].size(), 4096u);
}

class RefusedSlicing : public ::testing::Test {
 protected:
  void expect(grpc::StatusCode code, const std::string& reason, const std::string& field) {
    const Failure failure = server_.slice_failure(request_);
    EXPECT_EQ(failure.code, code);
    EXPECT_EQ(failure.reason, reason);
    EXPECT_EQ(failure.field, field) << failure.message;
  }

  TestServer server_;
  v1::SliceRangeRequest request_ = slice_request(server_.upload_good(make_box(1, 10)), 0.5, 0, 20);
};

TEST_F(RefusedSlicing, NoLayers) {
  request_.set_layer_count(0);
  expect(grpc::StatusCode::INVALID_ARGUMENT, "LAYER_RANGE_EMPTY", "layer_count");
}

TEST_F(RefusedSlicing, LayersBeyondTheGrid) {
  request_.set_layer_count(21);
  expect(grpc::StatusCode::OUT_OF_RANGE, "LAYER_RANGE_OUT_OF_BOUNDS", "layer_count");
  request_.set_first_layer(4'000'000'000);
  request_.set_layer_count(4'000'000'000);
  expect(grpc::StatusCode::OUT_OF_RANGE, "LAYER_RANGE_OUT_OF_BOUNDS", "first_layer");
}

TEST_F(RefusedSlicing, NothingAskedFor) {
  request_.clear_planes();
  expect(grpc::StatusCode::INVALID_ARGUMENT, "NOTHING_REQUESTED", "planes");
}

TEST_F(RefusedSlicing, TooManyPlanes) {
  for (int i = 0; i < 64; ++i) request_.add_planes()->mutable_occupancy();
  expect(grpc::StatusCode::INVALID_ARGUMENT, "TOO_MANY_PLANES", "planes");
}

TEST_F(RefusedSlicing, WrongChunkSizes) {
  for (const std::uint32_t bytes : {1u, 4095u, 1048577u, 4'000'000'000u}) {
    request_.set_max_chunk_bytes(bytes);
    expect(grpc::StatusCode::INVALID_ARGUMENT, "CHUNK_SIZE_INVALID", "max_chunk_bytes");
  }
}

TEST_F(RefusedSlicing, UnknownMesh) {
  request_.set_mesh_id(mesh_id_of("unknown"));
  expect(grpc::StatusCode::FAILED_PRECONDITION, "MESH_MISSING", "");
  EXPECT_EQ(server_.slice_failure(request_).missing, request_.mesh_id());
  request_.set_mesh_id("unknown");
  expect(grpc::StatusCode::INVALID_ARGUMENT, "MESH_ID_INVALID", "mesh_id");
}

TEST_F(RefusedSlicing, WrongPitchPlacementAndTolerance) {
  request_.mutable_grid()->mutable_pitch()->set_x_mm(-1);
  expect(grpc::StatusCode::INVALID_ARGUMENT, "PITCH_INVALID", "grid.pitch.x_mm");
  request_.mutable_grid()->mutable_pitch()->set_x_mm(1);
  request_.set_contour_tolerance_mm(-1);
  expect(grpc::StatusCode::INVALID_ARGUMENT, "TOLERANCE_INVALID", "contour_tolerance_mm");
  request_.clear_contour_tolerance_mm();
  request_.set_material_tolerance(2);
  expect(grpc::StatusCode::INVALID_ARGUMENT, "TOLERANCE_INVALID", "material_tolerance");
  for (int i = 0; i < 12; ++i) request_.mutable_placement()->add_matrix(0);
  expect(grpc::StatusCode::INVALID_ARGUMENT, "PLACEMENT_SINGULAR", "placement.matrix");
}

TEST_F(RefusedSlicing, AMessageLargerThanTheServerTakes) {
  request_.set_mesh_id(std::string(5 << 20, 'x'));
  EXPECT_EQ(server_.slice_failure(request_).code, grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_TRUE(server_.upload(make_block(1, 11)).ok()) << "the server is still up";
}

TEST(SliceRangeUnderLoad, MoreCallsThanTheServerTakesAreToldToComeBack) {
  ServerOptions options = test_options();
  options.max_concurrent_calls = 1;
  TestServer server(options);
  const v1::SliceRangeRequest request = slice_request(server.upload_good(make_block(2, 10)), 0.02, 0, 100);
  grpc::ClientContext context;
  const auto reader = server.stub().SliceRange(&context, request);
  v1::SliceRangeResponse message;
  ASSERT_TRUE(reader->Read(&message));
  const Failure failure = server.slice_failure(request);
  EXPECT_EQ(failure.code, grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(failure.reason, "SERVER_BUSY");
  EXPECT_TRUE(failure.retry);
  context.TryCancel();
  while (reader->Read(&message)) {
  }
  reader->Finish();
}

TEST(SliceRangeUnderLoad, AMeshThatIsDeletedWhileInUseIsSlicedToTheEnd) {
  TestServer server;
  const std::string id = server.upload_good(make_block(2, 10));
  grpc::ClientContext context;
  const auto reader = server.stub().SliceRange(&context, slice_request(id, 0.1, 0, 60));
  v1::SliceRangeResponse message;
  ASSERT_TRUE(reader->Read(&message));
  EXPECT_TRUE(server.server().state().cache.erase(id));
  EXPECT_GT(server.server().state().cache.use().used_bytes, 0u) << "still counted";
  while (reader->Read(&message)) {
  }
  EXPECT_TRUE(reader->Finish().ok());
  EXPECT_TRUE(eventually([&] { return server.server().state().cache.use().used_bytes == 0; }, std::chrono::seconds(2)));
}

}  // namespace
}  // namespace ccslice::server
