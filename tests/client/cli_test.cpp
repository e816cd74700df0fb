// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The pieces of the command line, one by one.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cerrno>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>

#include "client/cli/console.h"
#include "client/cli/failure.h"
#include "client/cli/folder_lock.h"
#include "client/cli/job.h"
#include "client/cli/json.h"
#include "client/cli/layer_folder.h"
#include "client/cli/mesh_convert.h"
#include "client/cli/mesh_source.h"
#include "client/cli/output_file.h"
#include "client/cli/placement.h"
#include "client/cli/text_values.h"
#include "client/cli/zip_file.h"
#include "client/client_error.h"
#include "client/mesh_bytes.h"
#include "core/base/error.h"
#include "core/mesh/models.h"
#include "tests/client/process.h"

namespace ccslice::cli {
namespace {

namespace fs = std::filesystem;
using client::read_whole;
using client::TemporaryFolder;
using testing::ElementsAre;
using testing::HasSubstr;

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

TEST(OutputFile, AppearsWholeOrNotAtAll) {
  const TemporaryFolder folder;
  write_file(folder.path() / "a", "first");
  EXPECT_EQ(read_whole(folder.path() / "a"), "first");
  EXPECT_THROW(write_file(folder.path() / "no" / "such" / "folder", "x"), Error);
  fs::create_directories(folder.path() / "taken" / "inside");
  EXPECT_THROW(write_file(folder.path() / "taken", "x"), Error);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 2)
      << "no temporary file stays";
}

TEST(OutputFile, IsNeverWrittenThroughALinkThatSomebodyPlanted) {
  const TemporaryFolder folder;
  write_file(folder.path() / "victim", "precious");
  for (const char* name : {".a.part", "a"}) fs::create_symlink("victim", folder.path() / name);
  write_file(folder.path() / "a", "mine");
  ZipFile(folder.path() / "a").finish();
  EXPECT_EQ(read_whole(folder.path() / "victim"), "precious");
  EXPECT_FALSE(fs::is_symlink(folder.path() / "a"));
  EXPECT_THROW(open_to_append(folder.path() / ".a.part"), Error);
}

TEST(OutputFile, TemporaryNamesTellWhatTheFileWasToBecome) {
  EXPECT_EQ(final_name_of_temporary(".layer_0001.png.0123abcd.part"), "layer_0001.png");
  for (const char* other : {"", ".part", ".0123abcd.part", "layer_0001.png", "layer_0001.png.0123abcd.part"}) {
    EXPECT_EQ(final_name_of_temporary(other), "") << other;
  }
  const TemporaryFolder folder;
  const NewFile unfinished(folder.path() / "a");
  EXPECT_EQ(final_name_of_temporary(fs::directory_iterator(folder.path())->path().filename().string()), "a");
}

TEST(OutputFile, IsRemovedByAProgramThatEndsOnTheSpot) {
  const TemporaryFolder folder;
  write_file(folder.path() / "whole", "kept");
  NewFile one(folder.path() / "a"), other(folder.path() / "b");
  one.write("half");
  remove_unfinished_files();
  EXPECT_THROW(one.finish(), Error);
  EXPECT_THAT(std::vector<fs::directory_entry>(fs::directory_iterator(folder.path()), {}),
              testing::ElementsAre(fs::directory_entry(folder.path() / "whole")));
}

client::Layer layer_of(std::uint32_t index, const std::vector<v1::PlaneSpec>& planes) {
  client::Layer layer;
  layer.index = index;
  for (const v1::PlaneSpec& spec : planes) layer.planes.push_back({spec, "bytes", "", {}});
  layer.contours.push_back({{0, 0, 1.5, 0, 0, 1}, {1, 1, 1}, {0, 0, 0, 0, 0, 0}});
  return layer;
}

TEST(LayerFolder, NamesFilesByLayerAndPlane) {
  const TemporaryFolder folder;
  const auto planes = parse_planes({.occupancy = true, .channels = {"a b:f32", "a_b", "../evil"}}, false);
  LayerFolder layers(folder.path() / "out", {planes, {ContourFormat::kCsv}, 123'456}, Existing::kRefuse, {"job", 50});
  layers.write(layer_of(42, planes));
  layers.finish({}, {});
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder.path() / "out")) names.push_back(entry.path().filename());
  EXPECT_THAT(names, testing::UnorderedElementsAre("layer_000042_occupancy.png", "layer_000042_a_b.zst",
                                                   "layer_000042_a_b_2.png", "layer_000042_.._evil.png",
                                                   "layer_000042_contours.csv", "manifest.json"));
  EXPECT_EQ(read_whole(folder.path() / "out" / "layer_000042_contours.csv"), "loop,x_mm,y_mm\n0,0,0\n0,1.5,0\n0,0,1\n");
}

TEST(LayerFiles, DrawContoursAsOnePathInMm) {
  client::Layer layer = layer_of(3, {});
  layer.z_mm = 0.35;
  layer.contours.push_back({{0.25, 0.25, 0.25, 0.5, 0.5, 0.25}, {}, {}});
  const LayerFiles files({}, {ContourFormat::kSvg, false, {-1, 0, 4, 2.5}}, 10);
  const std::vector<LayerFile> made = files.of(layer);
  ASSERT_EQ(made.size(), 1u);
  EXPECT_EQ(made[0].name, "layer_0003_contours.svg");
  EXPECT_EQ(made[0].bytes,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"4mm\" height=\"2.5mm\" viewBox=\"-1 -2.5 4 2.5\">\n"
            "<title>layer 3, z = 0.35 mm</title>\n"
            "<path fill-rule=\"evenodd\" d=\"M0,0L1.5,0L0,-1Z\nM0.25,-0.25L0.25,-0.5L0.5,-0.25Z\n\"/>\n</svg>\n");
  for (std::size_t i = 0; i < 2; ++i) layer.contours[i].cell_region = static_cast<std::uint32_t>(i + 1);
  EXPECT_THAT(LayerFiles({}, {ContourFormat::kSvg, true, {-1, 0, 4, 2.5}}, 10).of(layer)[0].bytes,
              testing::AllOf(HasSubstr("id=\"cell-region-1\""), HasSubstr("id=\"cell-region-2\"")));
}

TEST(LayerFiles, NameFacesAndParametersOfContoursAsJson) {
  const std::string text = LayerFiles({}, {ContourFormat::kJson}, 10).of(layer_of(3, {}))[0].bytes;
  EXPECT_THAT(text, HasSubstr("\"faces\":[[1,1,1]],\"parameters\":[[[0,0],[0,0],[0,0]]]"));
}

TEST(LayerFolder, RefusesToMixRuns) {
  const TemporaryFolder folder;
  const auto planes = parse_planes({}, false);
  const JobKey job{"job", 10};
  write_file(folder.path() / "notes.txt", "mine");
  { LayerFolder(folder.path(), {planes, {}, 10}, Existing::kRefuse, job).write(layer_of(3, planes)); }
  EXPECT_THROW(LayerFolder(folder.path(), {planes, {}, 10}, Existing::kRefuse, job), Error);
  { LayerFolder(folder.path(), {planes, {}, 10}, Existing::kReplace, job).write(layer_of(4, planes)); }
  EXPECT_FALSE(fs::exists(folder.path() / "layer_0003_occupancy.png"));
  EXPECT_TRUE(fs::exists(folder.path() / "layer_0004_occupancy.png"));
  EXPECT_TRUE(fs::exists(folder.path() / "notes.txt"));
}

TEST(LayerFolder, IsForOneJobAtATime) {
  const TemporaryFolder folder;
  const auto planes = parse_planes({}, false);
  const auto open = [&](Existing existing) { LayerFolder(folder.path(), {planes, {}, 10}, existing, {"job", 10}); };
  {
    LayerFolder first(folder.path(), {planes, {}, 10}, Existing::kRefuse, {"job", 10});
    first.write(layer_of(0, planes));
    for (const Existing existing : {Existing::kRefuse, Existing::kReplace, Existing::kResume}) {
      EXPECT_THROW(open(existing), Error);
      EXPECT_THROW(refuse_used_folder(folder.path(), existing), Error);
    }
    EXPECT_TRUE(fs::exists(folder.path() / "layer_0000_occupancy.png"));
  }
  EXPECT_FALSE(fs::exists(folder.path() / FolderLock::kName));
  write_file(folder.path() / FolderLock::kName, "");  // As a job that was killed leaves it.
  write_file(folder.path() / ".layer_0001_occupancy.png.0123abcd.part", "half");
  EXPECT_NO_THROW(refuse_used_folder(folder.path(), Existing::kResume));
  EXPECT_NO_THROW(open(Existing::kResume));
  EXPECT_FALSE(fs::exists(folder.path() / ".layer_0001_occupancy.png.0123abcd.part"));
}

TEST(FolderLock, SaysWhereItExcludesNobody) {
  const TemporaryFolder folder;
  const auto no_locks = [](int, int) {
    errno = ENOLCK;
    return -1;
  };
  {
    const FolderLock held(folder.path());
    EXPECT_TRUE(held.excludes_others());
    EXPECT_FALSE(FolderLock(folder.path(), no_locks).excludes_others());
  }
  EXPECT_FALSE(fs::exists(folder.path() / FolderLock::kName));
}

TEST(LayerFolder, GoesOnAfterTheLayersThatAreWhole) {
  const TemporaryFolder folder;
  const auto planes = parse_planes({}, false);
  const auto open = [&](const std::string& job, std::uint32_t layers) {
    return LayerFolder(folder.path(), {planes, {ContourFormat::kCsv}, 10}, Existing::kResume, {job, layers});
  };
  const auto finished = [&](std::uint32_t layers) { return open("job", layers).finished().layers; };
  EXPECT_EQ(finished(10), 0u) << "nothing is there yet";
  {
    LayerFolder layers = open("job", 10);
    for (std::uint32_t i = 0; i < 4; ++i) layers.write(layer_of(i, planes));
  }
  EXPECT_THROW(open("another", 10), Error);
  EXPECT_EQ(finished(10), 4u);
  EXPECT_EQ(finished(4), 3u) << "one layer is always sliced";
  EXPECT_EQ(finished(10), 3u) << "the journal was written anew";
  write_file(folder.path() / "layer_0002_occupancy.png", "bytez");
  EXPECT_EQ(finished(10), 2u) << "a file has changed";
  fs::remove(folder.path() / "layer_0000_contours.csv");
  EXPECT_EQ(finished(10), 0u) << "a file has gone";
}

TEST(LayerFolder, ManifestsOfInterruptedJobsAreTheSame) {
  const TemporaryFolder whole, parts;
  const auto planes = parse_planes({}, false);
  LayerFolder at_once(whole.path(), {planes, {ContourFormat::kJson}, 3}, Existing::kRefuse, {"job", 3});
  {
    LayerFolder(parts.path(), {planes, {ContourFormat::kJson}, 3}, Existing::kRefuse, {"job", 3})
        .write(layer_of(0, planes));
  }
  LayerFolder resumed(parts.path(), {planes, {ContourFormat::kJson}, 3}, Existing::kResume, {"job", 3});
  for (std::uint32_t i = 0; i < 3; ++i) at_once.write(layer_of(i, planes));
  for (std::uint32_t i = 1; i < 3; ++i) resumed.write(layer_of(i, planes));
  at_once.finish({}, {});
  resumed.finish({}, {});
  EXPECT_EQ(read_whole(whole.path() / "manifest.json"), read_whole(parts.path() / "manifest.json"));
  EXPECT_FALSE(fs::exists(parts.path() / "journal.jsonl"));
}

TEST(WriteFile, LeavesNothingWhereTheDiskIsFull) {
  const TemporaryFolder folder;
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{4096, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  std::string message;
  try {
    write_file(folder.path() / "layer.png", std::string(100'000, 'x'));
  } catch (const Error& error) {
    message = error.what();
    EXPECT_EQ(error.code(), ErrorCode::kFileUnwritable);
  }
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, old_handler);
  EXPECT_THAT(message, testing::HasSubstr("layer.png: File too large"));
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST(WriteFile, OnTheDiskIsWrittenAlike) {
  const TemporaryFolder folder;
  write_file_on_disk(folder.path() / "a", "first");
  EXPECT_EQ(read_whole(folder.path() / "a"), "first");
  EXPECT_NO_THROW(sync_folder(folder.path()));
  EXPECT_THROW(write_file_on_disk(folder.path() / "no" / "a", "x"), Error);
  EXPECT_THROW(sync_folder(folder.path() / "no"), Error);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 1);
}

TEST(ZipFile, OfMoreEntriesThan16BitsCountIsRead) {
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "many.zip";
  constexpr int kEntries = 66'000;
  ZipFile zip(path);
  for (int i = 0; i < kEntries; ++i) zip.add_stored("layer_" + std::to_string(i) + ".png", std::to_string(i));
  const std::uint64_t size = zip.finish();
  EXPECT_EQ(size, fs::file_size(path));
  const client::ProcessResult result =
      client::Process({"/usr/bin/python3", "-c",
                       "import sys, zipfile\n"
                       "archive = zipfile.ZipFile(sys.argv[1])\n"
                       "assert archive.testzip() is None\n"
                       "assert all(archive.read(f'layer_{i}.png') == b'%d' % i for i in range(66000))\n"
                       "print(len(archive.namelist()))",
                       path.string()},
                      folder.path())
          .wait();
  EXPECT_EQ(result.out, "66000\n") << result.err;
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
