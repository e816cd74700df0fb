// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>
#include <zstd.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#include "core/output/image_file.h"
#include "server/service/meshes/mesh_id.h"
#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"
#include "tests/support/job_parts.h"

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

void add_float_channel(v1::SliceRangeRequest& request) {
  v1::PlaneSpec& channel = *request.mutable_job()->add_planes();
  channel.mutable_channel()->set_name("x");
  channel.set_sample_type(v1::SAMPLE_TYPE_FLOAT32);
  channel.set_encoding(v1::PLANE_ENCODING_RAW);
}

TEST(SliceRange, DeliversABoxAsItIs) {
  TestServer server;
  v1::SliceRangeRequest request = slice_request(server.upload_good(make_box(2, 10)), 0.5, 0, 20);
  add_float_channel(request);
  request.mutable_job()->mutable_contours();
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

// The block's corners are smooth, so the cells at its vertices are cut otherwise.
TEST(SliceRange, InterpolatesOtherwiseWithinTheSameToleranceIfProofIsAskedFor) {
  TestServer server;
  v1::SliceRangeRequest request = slice_request(server.upload_good(make_block(3, 10)), 0.125, 0, 40);
  add_float_channel(request);
  std::array<Sliced, 2> sliced;
  std::array<std::uint64_t, 2> interpolated{};
  for (const bool proved : {false, true}) {
    request.mutable_job()->mutable_tolerances()->set_prove_channels(proved);
    sliced[proved] = server.slice(request);
    ASSERT_TRUE(sliced[proved].status.ok()) << sliced[proved].status.error_message();
    for (const auto& [index, end] : sliced[proved].ends) interpolated[proved] += end.statistics().voxels_interpolated();
    EXPECT_GT(interpolated[proved], 0u);
  }
  EXPECT_NE(interpolated[0], interpolated[1]);
  for (const auto& [index, planes] : sliced[0].planes) {
    const std::string &sampled = planes[1], &proved = sliced[1].planes.at(index)[1];
    ASSERT_EQ(sampled.size(), proved.size());
    for (std::size_t at = 0; at < sampled.size(); at += sizeof(float)) {
      float a = 0, b = 0;
      std::memcpy(&a, &sampled[at], sizeof a);
      std::memcpy(&b, &proved[at], sizeof b);
      ASSERT_NEAR(a, b, 2 * 10 / 65536.0);
    }
  }
}

TEST(SliceRange, HoldsOutsideWhatIsAskedFor) {
  TestServer server;
  v1::SliceRangeRequest request = slice_request(server.upload_good(make_box(2, 10)), 0.5, 0, 20);
  request.mutable_job()->mutable_grid()->mutable_origin_mm()->set_x(-0.5);
  request.mutable_job()->mutable_grid()->mutable_extent()->set_columns(21);
  request.mutable_job()->mutable_grid()->mutable_extent()->set_rows(20);
  request.mutable_job()->mutable_grid()->mutable_extent()->set_layers(20);
  for (const v1::PlaneEncoding encoding : {v1::PLANE_ENCODING_RAW, v1::PLANE_ENCODING_PNG_ALPHA}) {
    v1::PlaneSpec& channel = *request.mutable_job()->add_planes();
    channel.mutable_channel()->set_name("x");
    channel.set_sample_type(v1::SAMPLE_TYPE_UINT8);
    channel.set_encoding(encoding);
    channel.set_outside_sample(200);
  }
  const Sliced sliced = server.slice(request);
  ASSERT_TRUE(sliced.status.ok()) << sliced.status.error_message();
  EXPECT_EQ(sliced.header.planes(1).outside_sample(), 200);
  const std::string& samples = sliced.planes.at(3)[1];
  ASSERT_EQ(samples.size(), 21u * 20);
  for (std::size_t row = 0; row < 20; ++row) {
    EXPECT_EQ(static_cast<unsigned char>(samples[21 * row]), 200) << "the column beside the box";
    EXPECT_LT(static_cast<unsigned char>(samples[21 * row + 1]), 10);
  }
  EXPECT_EQ(sliced.planes.at(3)[2][25], '\x04') << "a PNG of grey and alpha";
  EXPECT_EQ(sliced.ends.at(3).planes(1).crc32(), sliced.ends.at(3).planes(2).crc32()) << "of the same samples";
}

TEST(SliceRange, SendsAllChannelsAsOneExr) {
  TestServer server;
  v1::SliceRangeRequest request = slice_request(server.upload_good(make_box(2, 10)), 0.5, 0, 1);
  request.mutable_job()->mutable_planes(0)->mutable_channels();
  request.mutable_job()->mutable_planes(0)->set_encoding(v1::PLANE_ENCODING_EXR);
  const Sliced sliced = server.slice(request);
  if (!image_files_available()) {
    EXPECT_THAT(sliced.status.error_message(), testing::HasSubstr("CCSLICE_WITH_OPENIMAGEIO"));
    return;
  }
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
  request.mutable_job()->mutable_grid()->mutable_origin_mm()->set_z(9);
  request.mutable_job()->mutable_grid()->mutable_extent()->set_columns(20);
  request.mutable_job()->mutable_grid()->mutable_extent()->set_rows(20);
  request.mutable_job()->mutable_grid()->mutable_extent()->set_layers(6);
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
    all.mutable_job()->add_planes()->mutable_channel()->set_name("x");
    all.mutable_job()->mutable_contours();
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
  request.mutable_job()->mutable_planes(0)->set_encoding(v1::PLANE_ENCODING_RAW);
  request.mutable_job()->mutable_contours();
  request.set_max_chunk_bytes(4096);
  const Sliced sliced = server.slice(request);
  ASSERT_TRUE(sliced.status.ok()) << sliced.status.error_message();
  EXPECT_LE(sliced.largest_message, 4096u + 64);
  EXPECT_GT(sliced.planes.at(60)[0].size(), 4096u);
}

/// A request for the box of make_box(2, 10) in raw floats of its gradient along x.
v1::SliceRangeRequest graded_request(const std::string& id, std::uint32_t first, std::uint32_t count) {
  v1::SliceRangeRequest request = slice_request(id, 0.5, first, count);
  request.mutable_job()->mutable_planes(0)->mutable_channel()->set_name("x");
  request.mutable_job()->mutable_planes(0)->set_sample_type(v1::SAMPLE_TYPE_FLOAT32);
  request.mutable_job()->mutable_planes(0)->set_encoding(v1::PLANE_ENCODING_RAW);
  return request;
}

v1::VoxelBox voxels(std::uint32_t column, std::uint32_t row, std::uint32_t layer, std::uint32_t columns,
                    std::uint32_t rows, std::uint32_t layers) {
  v1::VoxelBox region;
  region.set_first_column(column);
  region.set_first_row(row);
  region.set_first_layer(layer);
  region.mutable_extent()->set_columns(columns);
  region.mutable_extent()->set_rows(rows);
  region.mutable_extent()->set_layers(layers);
  return region;
}

TEST(SliceRange, OfARegionIsACropOfTheWhole) {
  TestServer server;
  const std::string id = server.upload_good(make_box(2, 10));
  const Sliced whole = server.slice(graded_request(id, 4, 2));
  EXPECT_EQ(whole.header.region().SerializeAsString(), voxels(0, 0, 0, 20, 20, 20).SerializeAsString());
  v1::SliceRangeRequest request = graded_request(id, 4, 2);
  *request.mutable_job()->mutable_region()->mutable_voxels() = voxels(3, 7, 4, 5, 6, 2);
  const Sliced part = server.slice(request);
  ASSERT_TRUE(part.status.ok()) << part.status.error_message();
  EXPECT_EQ(part.header.grid().SerializeAsString(), whole.header.grid().SerializeAsString());
  EXPECT_EQ(part.header.region().SerializeAsString(), request.job().region().voxels().SerializeAsString());
  EXPECT_EQ(part.header.layout().row_order(), v1::ROW_ORDER_ASCENDING_Y);
  EXPECT_EQ(part.summary.voxel_count(), 2u * 5 * 6);
  for (const std::uint32_t layer : {4u, 5u}) {
    std::string crop;
    for (std::size_t row = 7; row < 13; ++row) crop += whole.planes.at(layer)[0].substr(4 * (20 * row + 3), 4 * 5);
    EXPECT_EQ(part.planes.at(layer)[0], crop);
    EXPECT_EQ(part.ends.at(layer).planes(0).raw_bytes(), crop.size());
  }
  request.mutable_job()->clear_region();
  v1::Box3& box = *request.mutable_job()->mutable_region()->mutable_box_mm();
  const v1::Vector3& origin = whole.header.grid().origin_mm();
  const auto corner = [&](v1::Vector3& at, double x, double y, double z) {
    at.set_x(origin.x() + x);
    at.set_y(origin.y() + y);
    at.set_z(origin.z() + z);
  };
  corner(*box.mutable_min_mm(), 1.5, 3.5, 2);
  corner(*box.mutable_max_mm(), 4, 6.5, 3);
  EXPECT_EQ(server.slice(request).layer_bytes, part.layer_bytes) << "the same region in mm";
}

TEST(SliceRange, LaysPicturesOutAsAskedFor) {
  TestServer server;
  v1::SliceRangeRequest request = graded_request(server.upload_good(make_box(2, 10)), 4, 1);
  *request.mutable_job()->mutable_region()->mutable_voxels() = voxels(3, 7, 4, 5, 6, 1);
  const std::string plain = server.slice(request).planes.at(4)[0];
  const auto sample = [](const std::string& plane, std::size_t column, std::size_t row) {
    return plane.substr(4 * (5 * row + column), 4);
  };
  for (const bool flip_x : {false, true}) {
    for (const bool flip_y : {false, true}) {
      for (const v1::RowOrder order :
           {v1::ROW_ORDER_UNSPECIFIED, v1::ROW_ORDER_ASCENDING_Y, v1::ROW_ORDER_DESCENDING_Y}) {
        request.mutable_job()->mutable_layout()->set_flip_x(flip_x);
        request.mutable_job()->mutable_layout()->set_flip_y(flip_y);
        request.mutable_job()->mutable_layout()->set_row_order(order);
        const Sliced sliced = server.slice(request);
        EXPECT_EQ(sliced.header.layout().flip_x(), flip_x);
        EXPECT_NE(sliced.header.layout().row_order(), v1::ROW_ORDER_UNSPECIFIED);
        const bool upside_down = flip_y != (order == v1::ROW_ORDER_DESCENDING_Y);
        for (std::size_t row = 0; row < 6; ++row) {
          for (std::size_t column = 0; column < 5; ++column) {
            ASSERT_EQ(sample(sliced.planes.at(4)[0], column, row),
                      sample(plain, flip_x ? 4 - column : column, upside_down ? 5 - row : row));
          }
        }
      }
    }
  }
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

TEST_F(RefusedSlicing, LayersBeyondTheRegion) {
  *request_.mutable_job()->mutable_region()->mutable_voxels() = voxels(0, 0, 5, 1, 1, 3);
  request_.set_layer_count(1);
  expect(grpc::StatusCode::OUT_OF_RANGE, "LAYER_RANGE_OUT_OF_BOUNDS", "first_layer");
  request_.set_first_layer(6);
  request_.set_layer_count(3);
  expect(grpc::StatusCode::OUT_OF_RANGE, "LAYER_RANGE_OUT_OF_BOUNDS", "layer_count");
}

TEST_F(RefusedSlicing, RegionsThatAreNone) {
  using grpc::StatusCode;
  request_.mutable_job()->mutable_region();
  expect(StatusCode::INVALID_ARGUMENT, "REGION_EMPTY", "job.region");
  *request_.mutable_job()->mutable_region()->mutable_voxels() = voxels(0, 0, 0, 4, 4, 0);
  expect(StatusCode::INVALID_ARGUMENT, "REGION_EMPTY", "job.region.voxels.extent.layers");
  *request_.mutable_job()->mutable_region()->mutable_voxels() = voxels(0, 17, 0, 4, 4, 4);
  expect(StatusCode::INVALID_ARGUMENT, "REGION_OUT_OF_GRID", "job.region.voxels.extent.rows");
  v1::Box3& box = *request_.mutable_job()->mutable_region()->mutable_box_mm();
  box.mutable_min_mm();
  box.mutable_max_mm()->set_x(std::nan(""));
  expect(StatusCode::INVALID_ARGUMENT, "REGION_NON_FINITE", "job.region.box_mm.max_mm.x");
  box.mutable_max_mm()->set_x(0);
  expect(StatusCode::INVALID_ARGUMENT, "REGION_EMPTY", "job.region.box_mm");
  for (v1::Vector3* corner : {box.mutable_min_mm(), box.mutable_max_mm()}) {
    const double at = corner == box.mutable_min_mm() ? 1000 : 1001;
    corner->set_x(at);
    corner->set_y(at);
    corner->set_z(at);
  }
  expect(StatusCode::INVALID_ARGUMENT, "REGION_OUT_OF_GRID", "job.region.box_mm");
}

TEST_F(RefusedSlicing, OrdersOfRowsThatDoNotExist) {
  request_.mutable_job()->mutable_layout()->set_row_order(static_cast<v1::RowOrder>(17));
  expect(grpc::StatusCode::INVALID_ARGUMENT, "ENUM_VALUE_UNKNOWN", "job.layout.row_order");
}

TEST_F(RefusedSlicing, NothingAskedFor) {
  request_.mutable_job()->clear_planes();
  expect(grpc::StatusCode::INVALID_ARGUMENT, "NOTHING_REQUESTED", "job.planes");
}

TEST_F(RefusedSlicing, TooManyPlanes) {
  for (int i = 0; i < 64; ++i) request_.mutable_job()->add_planes()->mutable_occupancy();
  expect(grpc::StatusCode::INVALID_ARGUMENT, "TOO_MANY_PLANES", "job.planes");
}

TEST_F(RefusedSlicing, WrongChunkSizes) {
  for (const std::uint32_t bytes : {1u, 4095u, 1048577u, 4'000'000'000u}) {
    request_.set_max_chunk_bytes(bytes);
    expect(grpc::StatusCode::INVALID_ARGUMENT, "CHUNK_SIZE_INVALID", "max_chunk_bytes");
  }
}

TEST_F(RefusedSlicing, NoParts) {
  request_.mutable_job()->clear_parts();
  expect(grpc::StatusCode::INVALID_ARGUMENT, "PARTS_MISSING", "job.parts");
  request_.clear_job();
  expect(grpc::StatusCode::INVALID_ARGUMENT, "PARTS_MISSING", "job.parts");
}

TEST_F(RefusedSlicing, UnknownMesh) {
  part_of(*request_.mutable_job()).set_mesh_id(mesh_id_of("unknown"));
  expect(grpc::StatusCode::FAILED_PRECONDITION, "MESH_MISSING", "");
  EXPECT_EQ(server_.slice_failure(request_).missing, request_.job().parts(0).mesh_id());
  part_of(*request_.mutable_job()).set_mesh_id("unknown");
  expect(grpc::StatusCode::INVALID_ARGUMENT, "MESH_ID_INVALID", "job.parts[0].mesh_id");
}

TEST_F(RefusedSlicing, WrongPitchPlacementAndTolerance) {
  request_.mutable_job()->mutable_grid()->mutable_pitch()->set_x_mm(-1);
  expect(grpc::StatusCode::INVALID_ARGUMENT, "PITCH_INVALID", "job.grid.pitch.x_mm");
  request_.mutable_job()->mutable_grid()->mutable_pitch()->set_x_mm(1);
  request_.mutable_job()->mutable_tolerances()->set_contour_mm(-1);
  expect(grpc::StatusCode::INVALID_ARGUMENT, "TOLERANCE_INVALID", "job.tolerances.contour_mm");
  request_.mutable_job()->mutable_tolerances()->clear_contour_mm();
  request_.mutable_job()->mutable_tolerances()->set_channel(2);
  expect(grpc::StatusCode::INVALID_ARGUMENT, "TOLERANCE_INVALID", "job.tolerances.channel");
  for (int i = 0; i < 12; ++i) placement_of(*request_.mutable_job()).add_matrix(0);
  expect(grpc::StatusCode::INVALID_ARGUMENT, "PLACEMENT_SINGULAR", "job.parts[0].placements[0].matrix");
}

TEST_F(RefusedSlicing, AMessageLargerThanTheServerTakes) {
  part_of(*request_.mutable_job()).set_mesh_id(std::string(5 << 20, 'x'));
  EXPECT_EQ(server_.slice_failure(request_).code, grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_TRUE(server_.upload(make_block(1, 11)).ok()) << "the server is still up";
}

/// 25 MB: more than goes out unread, so the call lasts as long as nobody reads.
v1::SliceRangeRequest lasting_request(const std::string& mesh_id) {
  v1::SliceRangeRequest request = slice_request(mesh_id, 0.01, 0, 200);
  request.mutable_job()->mutable_planes(0)->set_encoding(v1::PLANE_ENCODING_RAW);
  return request;
}

TEST(SliceRangeUnderLoad, MoreCallsThanTheServerTakesAreToldToComeBack) {
  ServerOptions options = test_options();
  options.max_concurrent_calls = 1;
  options.max_waiting_calls = 0;
  TestServer server(options);
  const v1::SliceRangeRequest request = lasting_request(server.upload_good(make_block(2, 10)));
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
  const auto reader = server.stub().SliceRange(&context, lasting_request(id));
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
