// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Folders of layers and packages of them, as the ccslice program writes them.

#include "tests/client/command_line.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <fstream>
#include <regex>
#include <string>
#include <thread>
#include <vector>

#include "client/cli/base/exit_codes.h"
#include "tests/client/fake_slicer.h"

namespace ccslice::client {
namespace {

using google::protobuf::Struct;
using google::protobuf::Value;
using testing::HasSubstr;

TEST_F(CommandLine, SlicesIntoAFolder) {
  const ProcessResult result =
      run({"slice", box_, "--pitch", "0.5", "--occupancy", "--channel", "gradient:f32", "--channel", "gradient:u16",
           "--encoding", "zstd", "--contours", "json", "--layers", "3..6", "-o", path("out"), "--json"});
  ASSERT_EQ(result.exit_code, cli::kExitOk) << result.err;
  EXPECT_EQ(json_at(result.out, "voxel_count").number_value(), 4 * 48 * 32);
  EXPECT_EQ(files_in("out"), 4u * 4 + 2);
  const std::string manifest = read_whole(path("out/manifest.json"));
  EXPECT_EQ(json_at(manifest, "grid.columns").number_value(), 48);
  EXPECT_EQ(json_at(manifest, "layers").list_value().values_size(), 4);
  EXPECT_EQ(json_at(read_whole(path("out/layer_0004_contours.json")), "layer").number_value(), 4);
}

TEST_F(CommandLine, WritesPicturesAndRawSamples) {
  ASSERT_EQ(run({"slice", box_, "--pitch", "1", "--layers", "0", "-o", path("png")}).exit_code, cli::kExitOk);
  EXPECT_THAT(read_whole(path("png/layer_0000_occupancy.png")), HasSubstr("PNG"));
  ASSERT_EQ(run({"slice", box_, "--pitch", "1", "--layers", "0", "--encoding", "raw", "--channel", "gradient:u16", "-o",
                 path("raw")})
                .exit_code,
            cli::kExitOk);
  EXPECT_EQ(fs::file_size(path("raw/layer_0000_gradient.bin")), 2u * 24 * 16);
}

TEST_F(CommandLine, WritesTiffAndOneExrOfAllChannels) {
  const ProcessResult tiff = run({"slice", box_, "--pitch", "1", "--layers", "0", "--encoding", "tiff", "--occupancy",
                                  "--channel", "gradient:f32", "-o", path("tiff")});
  ASSERT_EQ(tiff.exit_code, cli::kExitOk) << tiff.err;
  EXPECT_TRUE(fs::exists(path("tiff/layer_0000_occupancy.tif")));
  EXPECT_TRUE(fs::exists(path("tiff/layer_0000_gradient.tif")));
  const ProcessResult exr = run({"slice", box_, "--grade", "height=z", "--pitch", "1", "--layers", "0", "--occupancy",
                                 "--all-channels", "-o", path("exr")});
  ASSERT_EQ(exr.exit_code, cli::kExitOk) << exr.err;
  EXPECT_TRUE(fs::exists(path("exr/layer_0000_occupancy.png")));
  const std::string picture = read_whole(path("exr/layer_0000_channels.exr"));
  EXPECT_THAT(picture, HasSubstr("gradient"));
  EXPECT_THAT(picture, HasSubstr("height"));
  EXPECT_THAT(read_whole(path("exr/manifest.json")), HasSubstr(R"("channels":["gradient","height"])"));
}

TEST_F(CommandLine, PutsAContactSheetBesideTheLayers) {
  const std::vector<std::string> slice = {"slice", box_, "--pitch", "0.25", "--channel", "gradient", "-o", path("out")};
  const ProcessResult result = run(slice);
  ASSERT_EQ(result.exit_code, cli::kExitOk) << result.err;
  EXPECT_THAT(result.out, HasSubstr("contact sheet: " + path("out/contact_sheet.png")));
  EXPECT_THAT(read_whole(path("out/contact_sheet.png")), testing::StartsWith("\x89PNG"));
  EXPECT_EQ(files_in("out"), 32u + 2);
  std::vector<std::string> without = slice;
  without.insert(without.end(), {"--force", "--no-contact-sheet", "--json"});
  const ProcessResult second = run(without);
  ASSERT_EQ(second.exit_code, cli::kExitOk) << second.err;
  EXPECT_THAT(second.out, testing::Not(HasSubstr("contact_sheet")));
  EXPECT_EQ(files_in("out"), 32u + 1) << "the old sheet is gone with the old layers";
}

TEST_F(CommandLine, RefusesToOverwriteUnlessForced) {
  const std::vector<std::string> slice = {"slice", box_, "--pitch", "1", "--layers", "0", "-o", path("out")};
  ASSERT_EQ(run(slice).exit_code, cli::kExitOk);
  const ProcessResult second = run(slice);
  EXPECT_EQ(second.exit_code, cli::kExitOutput);
  EXPECT_THAT(second.err, HasSubstr("--force"));
  std::vector<std::string> forced = slice;
  forced.push_back("--force");
  EXPECT_EQ(run(forced).exit_code, cli::kExitOk);
  EXPECT_EQ(run_alone({"models", "box", "-o", box_}).exit_code, cli::kExitOutput);
  EXPECT_EQ(run({"slice", box_, "--pitch", "1", "-o", "/proc/nowhere"}).exit_code, cli::kExitOutput);
}

TEST_F(CommandLine, CtrlCLeavesNothingThatLooksComplete) {
  FakeSlicer fake;
  fake.before_layer = [](std::uint32_t layer, grpc::ServerContext& context) {
    while (layer == 3 && !context.IsCancelled()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return grpc::Status::OK;
  };
  const auto process = start({"slice", box_, "--pitch", "1", "--encoding", "zstd", "-o", path("out")}, fake.address());
  while (!fs::exists(path("out/layer_0002_occupancy.zst"))) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  const auto begin = std::chrono::steady_clock::now();
  process->send_signal(SIGINT);
  const ProcessResult result = process->wait();
  EXPECT_EQ(result.exit_code, cli::kExitInterrupted);
  EXPECT_THAT(result.err, HasSubstr("3 of 20 layers"));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(2));
  EXPECT_EQ(files_in("out"), 3u + 1) << "three whole layers and their journal";
  EXPECT_FALSE(fs::exists(path("out/manifest.json")));
}

TEST_F(CommandLine, TwoJobsInOneFolderExcludeEachOther) {
  FakeSlicer fake;
  std::atomic<bool> go_on = false;
  fake.before_layer = [&](std::uint32_t layer, grpc::ServerContext& context) {
    while (layer == 3 && !go_on && !context.IsCancelled()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return grpc::Status::OK;
  };
  const std::vector<std::string> slice = {"slice", box_, "--pitch", "1", "--encoding", "zstd", "-o", path("out")};
  const auto first = start(slice, fake.address());
  while (!fs::exists(path("out/layer_0002_occupancy.zst"))) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  for (const char* choice : {"--force", "--resume", "--quiet"}) {
    std::vector<std::string> command = slice;
    command.emplace_back(choice);
    const ProcessResult second = start(command, fake.address())->wait();
    EXPECT_EQ(second.exit_code, cli::kExitOutput) << choice;
    EXPECT_THAT(second.err, testing::AllOf(HasSubstr("another job is writing to " + path("out")),
                                           HasSubstr("take another folder")));
  }
  go_on = true;
  const ProcessResult result = first->wait();
  EXPECT_EQ(result.exit_code, cli::kExitOk) << result.err;
}

TEST_F(CommandLine, AnInterruptedJobGoesOnAndEndsWithTheSameBytes) {
  FakeSlicer fake;
  const auto slice = [&](const char* folder, std::vector<std::string> more) {
    std::vector<std::string> command = {"slice", box_, "--pitch", "1", "--encoding", "zstd", "-o", path(folder)};
    command.insert(command.end(), {"--no-contact-sheet", "--attempts", "1"});
    command.insert(command.end(), more.begin(), more.end());
    return start(command, fake.address())->wait();
  };
  EXPECT_EQ(slice("whole", {}).exit_code, cli::kExitOk);
  fake.before_layer = [](std::uint32_t layer, grpc::ServerContext&) {
    return layer < 7 ? grpc::Status::OK : grpc::Status(grpc::StatusCode::UNAVAILABLE, "gone");
  };
  EXPECT_THAT(slice("out", {}).err, HasSubstr("--resume goes on with it"));
  EXPECT_FALSE(fs::exists(path("out/manifest.json")));
  // A line that is there twice doesn't stand for a layer.
  const std::string journal = read_whole(path("out/journal.jsonl"));
  const std::size_t second = journal.find('\n') + 1, third = journal.find('\n', second) + 1;
  cli::write_file(path("out/journal.jsonl"), journal.substr(0, third) + journal.substr(second));
  fake.before_layer = {};
  const ProcessResult refused = slice("out", {});
  EXPECT_EQ(refused.exit_code, cli::kExitOutput);
  EXPECT_THAT(refused.err, HasSubstr("--resume to go on"));
  EXPECT_THAT(slice("out", {"--resume", "--layers", "0..9"}).err, HasSubstr("layers of another job"));
  const ProcessResult resumed = slice("out", {"--resume"});
  EXPECT_EQ(resumed.exit_code, cli::kExitOk) << resumed.err;
  ASSERT_EQ(files_in("out"), files_in("whole"));
  for (const auto& file : fs::directory_iterator(path("whole"))) {
    EXPECT_EQ(read_whole(file.path()), read_whole(path("out") + "/" + file.path().filename().string())) << file.path();
  }
  const ProcessResult again = slice("out", {"--resume"});
  EXPECT_EQ(again.exit_code, cli::kExitOk);
  EXPECT_THAT(again.err, HasSubstr("nothing is left to do"));
  EXPECT_EQ(json_at(slice("out", {"--resume", "--json"}).out, "written_bytes").number_value(), 0);
  const ProcessResult other = slice("out", {"--resume", "--layers", "0..9"});
  EXPECT_EQ(other.exit_code, cli::kExitOutput);
  EXPECT_THAT(other.err, HasSubstr("another job"));
  const std::string manifest = read_whole(path("out/manifest.json"));
  const std::regex files_of_3(R"("planes":\[\{"file":"layer_0003[^\]]*\])");
  cli::write_file(path("out/manifest.json"), std::regex_replace(manifest, files_of_3, R"("planes":[])"));
  EXPECT_THAT(slice("out", {"--resume"}).err, HasSubstr("have changed")) << "it lacks files";
  cli::write_file(path("out/manifest.json"), manifest);
  cli::write_file(path("out/layer_0003_occupancy.zst"), "damaged");
  const ProcessResult damaged = slice("out", {"--resume"});
  EXPECT_EQ(damaged.exit_code, cli::kExitOutput);
  EXPECT_THAT(damaged.err, HasSubstr("have changed"));
}

TEST_F(CommandLine, AnInterruptedJobGoesOnInItsOwnFormatOnly) {
  FakeSlicer fake;
  fake.before_layer = [](std::uint32_t layer, grpc::ServerContext&) {
    return layer < 2 ? grpc::Status::OK : grpc::Status(grpc::StatusCode::UNAVAILABLE, "gone");
  };
  const auto slice = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"slice", box_, "--pitch", "1", "--attempts", "1", "-o", path("out")});
    return start(more, fake.address())->wait();
  };
  EXPECT_THAT(slice({"--contours", "json"}).err, HasSubstr("--resume goes on with it"));
  EXPECT_THAT(slice({"--contours", "csv", "--resume"}).err, HasSubstr("layers of another job"));
}

