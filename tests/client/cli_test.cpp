// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The pieces of the command line, one by one.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "client/cli/base/console.h"
#include "client/cli/base/failure.h"
#include "client/cli/base/json.h"
#include "client/cli/base/output_file.h"
#include "client/cli/base/text_values.h"
#include "client/cli/meshes/mesh_convert.h"
#include "client/cli/meshes/mesh_source.h"
#include "client/cli/options/job.h"
#include "client/cli/options/placement.h"
#include "client/client_error.h"
#include "client/mesh_bytes.h"
#include "core/base/error.h"
#include "core/models/models.h"
#include "tests/client/process.h"

namespace ccslice::cli {
namespace {

using client::TemporaryFolder;
using testing::ElementsAre;

TEST(Placement, ScalesThenRotatesThenMoves) {
  const v1::Placement placement = parse_placement({.scale = "2", .rotate = {"z=90"}, .translate = "10,20,-30"});
  EXPECT_THAT(placement.matrix(), ElementsAre(0, -2, 0, 10, 2, 0, 0, 20, 0, 0, 2, -30));
}

TEST(Placement, RotatesInTheOrderGivenAndExactlyByRightAngles) {
  EXPECT_THAT(parse_placement({.scale = "", .rotate = {"x=90", "z=-90"}, .translate = ""}).matrix(),
              ElementsAre(0, 0, -1, 0, -1, 0, 0, 0, 0, 1, 0, 0));
  EXPECT_THAT(parse_placement({.scale = "", .rotate = {"y=450", "y=270"}, .translate = ""}).matrix(),
              ElementsAre(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0));
  EXPECT_THAT(parse_placement({.scale = "1,1,-1", .rotate = {"x=180"}, .translate = ""}).matrix(),
              ElementsAre(1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0));
  for (const char* scale : {"0", "1e-320", "1,1,2e6", "1,-1e-7,1"}) {
    EXPECT_THROW(parse_placement({.scale = scale, .rotate = {}, .translate = ""}), UsageError) << scale;
  }
}

TEST(Placement, MistakesTeach) {
  for (const char* bad : {"90", "w=90", "x", "x=", "x=ninety", "xy=90"}) {
    EXPECT_THROW(parse_placement({.scale = "", .rotate = {bad}, .translate = ""}), UsageError) << bad;
  }
  EXPECT_THROW(parse_placement({.scale = "0", .rotate = {}, .translate = ""}), UsageError);
  EXPECT_THROW(parse_placement({.scale = "1,2", .rotate = {}, .translate = ""}), UsageError);
  EXPECT_THROW(parse_placement({.scale = "", .rotate = {}, .translate = "1,2"}), UsageError);
  EXPECT_THROW(parse_placement({.scale = "", .rotate = {}, .translate = "1,2,nan"}), UsageError);
}

TEST(Job, TakesPitchOrDpi) {
  EXPECT_EQ(parse_grid({.pitch = "0.5", .dpi = "", .origin = "", .extent = ""}).pitch().z_mm(), 0.5);
  EXPECT_EQ(parse_grid({.pitch = "1,2,3", .dpi = "", .origin = "", .extent = ""}).pitch().y_mm(), 2);
  const v1::GridSpec dpi =
      parse_grid({.pitch = "", .dpi = "600,300", .layer_height_mm = 0.027, .origin = "1,2,3", .extent = "4,5,6"});
  EXPECT_EQ(dpi.pitch().x_mm(), 25.4 / 600);
  EXPECT_EQ(dpi.pitch().y_mm(), 25.4 / 300);
  EXPECT_EQ(dpi.pitch().z_mm(), 0.027);
  EXPECT_EQ(dpi.origin_mm().z(), 3);
  EXPECT_EQ(dpi.extent().rows(), 5u);
  EXPECT_FALSE(parse_grid({.pitch = "1", .dpi = "", .origin = "", .extent = ""}).has_extent());
  EXPECT_THROW(parse_grid({}), UsageError);
  EXPECT_THROW(parse_grid({.pitch = "", .dpi = "600", .origin = "", .extent = ""}), UsageError);
  EXPECT_THROW(parse_grid({.pitch = "1,2", .dpi = "", .origin = "", .extent = ""}), UsageError);
  EXPECT_THROW(parse_grid({.pitch = "1", .dpi = "", .origin = "", .extent = "1,2,-3"}), UsageError);
}

TEST(Job, TakesARegionInMmOrVoxels) {
  EXPECT_FALSE(parse_region({}).has_value());
  GridOptions options;
  options.region = "1,2,3,4.5,5,-6";
  const v1::Region box = *parse_region(options);
  EXPECT_FALSE(box.has_voxels());
  EXPECT_EQ(box.box_mm().min_mm().y(), 2);
  EXPECT_EQ(box.box_mm().max_mm().x(), 4.5);
  EXPECT_EQ(box.box_mm().max_mm().z(), -6) << "whether it makes sense is for the server to say";
  for (const char* bad : {"1,2,3", "1,2,3,4,5,x", "1,2,3,4,5,6,7"}) {
    options.region = bad;
    EXPECT_THROW(parse_region(options), UsageError) << bad;
  }
  options.region.clear();
  options.region_voxels = "1,2,3,40,50,60";
  const v1::Region voxels = *parse_region(options);
  EXPECT_FALSE(voxels.has_box_mm());
  EXPECT_EQ(voxels.voxels().first_layer(), 3u);
  EXPECT_EQ(voxels.voxels().extent().rows(), 50u);
  options.region_voxels = "1,2,3,40,50";
  EXPECT_THROW(parse_region(options), UsageError);
}

TEST(Job, LaysOutPictures) {
  EXPECT_EQ(parse_layout({}).row_order(), v1::ROW_ORDER_ASCENDING_Y);
  const v1::PictureLayout layout = parse_layout({.row_order = "descending", .flip = "xy"});
  EXPECT_EQ(layout.row_order(), v1::ROW_ORDER_DESCENDING_Y);
  EXPECT_TRUE(layout.flip_x() && layout.flip_y());
  EXPECT_FALSE(parse_layout({.flip = "y"}).flip_x());
}

TEST(Job, NamesPlanes) {
  const auto planes = parse_planes({.occupancy = true, .channels = {"a", "b:u16", "c:d:f32", "e:u8:-1..2.5"}}, false);
  ASSERT_EQ(planes.size(), 5u);
  EXPECT_TRUE(planes[0].has_occupancy());
  EXPECT_EQ(planes[1].sample_type(), v1::SAMPLE_TYPE_UINT8);
  EXPECT_EQ(planes[1].encoding(), v1::PLANE_ENCODING_PNG);
  EXPECT_EQ(planes[2].channel().name(), "b");
  EXPECT_EQ(planes[2].sample_type(), v1::SAMPLE_TYPE_UINT16);
  EXPECT_EQ(planes[3].channel().name(), "c:d");
  EXPECT_EQ(planes[3].encoding(), v1::PLANE_ENCODING_RAW_ZSTD);
  EXPECT_EQ(planes[4].value_range().min(), -1);
  EXPECT_EQ(planes[4].value_range().max(), 2.5);
}

TEST(Job, SlicesTheOccupancyUnlessTold) {
  EXPECT_TRUE(parse_planes({}, false).at(0).has_occupancy());
  EXPECT_TRUE(parse_planes({}, true).empty());
  EXPECT_EQ(parse_planes({.channels = {"a"}}, false).size(), 1u);
  EXPECT_THROW(parse_planes({.channels = {"a:f32"}, .encoding = "png"}, false), UsageError);
  EXPECT_THROW(parse_planes({.channels = {""}}, false), UsageError);
  EXPECT_THROW(parse_planes({.channels = {"a:u8:1..1"}}, false), UsageError);
  EXPECT_THROW(parse_planes({.channels = {"a:u8:1"}}, false), UsageError);
}

TEST(TextValues, LayerRangesIncludeBothEnds) {
  EXPECT_EQ(parse_layer_range("--layers", "3..5").last, 5u);
  EXPECT_EQ(parse_layer_range("--layers", "7").first, 7u);
  for (const char* bad : {"", "..", "5..3", "1..", "-1..3", "a..b", "1...3"}) {
    EXPECT_THROW(parse_layer_range("--layers", bad), UsageError) << bad;
  }
}

TEST(Json, EscapesAndKeepsDigits) {
  JsonWriter json;
  json.begin_object()
      .member("a\"\\\n",
              "gr\xc3\xb6\xc3\x9f"
              "e")
      .key("n")
      .begin_array();
  json.value(0.1).value(1e300 * 1e10).value(18446744073709551615ull).value(true).value("\xff").end_array().end_object();
  EXPECT_EQ(json.text(),
            "{\"a\\\"\\\\\\u000a\":\"gr\xc3\xb6\xc3\x9f"
            "e\",\"n\":[0.1,null,18446744073709551615,true,\"?\"]}");
}

TEST(Console, ShowsNumbersForPeople) {
  EXPECT_EQ(show_bytes(999), "999 B");
  EXPECT_EQ(show_bytes(999'950), "1.0 MB");
  EXPECT_EQ(show_count(507012345), "507,012,345");
  EXPECT_EQ(show_count(12), "12");
  EXPECT_EQ(show_count(1, "layer"), "1 layer");
  EXPECT_EQ(show_count(0, "layer"), "0 layers");
  EXPECT_EQ(show_count(1234, "layer"), "1,234 layers");
  EXPECT_EQ(show_count(1234, "vertex"), "1,234 vertices");
  EXPECT_EQ(show_duration(0.34), "0.3 s");
  EXPECT_EQ(show_duration(200), "3 min 20 s");
  EXPECT_EQ(show_duration(7500), "2 h 5 min");
}

TEST(Console, ShowsPlacesToTheDigitsOfTheSize) {
  EXPECT_EQ(show_box({-8.1e-7, 3.1e-6, 0}, {46.107, 46.2762, 20.64}), "46.107 x 46.2762 x 20.64 mm, from (0, 0, 0)");
  EXPECT_EQ(show_box({-8.1e-7, 1e-4, 2}, {46.107, 46.2763, 20.64}), "46.107 x 46.2762 x 18.64 mm, from (0, 0.0001, 2)");
  EXPECT_EQ(show_box({3.1e-6, 0, 0}, {4.1e-6, 1e-6, 1e-6}), "1e-06 x 1e-06 x 1e-06 mm, from (3.1e-06, 0, 0)");
}

TEST(Console, EstimatesOfTheTimeLeftWaitUntilTheyMeanSomething) {
  EXPECT_EQ(seconds_left(10, 100, 2.9), std::nullopt) << "too early";
  EXPECT_EQ(seconds_left(4, 100, 29), std::nullopt) << "too few";
  EXPECT_EQ(seconds_left(0, 100, 1000), std::nullopt) << "nothing to go by";
  EXPECT_EQ(seconds_left(100, 100, 10), std::nullopt) << "nothing left";
  EXPECT_DOUBLE_EQ(*seconds_left(10, 100, 3), 27);
  EXPECT_DOUBLE_EQ(*seconds_left(1, 100, 30), 2970) << "slow, but told at last";
}

TEST(MeshConvert, IsLossless) {
  ControlMesh mesh = make_ring();
  mesh.sharp_vertices = {3};
  mesh.allow_folds = true;
  const v1::ControlMesh message = to_proto(mesh);
  const ControlMesh back = from_proto(message);
  EXPECT_EQ(client::MeshBytes(to_proto(back)).id(), client::MeshBytes(message).id());
  EXPECT_EQ(back.positions, mesh.positions);
  EXPECT_EQ(back.channel_values, mesh.channel_values);
  EXPECT_EQ(back.sharp_edges, mesh.sharp_edges);
}

TEST(MeshConvert, RefusesArraysThatFitNoMesh) {
  v1::ControlMesh message = to_proto(make_box());
  message.add_positions_mm(1);
  EXPECT_THROW(from_proto(message), Error);
  message = to_proto(make_box());
  message.add_cell_kinds(v1::CELL_KIND_PYRAMID);
  EXPECT_THROW(from_proto(message), Error);
}

TEST(MeshSource, ACcmeshKeepsItsIdUnlessItIsChanged) {
  const TemporaryFolder folder;
  const std::string path = (folder.path() / "box.ccmesh").string();
  const client::MeshBytes box(to_proto(make_box()));
  write_file(path, box.bytes());
  EXPECT_EQ(load_mesh({.mesh = path}).bytes->id(), box.id());
  const LoadedMesh graded = load_mesh({.mesh = path, .grades = {"other=z"}});
  EXPECT_NE(graded.bytes->id(), box.id());
  EXPECT_EQ(graded.bytes->id(), load_mesh({.mesh = path, .grades = {"other=z"}}).bytes->id());
  EXPECT_NE(load_mesh({.mesh = path, .grades = {}, .allow_folds = true}).bytes->id(), box.id());
}

TEST(MeshSource, HostileCcmeshesAreRefusedBeforeTheyAreGraded) {
  const TemporaryFolder folder;
  const std::string path = (folder.path() / "bad.ccmesh").string();
  v1::ControlMesh message = to_proto(make_box());
  message.mutable_channel_values()->Truncate(3);
  write_file(path, message.SerializeAsString());
  EXPECT_THROW(load_mesh({.mesh = path, .grades = {"other=z"}}), Error);
  message = to_proto(make_box());
  message.set_cell_vertices(7, 4'000'000'000u);
  write_file(path, message.SerializeAsString());
  EXPECT_THROW(load_mesh({.mesh = path, .grades = {"other=z"}}), Error);
}

TEST(Failure, ExitCodesSayWhoseFaultItIs) {
  using client::ClientError;
  using grpc::StatusCode;
  EXPECT_EQ(failure_of(UsageError("x")).exit_code, kExitUsage);
  EXPECT_EQ(failure_of(Error(ErrorCode::kFileSyntax, "x")).exit_code, kExitInput);
  EXPECT_EQ(failure_of(Error(ErrorCode::kMeshNonFinite, "x")).exit_code, kExitInput);
  EXPECT_EQ(failure_of(Error(ErrorCode::kFileUnwritable, "x")).exit_code, kExitOutput);
  EXPECT_EQ(failure_of(ClientError(StatusCode::INVALID_ARGUMENT, "MESH_NON_FINITE", "x")).exit_code, kExitInput);
  EXPECT_EQ(failure_of(ClientError(StatusCode::INVALID_ARGUMENT, "MESH_ID_INVALID", "x")).exit_code, kExitRefused);
  EXPECT_EQ(failure_of(ClientError(StatusCode::INVALID_ARGUMENT, "PITCH_INVALID", "x")).exit_code, kExitUsage);
  EXPECT_EQ(failure_of(ClientError(StatusCode::INVALID_ARGUMENT, "MATERIAL_UNKNOWN", "x")).exit_code, kExitUsage);
  EXPECT_EQ(failure_of(ClientError(StatusCode::INVALID_ARGUMENT, "CHANNEL_UNKNOWN", "x")).exit_code, kExitRefused)
      << "the mesh decides";
  EXPECT_EQ(failure_of(ClientError(StatusCode::UNAVAILABLE, "", "x")).exit_code, kExitUnreachable);
  EXPECT_EQ(failure_of(ClientError(StatusCode::DEADLINE_EXCEEDED, "", "x")).exit_code, kExitUnreachable);
  EXPECT_EQ(failure_of(ClientError(StatusCode::CANCELLED, client::local_reason::kCancelledHere, "x")).exit_code,
            kExitInterrupted);
  EXPECT_EQ(failure_of(ClientError(StatusCode::ABORTED, client::local_reason::kEngineMixed, "x")).exit_code,
            kExitMismatch);
  EXPECT_EQ(failure_of(std::runtime_error("x")).exit_code, kExitBug);
}

}  // namespace
}  // namespace ccslice::cli
