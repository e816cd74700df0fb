// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <limits>
#include <numeric>
#include <string>
#include <thread>
#include <vector>

#include "tests/server/preview_fixture.h"
#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"
#include "tests/support/job_parts.h"

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

TEST_F(Preview, ShowsThePlaneCoarseAndFull) {
  v1::PreviewRequest asked = request(1);
  asked.set_coarse(true);
  asked.set_contours(true);
  const std::vector<Shown> pictures = shown({asked});
  ASSERT_EQ(pictures.size(), 2u);
  EXPECT_EQ(pictures[0].stage, v1::PREVIEW_STAGE_COARSE);
  EXPECT_EQ(pictures[0].header.width(), 8u);
  EXPECT_EQ(pictures[1].stage, v1::PREVIEW_STAGE_FULL);
  EXPECT_EQ(pictures[1].number, 1u);
  const v1::PreviewHeader& header = pictures[1].header;
  EXPECT_EQ(header.width(), 64u);
  EXPECT_EQ(header.height(), 64u);
  EXPECT_DOUBLE_EQ(header.up_mm_per_pixel(), 0.2);
  EXPECT_EQ(pictures[1].bytes.size(), 64u * 64 * 4);
  EXPECT_EQ(header.pixels_inside(), 50u * 50);
  ASSERT_EQ(pictures[1].outlines.size(), 1u);
  EXPECT_GE(pictures[1].outlines[0].points_mm_size(), 6);
  EXPECT_GE(header.queued_ms(), 0);
  EXPECT_GT(header.worked_ms(), 0);
}