TEST_F(CommandLine, PacksLayersAsVolumetric3mf) {
  EXPECT_EQ(run({"slice", box_, "--pitch", "1", "--channel", "gradient", "-o", path("out")}).exit_code, cli::kExitOk);
  const ProcessResult packed = run({"package", path("out"), "-o", path("box.3mf"), "--json"});
  ASSERT_EQ(packed.exit_code, cli::kExitOk) << packed.err;
  EXPECT_EQ(json_at(packed.out, "size_bytes").number_value(), static_cast<double>(fs::file_size(path("box.3mf"))));
  const std::string bytes = read_whole(path("box.3mf"));
  EXPECT_EQ(run({"package", path("out"), "-o", path("box.3mf")}).exit_code, cli::kExitOutput) << "it is there already";
  {
    const server::Server empty(local_server_options());
    const auto pack_there = [&](std::vector<std::string> more) {
      more.insert(more.begin(), {"package", path("out"), "-o", path("there.3mf"), "--force"});
      return start(more, empty.address())->wait();
    };
    const ProcessResult missing = pack_there({});
    EXPECT_EQ(missing.exit_code, cli::kExitUsage);
    EXPECT_THAT(missing.err, HasSubstr("--mesh"));
    EXPECT_EQ(pack_there({"--mesh", box_}).exit_code, cli::kExitOk);
    EXPECT_EQ(read_whole(path("there.3mf")), bytes);
  }
  EXPECT_EQ(run({"package", path("out"), "-o", path("box.3mf"), "--force"}).exit_code, cli::kExitOk);
  EXPECT_EQ(read_whole(path("box.3mf")), bytes);
  const ProcessResult checked =
      Process({"/usr/bin/python3", CCSLICE_CHECK_STACK, path("out"), path("box.3mf")}, folder_.path()).wait();
  EXPECT_EQ(checked.exit_code, 0) << checked.out << checked.err;

  EXPECT_EQ(
      run({"slice", box_, "--pitch", "1", "--channel", "gradient", "--layers", "0..3", "-o", path("some")}).exit_code,
      cli::kExitOk);
  EXPECT_THAT(run({"package", path("some"), "-o", path("some.3mf")}).err, HasSubstr("and --layers"));

  EXPECT_THAT(run({"package", path("out"), "-o", path("box.gcvf")}).err, HasSubstr("--encoding png-rgba"));
  EXPECT_EQ(run({"package", path("out"), "-o", path("box.zip")}).exit_code, cli::kExitUsage);
  EXPECT_EQ(run({"package", path(""), "-o", path("none.3mf")}).exit_code, cli::kExitInput);
  std::ofstream(path("out/layer_0003_gradient.png"), std::ios::app) << "x";
  EXPECT_THAT(run({"package", path("out"), "-o", path("changed.3mf")}).err, HasSubstr("has changed since"));
  EXPECT_FALSE(fs::exists(path("changed.3mf")));
}

TEST_F(CommandLine, PacksMaterialsAsGcvf) {
  for (const char* encoding : {"png-rgba", "png"}) {
    const std::string folder = path(encoding);
    const ProcessResult sliced =
        run({"slice", box_, "--dpi", "50,40", "--layer-height", "0.5", "--material", "soft & <clear>=#00ffff",
             "--material", "stiff=#ff00ff", "--map", "blend:gradient:0=soft & <clear>,1=stiff", "--masks", "--encoding",
             encoding, "-o", folder});
    ASSERT_EQ(sliced.exit_code, cli::kExitOk) << sliced.err;
    EXPECT_EQ(json_at(read_whole(folder + "/manifest.json"), "materials").list_value().values_size(), 2);
  }
  ASSERT_EQ(run({"package", path("png-rgba"), "-o", path("box.gcvf")}).exit_code, cli::kExitOk);
  for (const std::vector<std::string>& checked :
       {std::vector<std::string>{path("png-rgba"), path("box.gcvf")}, {path("png")}}) {
    std::vector<std::string> command = {"/usr/bin/python3", CCSLICE_CHECK_STACK};
    command.insert(command.end(), checked.begin(), checked.end());
    const ProcessResult result = Process(command, folder_.path()).wait();
    EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  }
}

// The channel runs from 0 to 1.
TEST_F(CommandLine, SaysWhichMaterialsAreNotPrinted) {
  const auto slice = [&](const std::string& map, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"slice",     box_,         "--pitch",   "1",          "--material",
                                          "a=#ff0000", "--material", "b=#0000ff", "--material", "c=#00ff00",
                                          "--map",     map,          "-o",        path("out"),  "--force"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProcessResult result = run(arguments);
    EXPECT_EQ(result.exit_code, cli::kExitOk) << result.err;
    return result.err;
  };
  const std::string one = slice("blend:gradient:30=a,90=b");
  EXPECT_THAT(one, HasSubstr("channel 'gradient' runs from 0 to 1, and the material map covers 30 to 90: about 100 %"));
  EXPECT_THAT(one, HasSubstr("materials b, c came out nowhere: all voxels are of a;"));
  EXPECT_THAT(slice("blend:gradient:0=a,1=b"), HasSubstr("material c came out nowhere; if that isn't meant"));
  EXPECT_EQ(slice("blend:gradient:0=a,0.5=b,1=c"), "");
  EXPECT_EQ(slice("blend:gradient:0=a,1=b", {"--quiet"}), "");
  EXPECT_EQ(slice("blend:gradient:0=a,1=b", {"--layers", "0..1"}), "");
}