TEST_F(Preview, LaterRequestsTakeWhatEarlierOnesSet) {
  v1::PreviewRequest first = request(1), second = request(2);
  // Moved away: nothing is in the picture.
  for (const double number : {1, 0, 0, 100, 0, 1, 0, 0, 0, 0, 1, 0}) first.mutable_placement()->add_matrix(number);
  second.clear_mesh_id();
  grpc::ClientContext context;
  const auto stream = server_.stub().Preview(&context);
  v1::PreviewResponse message;
  for (const v1::PreviewRequest& each : {first, second}) {
    stream->Write(each);
    ASSERT_TRUE(stream->Read(&message));
    EXPECT_EQ(message.number(), each.number());
    EXPECT_EQ(message.header().pixels_inside(), 0u);
  }
  v1::PreviewRequest third = request(3);
  third.mutable_placement();
  stream->Write(third);
  ASSERT_TRUE(stream->Read(&message));
  EXPECT_GT(message.header().pixels_inside(), 1000u);
  stream->WritesDone();
  EXPECT_FALSE(stream->Read(&message));
  EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(Preview, TheLatestOfManyRequestsWins) {
  std::vector<v1::PreviewRequest> requests;
  constexpr std::uint64_t kMany = 10'000;
  for (std::uint64_t number = 1; number <= kMany; ++number) {
    requests.push_back(request(number));
    requests.back().set_coarse(true);
    if (number > 1) requests.back().clear_mesh_id();
  }
  const std::vector<Shown> pictures = shown(requests);
  ASSERT_FALSE(pictures.empty());
  EXPECT_EQ(pictures.back().number, kMany);
  EXPECT_EQ(pictures.back().stage, v1::PREVIEW_STAGE_FULL);
  EXPECT_LT(pictures.size(), 2 * kMany);
  std::uint64_t last = 0;
  for (const Shown& picture : pictures) {
    EXPECT_GE(picture.number, last);
    // A full picture follows its own coarse one.
    if (picture.stage == v1::PREVIEW_STAGE_FULL) {
      EXPECT_EQ(picture.number, last);
    }
    last = picture.number;
  }
}

TEST_F(Preview, ChannelsHaveALegend) {
  v1::PreviewRequest asked = request(1);
  asked.mutable_content()->mutable_channel()->set_channel("x");
  asked.mutable_content()->mutable_channel()->set_colours(v1::COLOUR_MAP_NAME_CIVIDIS);
  const std::vector<Shown> pictures = shown({asked});
  ASSERT_EQ(pictures.size(), 1u);
  const v1::PreviewHeader& header = pictures[0].header;
  EXPECT_GT(header.range().max(), header.range().min());
  ASSERT_GE(header.colours_size(), 2);
  EXPECT_EQ(header.colours(0), 0x00224effu);
}

TEST_F(Preview, CountsPixelsByValue) {
  v1::PreviewRequest asked = request(1);
  v1::ChannelColours& channel = *asked.mutable_content()->mutable_channel();
  channel.set_channel("x");
  channel.mutable_range()->set_min(-1);
  channel.mutable_range()->set_max(0.5);
  const std::vector<Shown> pictures = shown({asked});
  ASSERT_EQ(pictures.size(), 1u);
  const auto& counts = pictures[0].header.value_pixels();
  ASSERT_EQ(counts.size(), 64);
  EXPECT_EQ(std::accumulate(counts.begin(), counts.end(), std::uint64_t{0}), 50u * 50);
  EXPECT_EQ(std::accumulate(counts.begin(), counts.begin() + 42, std::uint64_t{0}), 0u) << "nothing is below 0";
  EXPECT_GE(counts[63], 25u * 50) << "what is beyond the range";
  EXPECT_TRUE(shown({request(1)})[0].header.value_pixels().empty()) << "of channels only";
}

TEST_F(Preview, DrawsOutlinesOnTop) {
  v1::PreviewRequest asked = request(1);
  const std::string plain = shown({asked})[0].bytes;
  v1::PreviewLines& lines = *asked.mutable_content()->mutable_lines();
  lines.set_width_pixels(4);
  lines.set_rgba(0x11223300);
  const std::vector<Shown> pictures = shown({asked});
  ASSERT_EQ(pictures.size(), 1u);
  EXPECT_TRUE(pictures[0].outlines.empty()) << "drawn, not sent";
  EXPECT_EQ(pictures[0].header.pixels_inside(), 50u * 50);
  const auto pixel = [](const std::string& rgba, std::size_t column, std::size_t row) {
    return rgba.substr(4 * (64 * row + column), 4);
  };
  // The cube is at pixels 7 to 56.
  EXPECT_EQ(pixel(pictures[0].bytes, 30, 6), "\x11\x22\x33\xff");
  EXPECT_EQ(pixel(pictures[0].bytes, 30, 8), "\x11\x22\x33\xff");
  EXPECT_EQ(pixel(pictures[0].bytes, 30, 3), std::string(4, '\0'));
  EXPECT_EQ(pixel(pictures[0].bytes, 30, 30), pixel(plain, 30, 30));
}

TEST_F(Preview, LayersAreThoseOfSliceRange) {
  const std::vector<Shown> pictures = shown({layer_request(1, 0.5, 9)});
  ASSERT_EQ(pictures.size(), 1u);
  const Sliced sliced = server_.slice(slice_request(id_, 0.5, 9, 1));
  EXPECT_EQ(pictures[0].header.pixels_inside(), sliced.ends.at(9).voxel_count());
  EXPECT_EQ(pictures[0].header.width(), sliced.header.grid().extent().columns());
}

TEST_F(Preview, RefusesWithTheFieldAndTheRemedy) {
  const auto expect = [&](const std::string& reason, const std::string& field, auto&& change) {
    v1::PreviewRequest bad = request(1);
    change(bad);
    const Failure failed = failure(bad);
    EXPECT_EQ(failed.reason, reason) << failed.message;
    EXPECT_EQ(failed.field, field) << failed.message;
  };
  expect("REQUEST_MALFORMED", "number", [](auto& r) { r.set_number(0); });
  expect("REQUEST_MALFORMED", "plane", [](auto& r) { r.clear_plane(); });
  expect("CONTENT_INVALID", "content", [](auto& r) { r.clear_content(); });
  expect("PICTURE_TOO_LARGE", "width", [](auto& r) { r.set_width(1'000'000); });
  expect("PICTURE_TOO_LARGE", "height", [](auto& r) { r.set_height(0); });
  expect("PLANE_INVALID", "plane.free.up", [](auto& r) { r.mutable_plane()->mutable_free()->mutable_up()->set_x(1); });
  expect("PLANE_INVALID", "plane.free.across", [](auto& r) {
    r.mutable_plane()->mutable_free()->mutable_across()->set_x(std::numeric_limits<double>::quiet_NaN());
  });
  expect("CHANNEL_UNKNOWN", "content.channel.channel",
         [](auto& r) { r.mutable_content()->mutable_channel()->set_channel("nothing"); });
  expect("ENUM_VALUE_UNKNOWN", "content.channel.colours", [](auto& r) {
    r.mutable_content()->mutable_channel()->set_channel("x");
    r.mutable_content()->mutable_channel()->set_colours(static_cast<v1::ColourMapName>(77));
  });
  expect("VALUE_RANGE_INVALID", "content.channel.range", [](auto& r) {
    r.mutable_content()->mutable_channel()->set_channel("x");
    r.mutable_content()->mutable_channel()->mutable_range()->set_min(1);
    r.mutable_content()->mutable_channel()->mutable_range()->set_max(1);
  });
  expect("CONTENT_INVALID", "content.lines.width_pixels",
         [](auto& r) { r.mutable_content()->mutable_lines()->set_width_pixels(17); });
  expect("MATERIALS_MISSING", "printing", [](auto& r) { r.mutable_content()->mutable_mix(); });
  expect("MESH_ID_INVALID", "mesh_id", [](auto& r) { r.set_mesh_id("ring"); });
}

TEST_F(Preview, RefusesLayersOfJobsThatCannotBe) {
  const auto expect = [&](const std::string& reason, const std::string& field, auto&& change) {
    v1::PreviewRequest bad = layer_request(1, 1, 3);
    change(bad, *bad.mutable_plane()->mutable_layer()->mutable_job());
    const Failure failed = failure(bad);
    EXPECT_EQ(failed.reason, reason) << failed.message;
    EXPECT_EQ(failed.field, field) << failed.message;
  };
  expect("LAYER_RANGE_OUT_OF_BOUNDS", "plane.layer.layer",
         [](auto& r, auto&) { r.mutable_plane()->mutable_layer()->set_layer(10); });
  expect("REQUEST_MALFORMED", "width", [](auto& r, auto&) { r.set_width(10); });
  expect("REQUEST_MALFORMED", "mesh_id", [&](auto& r, auto&) { r.set_mesh_id("sha256:" + std::string(64, '0')); });
  expect("PARTS_MISSING", "plane.layer.job.parts", [](auto&, auto& job) { job.clear_parts(); });
  expect("PART_NAME_INVALID", "plane.layer.job.parts[0].name", [](auto&, auto& job) { job.add_parts(); });
  expect("MESH_ID_INVALID", "plane.layer.job.parts[0].mesh_id",
         [](auto&, auto& job) { job.mutable_parts(0)->set_mesh_id("ring"); });
  expect("PITCH_MISSING", "plane.layer.job.grid.pitch", [](auto&, auto& job) { job.clear_grid(); });
  expect("PLACEMENT_SINGULAR", "plane.layer.job.parts[0].placements[0].matrix", [](auto&, auto& job) {
    for (int i = 0; i < 12; ++i) placement_of(job).add_matrix(0);
  });
  expect("TOLERANCE_INVALID", "plane.layer.job.tolerances.contour_mm",
         [](auto&, auto& job) { job.mutable_tolerances()->set_contour_mm(-1); });
  expect("MATERIALS_MISSING", "plane.layer.job.printing",
         [](auto& r, auto&) { r.mutable_content()->mutable_halftone(); });
  expect("CONTENT_INVALID", "content", [](auto& r, auto&) { r.clear_content(); });
  expect("FRACTIONS_OUT_OF_RANGE", "plane.layer.job.printing.map.strict", [](auto& r, auto& job) {
    r.mutable_content()->mutable_halftone();
    v1::MaterialMap& map = *job.mutable_printing()->mutable_map();
    map.set_strict(true);
    map.mutable_blend()->set_channel("x");  // From 0 to 10.
    for (const char* const name : {"a", "b"}) {
      v1::PrintMaterial& material = *job.mutable_printing()->add_materials();
      material.set_name(name);
      material.set_rgba(name[0] == 'a' ? 0xff0000ff : 0x00ff00ff);
      v1::BlendStop& stop = *map.mutable_blend()->add_stops();
      stop.set_value(name[0] - 'a');
      stop.set_material(name);
    }
  });
}

TEST_F(Preview, LayersTakePlacementAndPrintingFromTheirJobsAlone) {
  v1::PreviewRequest moved = request(1);
  for (const double number : {1, 0, 0, 100, 0, 1, 0, 0, 0, 0, 1, 0}) moved.mutable_placement()->add_matrix(number);
  const v1::PreviewRequest layer = layer_request(2, 1, 3);
  v1::PreviewRequest again = request(3);
  again.clear_mesh_id();
  grpc::ClientContext context;
  const auto stream = server_.stub().Preview(&context);
  v1::PreviewResponse message;
  for (const v1::PreviewRequest& asked : {moved, layer, again}) {
    stream->Write(asked);
    ASSERT_TRUE(stream->Read(&message));
    EXPECT_EQ(message.header().pixels_inside(), asked.number() == 2 ? 100u : 0u) << asked.number();
  }
  stream->WritesDone();
  EXPECT_FALSE(stream->Read(&message));
  EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(Preview, NumbersGoUpAndTheMeshStays) {
  grpc::Status status;
  v1::PreviewRequest same = request(1);
  const std::vector<Shown> pictures = shown({request(1), same}, &status);
  EXPECT_EQ(failure_of(status).reason, "REQUEST_MALFORMED");
  EXPECT_THAT(failure_of(status).message, HasSubstr("1 comes after 1"));
  EXPECT_LE(pictures.size(), 1u);
  shown({request(7), request(3)}, &status);
  EXPECT_THAT(failure_of(status).message, HasSubstr("3 comes after 7"));

  v1::PreviewRequest free = request(2), layer = layer_request(2, 1, 3);
  const std::string other = server_.upload_good(make_box(1, 10));
  free.set_mesh_id(other);
  part_of(*layer.mutable_plane()->mutable_layer()->mutable_job()).set_mesh_id(other);
  shown({request(1), layer_request(2, 1, 3)});
  for (const v1::PreviewRequest& changed : {free, layer}) {
    grpc::ClientContext context;
    const auto stream = server_.stub().Preview(&context);
    v1::PreviewResponse message;
    stream->Write(request(1));
    ASSERT_TRUE(stream->Read(&message));
    stream->Write(changed);
    EXPECT_FALSE(stream->Read(&message));
    const std::string path = changed.plane().has_layer() ? "plane.layer.job.parts[0]." : "";
    EXPECT_EQ(failure_of(stream->Finish()).field, path + "mesh_id");
  }
}

TEST_F(Preview, RefusesFieldsOfNewerClients) {
  v1::PreviewRequest newer = request(1);
  newer.GetReflection()->MutableUnknownFields(&newer)->AddVarint(900, 1);
  EXPECT_EQ(failure(newer).reason, "REQUEST_UNKNOWN_FIELD");
  newer = request(1);
  v1::PreviewContent& content = *newer.mutable_content();
  content.GetReflection()->MutableUnknownFields(&content)->AddVarint(900, 1);
  EXPECT_EQ(failure(newer).reason, "REQUEST_UNKNOWN_FIELD");
}

TEST_F(Preview, ShowsAPartOfOneVoxelInOnePixel) {
  const v1::PreviewRequest voxel = layer_request(1, 10, 0);
  v1::PreviewRequest pixel = request(1);
  pixel.set_width(1);
  pixel.set_height(1);
  pixel.mutable_plane()->mutable_free()->set_across_mm_per_pixel(10);
  pixel.set_coarse(true);
  for (const v1::PreviewRequest& asked : {voxel, pixel}) {
    const std::vector<Shown> pictures = shown({asked});
    ASSERT_FALSE(pictures.empty());
    EXPECT_EQ(pictures.back().header.width(), 1u);
    EXPECT_EQ(pictures.back().header.pixels_inside(), 1u);
    EXPECT_EQ(pictures.back().bytes.size(), 4u);
  }
}

TEST_F(Preview, ShowsTheLastOfTheMostChannels) {
  v1::PreviewRequest asked = request(1);
  asked.set_mesh_id(server_.upload_good(with_channels(make_box(1, 10), 64)));
  asked.mutable_content()->mutable_channel()->set_channel("channel 63");
  const std::vector<Shown> pictures = shown({asked});
  ASSERT_EQ(pictures.size(), 1u);
  EXPECT_FLOAT_EQ(static_cast<float>(pictures[0].header.range().min()), 63);
  EXPECT_EQ(pictures[0].header.value_pixels(0), 50u * 50) << "all of one value";
  EXPECT_EQ(failure_of(server_.upload(with_channels(make_box(1, 10), 100))).reason, "MESH_TOO_LARGE");
}

TEST_F(Preview, AMeshInUseStaysWhenItIsDeleted) {
  grpc::ClientContext context;
  const auto stream = server_.stub().Preview(&context);
  v1::PreviewResponse message;
  stream->Write(request(1));
  ASSERT_TRUE(stream->Read(&message));
  grpc::ClientContext deleting;
  v1::DeleteMeshRequest remove;
  remove.set_mesh_id(id_);
  v1::DeleteMeshResponse removed;
  ASSERT_TRUE(server_.stub().DeleteMesh(&deleting, remove, &removed).ok());
  stream->Write(request(2));
  ASSERT_TRUE(stream->Read(&message));
  EXPECT_EQ(message.number(), 2u);
  stream->WritesDone();
  EXPECT_FALSE(stream->Read(&message));
  EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(Preview, HoldsNoPlaceBetweenRequests) {
  grpc::ClientContext context;
  const auto stream = server_.stub().Preview(&context);
  v1::PreviewResponse message;
  stream->Write(request(1));
  ASSERT_TRUE(stream->Read(&message));
  EXPECT_TRUE(eventually([&] { return server_.server().state().admission.running() == 0; }, 5s));
  stream->WritesDone();
  EXPECT_FALSE(stream->Read(&message));
  EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(Preview, EndsWithItsClient) {
  {
    grpc::ClientContext context;
    const auto stream = server_.stub().Preview(&context);
    v1::PreviewRequest large = request(1);
    large.set_width(2048);
    large.set_height(2048);
    large.mutable_plane()->mutable_free()->set_across_mm_per_pixel(0.006);
    stream->Write(large);
    std::this_thread::sleep_for(5ms);
    context.TryCancel();
    v1::PreviewResponse message;
    while (stream->Read(&message)) {
    }
    EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
  }
  EXPECT_TRUE(eventually([&] { return server_.server().state().admission.running() == 0; }, 5s));
  EXPECT_EQ(shown({request(1)}).size(), 1u);
}

TEST_F(Preview, IsEndedByAServerThatStops) {
  grpc::ClientContext context;
  const auto stream = server_.stub().Preview(&context);
  v1::PreviewResponse message;
  stream->Write(request(1));
  ASSERT_TRUE(stream->Read(&message));
  std::thread stopping([&] { server_.stop(); });
  EXPECT_FALSE(stream->Read(&message));
  const grpc::Status status = stream->Finish();
  stopping.join();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE) << status.error_message();
}

}  // namespace
}  // namespace ccslice::server