// The channel runs from 0 to 1.
TEST_F(CommandLine, CountsVoxelsThatTheMapDoesNotTakeAsTheyAre) {
  const auto slice = [&](const std::string& map, const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"slice",      box_,        "--pitch", "1", "--material", "a=#ff0000",
                                          "--material", "b=#0000ff", "--map",   map, "-o",         path("counted"),
                                          "--force"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(arguments);
  };
  const ProcessResult direct = slice("direct:gradient=b", {});
  EXPECT_THAT(direct.err,
              testing::AllOf(HasSubstr("the fractions of the material map add up to less than 1, down to"),
                             testing::ContainsRegex("warning: [0-9,]+ of [0-9,]+ voxels \\([0-9.]+ %\\) have "
                                                    "fractions that add up to less than 1, the least to 0"),
                             HasSubstr("rest=NAME")));
  const std::string manifest = read_whole(path("counted") + "/manifest.json");
  const double scaled_up = json_at(manifest, "voxels_scaled_up").number_value();
  EXPECT_GT(scaled_up, 0.9 * json_at(manifest, "voxel_count").number_value());
  EXPECT_LT(json_at(manifest, "least_fraction_sum").number_value(), 0.1);
  double sum = 0;
  const Value layers = json_at(manifest, "layers");
  for (const Value& layer : layers.list_value().values()) {
    sum += layer.struct_value().fields().at("voxels_scaled_up").number_value();
  }
  EXPECT_EQ(sum, scaled_up);
  const std::string off = slice("blend:gradient:0=a,0.5=b", {"--json"}).out;
  EXPECT_NEAR(json_at(off, "voxels_off_map").number_value() / json_at(off, "voxel_count").number_value(), 0.5, 0.05);
  EXPECT_EQ(json_at(off, "voxels_scaled_up").number_value(), 0);
  EXPECT_THAT(slice("direct:gradient=b,rest=a", {}).err, testing::Not(HasSubstr("warning")));
}

TEST_F(CommandLine, RefusesToPackWhatAGcvfFileCannotSay) {
  const auto packed = [&](const std::string& name, const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"slice",      box_,       "--layers", "0..1",
                                          "--encoding", "png-rgba", "-o",       path(name)};
    arguments.insert(arguments.end(), more.begin(), more.end());
    EXPECT_EQ(run(arguments).exit_code, cli::kExitOk) << name;
    const ProcessResult result = run({"package", path(name), "-o", path(name + ".gcvf")});
    EXPECT_EQ(fs::exists(path(name + ".gcvf")), result.exit_code == cli::kExitOk) << name;
    return result;
  };
  const std::vector<std::string> dpi = {"--dpi", "50", "--layer-height", "0.5"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.end(), dpi.begin(), dpi.end());
    return more;
  };
  EXPECT_THAT(packed("pitch", {"--pitch", "0.7", "--material", "a=#ff0000"}).err, HasSubstr("whole dots an inch"));
  EXPECT_THAT(packed("back", with({"--material", "a=#ff0000", "--background", "#101010"})).err,
              HasSubstr("background"));
  EXPECT_THAT(packed("clear", with({"--material", "a=#ff000080"})).err, HasSubstr("opaque colours only"));
  std::vector<std::string> seven = {"--map", "blend:gradient:0=m0,1=m6"};
  for (int m = 0; m < 7; ++m) {
    seven.insert(seven.end(), {"--material", "m" + std::to_string(m) + "=#0000f" + std::to_string(m)});
  }
  EXPECT_THAT(packed("seven", with(seven)).err, HasSubstr("at most 6 materials, and there are 7"));
  const ProcessResult few = packed("few", with({"--material", "a=#ff0000"}));
  EXPECT_EQ(few.exit_code, cli::kExitOk);
  EXPECT_THAT(few.err, HasSubstr("no fewer than 30 layers, and there are 2"));
}

TEST_F(CommandLine, SlicesARegionWithItsRowsTurned) {
  const std::vector<std::string> job = {"slice",          box_,        "--dpi",      "50",
                                        "--layer-height", "0.5",       "--material", "a=#ff0000",
                                        "--material",     "b=#0000ff", "--map",      "blend:gradient:0=a,1=b"};
  const auto slice = [&](const std::string& folder, const std::vector<std::string>& more) {
    std::vector<std::string> arguments = job;
    arguments.insert(arguments.end(), more.begin(), more.end());
    arguments.insert(arguments.end(), {"-o", path(folder)});
    return run(arguments);
  };
  const ProcessResult sliced = slice(
      "part", {"--box-voxels", "2,1,3,5,4,2", "--row-order", "descending", "--flip", "x", "--encoding", "png-rgba"});
  ASSERT_EQ(sliced.exit_code, cli::kExitOk) << sliced.err;
  const std::string manifest = read_whole(path("part/manifest.json"));
  EXPECT_EQ(json_at(manifest, "region.first_row").number_value(), 1);
  EXPECT_EQ(json_at(manifest, "region.layers").number_value(), 2);
  EXPECT_EQ(json_at(manifest, "layout.row_order").string_value(), "descending");
  EXPECT_TRUE(json_at(manifest, "layout.flip_x").bool_value());
  EXPECT_TRUE(fs::exists(path("part/layer_0003_materials.png")));
  EXPECT_EQ(files_in("part"), 2u + 2) << "two layers, the contact sheet and manifest.json";
  ASSERT_EQ(run({"package", path("part"), "-o", path("part.gcvf")}).exit_code, cli::kExitOk);
  const ProcessResult checked =
      Process({"/usr/bin/python3", CCSLICE_CHECK_STACK, path("part"), path("part.gcvf")}, folder_.path()).wait();
  EXPECT_EQ(checked.exit_code, 0) << checked.out << checked.err;
  const ProcessResult packed = run({"package", path("part"), "-o", path("part.3mf")});
  EXPECT_NE(packed.exit_code, cli::kExitOk);
  EXPECT_THAT(packed.err, HasSubstr("without --box"));

  EXPECT_THAT(slice("out", {"--box-voxels", "2,1,3,5,4,2", "--layers", "5"}).err, HasSubstr("layers 3 to 4"));
  EXPECT_THAT(slice("out", {"--box", "0,0,0,1,1,nan"}).err, HasSubstr("--box"));
  EXPECT_THAT(slice("out", {"--box", "900,0,0,901,1,1"}).err, HasSubstr("outside of the grid"));
  EXPECT_EQ(slice("out", {"--box", "0,0,0,1,1,1", "--box-voxels", "0,0,0,1,1,1"}).exit_code, cli::kExitUsage);
  EXPECT_FALSE(fs::exists(path("out")));
}

TEST_F(CommandLine, PacksTurnedPicturesAs3mfWithTheirAxes) {
  ASSERT_EQ(run({"slice", box_, "--pitch", "1", "--channel", "gradient", "--flip", "xy", "-o", path("out")}).exit_code,
            cli::kExitOk);
  ASSERT_EQ(run({"package", path("out"), "-o", path("box.3mf")}).exit_code, cli::kExitOk);
  const ProcessResult checked =
      Process({"/usr/bin/python3", CCSLICE_CHECK_STACK, path("out"), path("box.3mf")}, folder_.path()).wait();
  EXPECT_EQ(checked.exit_code, 0) << checked.out << checked.err;
}

TEST_F(CommandLine, WhatCannotBeWrittenIsAnOutputError) {
  const std::vector<std::string> job = {"slice", box_, "--pitch", "0.1", "--encoding", "raw", "-o"};
  const auto slice_into = [&](const std::string& folder) {
    std::vector<std::string> arguments = job;
    arguments.push_back(folder);
    return run(arguments);
  };
  const ProcessResult unwritable = slice_into("/proc/ccslice");
  EXPECT_EQ(unwritable.exit_code, cli::kExitOutput) << unwritable.err;
  EXPECT_THAT(unwritable.err, HasSubstr("cannot make the folder /proc/ccslice"));
  cli::write_file(path("file"), "mine");
  const ProcessResult file = slice_into(path("file"));
  EXPECT_EQ(file.exit_code, cli::kExitOutput);
  EXPECT_THAT(file.err, HasSubstr("/file: Not a directory; name a folder that is new or empty"));
  EXPECT_EQ(read_whole(path("file")), "mine");

  std::vector<std::string> limited = {"/bin/bash", "-c", "trap '' XFSZ; ulimit -f 1; exec \"$0\" \"$@\"",
                                      CCSLICE_BINARY};
  limited.insert(limited.end(), job.begin(), job.end());
  limited.insert(limited.end(), {path("full"), "--server=" + server_->address()});
  const ProcessResult full = Process(limited, folder_.path()).wait();
  EXPECT_EQ(full.exit_code, cli::kExitOutput) << full.err;
  EXPECT_THAT(full.err, HasSubstr("File too large"));
  EXPECT_FALSE(fs::exists(path("full/manifest.json")));
  for (const auto& entry : fs::directory_iterator(path("full"))) {
    EXPECT_NE(entry.path().extension(), ".part") << "half of a file";
  }
}

TEST_F(CommandLine, AJobDoesNotFailForItsContactSheet) {
  FakeSlicer fake;
  int layers = 0;
  fake.before_layer = [&](std::uint32_t, grpc::ServerContext&) {
    return ++layers <= 20 ? grpc::Status::OK : grpc::Status(grpc::StatusCode::UNAVAILABLE, "gone");
  };
  const ProcessResult result =
      start({"slice", box_, "--pitch", "1", "--encoding", "zstd", "--attempts", "2", "-o", path("out")}, fake.address())
          ->wait();
  EXPECT_EQ(result.exit_code, cli::kExitOk) << result.err;
  EXPECT_THAT(result.err, HasSubstr("there is no contact sheet: "));
  EXPECT_THAT(result.out, testing::Not(HasSubstr("contact sheet")));
  EXPECT_EQ(files_in("out"), 20u + 1) << "the layers and manifest.json";
}

}  // namespace
}  // namespace ccslice::client
