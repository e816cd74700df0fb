// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The ccslice program: parts on trays, packed by itself and arranged in files as other programs save them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "client/cli/base/exit_codes.h"
#include "client/cli/options/job_file.h"
#include "client/cli/tray/tray_package.h"
#include "tests/client/cli/package_files.h"
#include "tests/client/command_line.h"

namespace ccslice::client {
namespace {

using cli::motion;
using testing::AllOf;
using testing::HasSubstr;

constexpr std::uint64_t kMost = 1 << 28;

class CommandLineTray : public CommandLine {
 protected:
  CommandLineTray() { cli::write_file(ring_, MeshBytes(cli::to_proto(make_ring())).bytes()); }

  /// A job of both parts, as a file.
  std::string job() {
    const std::string file = path("job.json");
    const ProcessResult result =
        run({"tray", "pack", box_, ring_, "--copies", "2", "--printer", "j750-hm", "--occupancy", "-o", file});
    EXPECT_EQ(result.exit_code, cli::kExitOk) << result.err;
    return file;
  }

  /// The exported parts: their points as they come.
  std::vector<std::vector<Vec3>> exported(const std::string& job_file) {
    const ProcessResult result = run({"tray", "export", job_file, "-o", path("tray.3mf")});
    EXPECT_EQ(result.exit_code, cli::kExitOk) << result.err;
    std::vector<std::vector<Vec3>> parts;
    cli::TrayPoints last;
    for (const cli::TrayInstance& instance : cli::read_tray_package(path("tray.3mf"), kMost).instances) {
      if (instance.points != last) parts.push_back(*instance.points);
      last = instance.points;
    }
    return parts;
  }

  ProcessResult import(const std::string& job_file, const std::vector<std::string>& more = {}) {
    std::vector<std::string> command = {"tray",    "import", path("plate.3mf"), "--job", job_file,
                                        "--force", "-o",     path("plate.json")};
    command.insert(command.end(), more.begin(), more.end());
    return run(command);
  }

  void write_plate(const std::string& resources, const std::string& items, const std::string& unit = "millimeter") {
    cli::write_package(path("plate.3mf"), {{"3D/3dmodel.model", cli::model_text(resources, items, unit)}});
  }

  const std::string ring_ = path("ring.ccmesh");
};

Placement placed_by(const v1::Placement& message) {
  Placement placement = Placement::Identity();
  for (int i = 0; i < message.matrix_size(); ++i) placement.matrix()(i / 4, i % 4) = message.matrix(i);
  return placement;
}

/// About the middle of points, where programs put the origin.
std::vector<Vec3> about_middle(std::vector<Vec3> points, Vec3& middle) {
  Box3 box;
  for (const Vec3& point : points) box.extend(point);
  middle = box.center();
  for (Vec3& point : points) point -= middle;
  return points;
}

double distance(const Placement& a, const Placement& b, const std::vector<Vec3>& points) {
  double farthest = 0;
  for (const Vec3& point : points) farthest = std::max(farthest, (a * point - b * point).norm());
  return farthest;
}

TEST_F(CommandLineTray, PacksSlicesPlansAndDraws) {
  const std::string file = path("tray.json");
  const ProcessResult packed = run({"tray", "pack", box_, box_, "--copies", "2", "--copies", "box-2=3", "--printer",
                                    "j750-hm", "--pitch", "1", "--clearance", "1", "-o", file});
  ASSERT_EQ(packed.exit_code, cli::kExitOk) << packed.err;
  EXPECT_THAT(packed.out, AllOf(HasSubstr("2 parts in 5 places"), HasSubstr("490 x 390 mm")));
  const v1::SliceJob job = cli::read_job_file(file);
  ASSERT_EQ(job.parts_size(), 2);
  EXPECT_EQ(job.parts(0).mesh_id(), "box.ccmesh") << "a path beside the file";
  EXPECT_EQ(job.parts(0).placements_size(), 2);
  EXPECT_EQ(job.parts(1).placements_size(), 3);
  const ProcessResult planned = run({"plan", file, "--json"});
  ASSERT_EQ(planned.exit_code, cli::kExitOk) << planned.err;
  EXPECT_EQ(json_at(planned.out, "layer_count").number_value(), 8);
  const ProcessResult sliced = run({"slice", file, "-o", path("layers")});
  ASSERT_EQ(sliced.exit_code, cli::kExitOk) << sliced.err;
  const std::string manifest = read_whole(path("layers/manifest.json"));
  EXPECT_EQ(json_at(manifest, "voxels_covered").number_value(), 0) << "parts lie apart";
  EXPECT_EQ(json_at(manifest, "voxel_count").number_value(), 5 * 24 * 16 * 8);
  const ProcessResult by_job = run({"slice", "--job", file, box_, box_, "-o", path("by_job")});
  ASSERT_EQ(by_job.exit_code, cli::kExitOk) << by_job.err;
  EXPECT_EQ(read_whole(path("by_job/layer_0003_occupancy.png")), read_whole(path("layers/layer_0003_occupancy.png")));
  const ProcessResult drawn = run({"picture", file, "--layer", "3", "--show", "occupancy", "-o", path("layer.png")});
  EXPECT_EQ(drawn.exit_code, cli::kExitOk) << drawn.err;
}

TEST_F(CommandLineTray, PacksCopiesWholeVoxelsApart) {
  const std::string file = path("tray.json");
  const ProcessResult packed = run({"tray", "pack", box_, ring_, "--copies", "4", "--printer", "j750-hm", "--material",
                                    "VeroClear", "--material", "VeroBlack", "--map", "material:VeroBlack", "-o", file});
  ASSERT_EQ(packed.exit_code, cli::kExitOk) << packed.err;
  EXPECT_TRUE(cli::read_job_file(file).snap());
  const std::string plan = run({"plan", file, "--json"}).out;
  EXPECT_EQ(json_at(plan, "snapped.copies").number_value(), 0) << "nothing is left to be moved";
  EXPECT_EQ(json_at(plan, "snapped.computed").number_value(), 2);
  const ProcessResult sliced = run({"slice", file, "--layers", "4", "-o", path("layers")});
  ASSERT_EQ(sliced.exit_code, cli::kExitOk) << sliced.err;
  EXPECT_THAT(sliced.out,
              AllOf(HasSubstr("part box (4 copies): "), HasSubstr("part ring (4 copies): "), HasSubstr("VeroBlack")));
  const std::string manifest = read_whole(path("layers/manifest.json"));
  const double box = json_at(manifest, "parts.0.voxel_count").number_value();
  const double ring = json_at(manifest, "parts.1.voxel_count").number_value();
  EXPECT_EQ(json_at(manifest, "parts.0.name").string_value(), "box");
  EXPECT_EQ(box + ring, json_at(manifest, "voxel_count").number_value());
  EXPECT_EQ(json_at(manifest, "parts.1.materials.1.voxel_count").number_value(), ring);
}

TEST_F(CommandLineTray, SnapsAndRefusesByOptions) {
  const std::vector<std::string> two = {box_, "--pitch", "1", "--at", "0,0,0", "--at", "30.25,0,0"};
  const auto with = [&](const std::string& command, std::vector<std::string> more) {
    more.insert(more.begin(), two.begin(), two.end());
    more.insert(more.begin(), command);
    return run(more);
  };
  EXPECT_THAT(with("plan", {"--snap"}).out, HasSubstr("1 moved to whole voxels, by up to 250, 0 and 0 um"));
  const ProcessResult sliced = with("slice", {"--snap", "-o", path("snapped")});
  EXPECT_THAT(sliced.err, HasSubstr("note: copies: 1 moved to whole voxels"));
  EXPECT_EQ(json_at(read_whole(path("snapped/manifest.json")), "slice_job.snap").bool_value(), true);
  const ProcessResult over = run({"slice", box_, ring_, "--pitch", "1", "-o", path("over")});
  EXPECT_THAT(over.err,
              AllOf(HasSubstr("parts overlap in 32 voxels: 'box' takes "), HasSubstr(" of 'ring', one at (")));
  const ProcessResult refused = run({"slice", box_, ring_, "--pitch", "1", "--overlaps", "refuse", "-o", path("no")});
  EXPECT_EQ(refused.exit_code, cli::kExitRefused);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("--overlaps"), HasSubstr("'box' and 'ring' share voxels")));
}

TEST_F(CommandLineTray, FoldersOfOverlappingPartsAreReadAgain) {
  const std::vector<std::string> job = {"slice", box_, ring_, "--pitch", "1", "--material", "VeroClear", "-o"};
  const auto slice = [&](const std::string& folder, std::vector<std::string> more) {
    more.insert(more.begin(), job.begin(), job.end());
    more.insert(more.begin() + static_cast<std::ptrdiff_t>(job.size()), path(folder));
    return run(more);
  };
  EXPECT_THAT(slice("whole", {}).err, HasSubstr("parts overlap in "));
  EXPECT_EQ(slice("a", {"--share", "1/2"}).exit_code, cli::kExitOk);
  EXPECT_EQ(slice("b", {"--share", "2/2"}).exit_code, cli::kExitOk);
  const ProcessResult joined = run_alone({"join", "-o", path("joined"), path("a"), path("b")});
  ASSERT_EQ(joined.exit_code, cli::kExitOk) << joined.err;
  const std::string whole = read_whole(path("whole/manifest.json")), again = read_whole(path("joined/manifest.json"));
  for (const char* const number :
       {"parts.0.voxel_count", "parts.1.materials.0.voxel_count", "overlaps.0.voxel_count"}) {
    EXPECT_GT(json_at(whole, number).number_value(), 0) << number;
    EXPECT_EQ(json_at(again, number).number_value(), json_at(whole, number).number_value()) << number;
  }
  EXPECT_EQ(json_at(again, "overlaps.0.owner").string_value(), "box");
  const ProcessResult resumed = slice("whole", {"--resume"});
  EXPECT_EQ(resumed.exit_code, cli::kExitOk) << resumed.err;
  const ProcessResult packed = run({"package", path("whole"), "-o", path("whole.3mf")});
  EXPECT_THAT(packed.err, HasSubstr("there are none here")) << "as the manifest that was read says";
}

TEST_F(CommandLineTray, SnappedCopiesBesideABoxAreNotCounted) {
  const auto slice = [&](const std::string& folder, std::vector<std::string> more) {
    const std::vector<std::string> job = {"slice", box_,     "--pitch", "1",      "--at",  "0,0,0",
                                          "--at",  "30,0,0", "--at",    "60,0,0", "--box", "0,0,0,40,10,8"};
    more.insert(more.begin(), job.begin(), job.end());
    more.insert(more.end(), {"-o", path(folder)});
    return run(more);
  };
  const std::vector<std::string> cut = {"--cut-where", "x < 10", "--occupancy"};
  std::vector<std::string> snapped = cut;
  snapped.push_back("--snap");
  ASSERT_EQ(slice("apart", cut).exit_code, cli::kExitOk);
  ASSERT_EQ(slice("snapped", snapped).exit_code, cli::kExitOk);
  const std::string apart = read_whole(path("apart/manifest.json")), once = read_whole(path("snapped/manifest.json"));
  for (const char* const number : {"voxel_count", "voxels_cut", "parts.0.voxel_count"}) {
    EXPECT_EQ(json_at(once, number).number_value(), json_at(apart, number).number_value()) << number;
  }
  const std::vector<std::string> strict = {"--snap",    "--field",    "v = x",     "--strict", "--material",
                                           "A=#ff0000", "--material", "B=#0000ff", "--map",    "blend:v:0=A,24=B"};
  EXPECT_EQ(slice("strict", strict).exit_code, cli::kExitOk);
  std::vector<std::string> short_map = strict;
  short_map.back() = "blend:v:0=A,9=B";
  EXPECT_THAT(slice("refused", short_map).err, HasSubstr("give no fractions"));
  std::vector<std::string> beside = {"slice",  box_, "--pitch",      "1",     "--at",        "0,0,0", "--at",
                                     "30,0,0", "-o", path("beside"), "--box", "0,0,0,8,10,8"};
  beside.insert(beside.end(), short_map.begin(), short_map.end());
  EXPECT_EQ(run(beside).exit_code, cli::kExitOk) << "what the map lacks is beside the box";
}

TEST_F(CommandLineTray, PartsSideBySideHaveOneRun) {
  const ProcessResult runs =
      run({"slice", box_, "--pitch", "1", "--at", "0,0,0", "--at", "24,0,0", "--encoding", "runs", "-o", path("runs")});
  EXPECT_EQ(runs.exit_code, cli::kExitOk) << runs.err;
  EXPECT_EQ(runs.err.find("can't be decoded"), std::string::npos) << runs.err;
}

TEST_F(CommandLineTray, PacksOffVoxelsWhereTheTrayHasNoRoomForThem) {
  const auto pack = [&](double depth_mm) {
    std::ofstream(path("tight.json")) << R"({"parts": [{"mesh_id": "box.ccmesh"}], "grid": {"pitch": {"x_mm": 1, )"
                                      << R"("y_mm": 1, "z_mm": 1}}, "printer": {"name": "tight", "pitch": {"x_mm": 1, )"
                                      << R"("y_mm": 1, "z_mm": 1}, "tray_mm": {"x": 30, "y": )" << depth_mm
                                      << R"(, "z": 100}}, "planes": [{"occupancy": {}}]})";
    return run({"tray", "pack", path("tight.json"), "--copies", "2", "--clearance", "0.5", "--force", "-o",
                path("packed.json")});
  };
  EXPECT_THAT(pack(33.2).out, HasSubstr("up to y = 33 mm"));
  EXPECT_TRUE(cli::read_job_file(path("packed.json")).snap());
  EXPECT_THAT(pack(32.6).out, HasSubstr("up to y = 32.5 mm"));
  EXPECT_FALSE(cli::read_job_file(path("packed.json")).snap());
  EXPECT_THAT(pack(32.4).err, HasSubstr("1 of 'box'"));
}

TEST_F(CommandLineTray, AJobInPlaceOfAMeshIsTakenAsJobIs) {
  const std::string file = job();
  EXPECT_THAT(run({"slice", file, "--pitch", "1", "-o", path("x")}).err,
              AllOf(HasSubstr("--pitch"), HasSubstr("--job")));
  EXPECT_THAT(run({"plan", file, box_}).err, HasSubstr("2 parts, and there are 1 mesh"));
  std::ofstream(path("bad.json")) << R"({"parts": [{"mesh_id": "box.ccmesh"}], "grid": {"pitch": {"x_mm": -1}}})";
  EXPECT_THAT(run({"plan", path("bad.json")}).err, HasSubstr("bad.json: grid.pitch")) << "in fields of the file";
  const ProcessResult missing = run({"plan", path("none.json")});
  EXPECT_EQ(missing.exit_code, cli::kExitInput);
  EXPECT_THAT(missing.err, HasSubstr("none.json: there is no such file to read"));
}

TEST_F(CommandLineTray, PackSaysWhatHasNoRoomAndHowMuchIsMissing) {
  const auto error_of = [&](std::vector<std::string> more, cli::ExitCode code = cli::kExitUsage) {
    more.insert(more.begin(), {"tray", "pack", ring_, "-o", path("none.json")});
    const ProcessResult result = run(more);
    EXPECT_EQ(result.exit_code, code) << result.err;
    EXPECT_FALSE(fs::exists(path("none.json")));
    return result.err;
  };
  EXPECT_THAT(error_of({"--printer", "j750-hm", "--scale", "10"}),
              AllOf(HasSubstr("'ring' is "), HasSubstr("mm too long"), HasSubstr("490 x 390")));
  EXPECT_THAT(error_of({"--printer", "j750-hm", "--scale", "1,1,20"}), HasSubstr("mm too high"));
  EXPECT_THAT(error_of({"--printer", "j750-hm", "--copies", "40"}),
              AllOf(HasSubstr("of 'ring'"), HasSubstr("mm more than there are")));
  EXPECT_THAT(error_of({"--printer", "j750-hm", "--copies", "0"}), HasSubstr("--copies takes"));
  EXPECT_THAT(error_of({"--printer", "j750-hm", "--copies", "lid=2"}), HasSubstr("no part 'lid'; there are ring"));
  EXPECT_THAT(error_of({"--printer", "j750-hm", "--copies", "5000"}), HasSubstr("4096"));
  EXPECT_THAT(error_of({"--printer", "j750-hm", "--clearance=-1"}), HasSubstr("--clearance"));
  EXPECT_THAT(error_of({"--printer", "j750-hm", "--at", "0,0,0"}), HasSubstr("--at"));
  EXPECT_THAT(error_of({"--printer", "j75"}), HasSubstr("'j75'"));
  EXPECT_THAT(error_of({"--pitch", "1"}), HasSubstr("--printer"));
}

TEST_F(CommandLineTray, APrinterFitsAJobThatHasNone) {
  std::ofstream(path("job.json"))
      << R"({"parts": [{"mesh_id": "box.ccmesh"}], "grid": {"pitch": {"x_mm": 1, "y_mm": 1, "z_mm": 1}},)"
      << R"( "planes": [{"occupancy": {}, "encoding": "PLANE_ENCODING_PNG"}]})";
  EXPECT_THAT(run({"tray", "pack", path("job.json"), "-o", path("tray.json")}).err, HasSubstr("--printer"));
  fs::create_directory(path("sub"));
  const ProcessResult packed = run({"tray", "pack", path("job.json"), "--copies", "3", "--printer", "j750-hm", "-o",
                                    path("sub/tray.json"), "--json"});
  ASSERT_EQ(packed.exit_code, cli::kExitOk) << packed.err;
  EXPECT_EQ(json_at(packed.out, "printer").string_value(), "j750-hm");
  const v1::SliceJob job = cli::read_job_file(path("sub/tray.json"));
  EXPECT_EQ(job.parts(0).mesh_id(), "../box.ccmesh");
  EXPECT_EQ(job.parts(0).placements_size(), 3);
  EXPECT_EQ(run({"slice", path("sub/tray.json"), "-o", path("layers")}).exit_code, cli::kExitOk);
}

TEST_F(CommandLineTray, MeshesThatOptionsChangeGoByTheirIds) {
  const std::vector<std::string> mesh = {box_, "--grade", "stiffness=z"};
  const ProcessResult packed = run({"tray", "pack", mesh[0], mesh[1], mesh[2], "--printer", "j750-hm", "--pitch", "1",
                                    "--channel", "stiffness", "-o", path("tray.json")});
  ASSERT_EQ(packed.exit_code, cli::kExitOk) << packed.err;
  EXPECT_THAT(packed.err, HasSubstr("names meshes by their ids"));
  EXPECT_THAT(cli::read_job_file(path("tray.json")).parts(0).mesh_id(), HasSubstr("sha256:"));
  EXPECT_EQ(run({"slice", path("tray.json"), mesh[0], mesh[1], mesh[2], "-o", path("layers")}).exit_code, cli::kExitOk);
}

TEST_F(CommandLineTray, WhatIsExportedIsImportedAsItWas) {
  const std::string file = job();
  const auto parts = exported(file);
  ASSERT_EQ(parts.size(), 2u);
  fs::rename(path("tray.3mf"), path("plate.3mf"));
  const ProcessResult imported = import(file);
  ASSERT_EQ(imported.exit_code, cli::kExitOk) << imported.err;
  EXPECT_THAT(imported.out, HasSubstr("2 parts in 4 places"));
  const v1::SliceJob before = cli::read_job_file(file), after = cli::read_job_file(path("plate.json"));
  ASSERT_EQ(after.parts_size(), 2);
  for (int p = 0; p < 2; ++p) {
    ASSERT_EQ(after.parts(p).placements_size(), 2);
    EXPECT_EQ(after.parts(p).mesh_id(), before.parts(p).mesh_id());
    for (int i = 0; i < 2; ++i) {
      EXPECT_LT(distance(placed_by(after.parts(p).placements(i)), placed_by(before.parts(p).placements(i)),
                         parts[static_cast<std::size_t>(p)]),
                1e-9);
    }
  }
  EXPECT_EQ(after.planes_size(), before.planes_size());
  EXPECT_EQ(import(file, {"--json"}).exit_code, cli::kExitOk);
}

TEST_F(CommandLineTray, ImportsAPlateAsPrusaSlicerSavesIt) {
  const std::string file = job();
  const auto parts = exported(file);
  Vec3 box_middle, ring_middle;
  const std::string resources = cli::object_text(1, cli::mesh_text(about_middle(parts[1], ring_middle))) +
                                cli::object_text(2, cli::components_text("<component objectid=\"1\"/>")) +
                                cli::object_text(3, cli::mesh_text(about_middle(parts[0], box_middle)));
  const Placement first = motion(Vec3::UnitZ(), 37.5, Vec3(125, 105, 8)),
                  second = motion(Vec3::UnitX(), 90, Vec3(40, 50, 60));
  Placement mirrored = motion(Vec3(1, 2, 3), 11, Vec3(200, 10, 30));
  mirrored.linear().col(0) *= -1;
  write_plate(resources, cli::item_text(1, first) + cli::item_text(2, second) + cli::item_text(3, mirrored) +
                             cli::item_text(3, first, "printable=\"0\""));
  const ProcessResult imported = import(file);
  ASSERT_EQ(imported.exit_code, cli::kExitOk) << imported.err;
  EXPECT_THAT(imported.err, AllOf(HasSubstr("object 3 (copy 2) is left out"), HasSubstr("printable"),
                                  HasSubstr("object 3 is mirrored")));
  const v1::SliceJob job = cli::read_job_file(path("plate.json"));
  ASSERT_EQ(job.parts_size(), 2);
  ASSERT_EQ(job.parts(0).placements_size(), 1);
  ASSERT_EQ(job.parts(1).placements_size(), 2);
  const auto about = [](const Placement& placement, const Vec3& middle) {
    return Placement(placement * Eigen::Translation3d(-middle));
  };
  constexpr double kWithinMm = 1e-4;
  EXPECT_LT(distance(placed_by(job.parts(0).placements(0)), about(mirrored, box_middle), parts[0]), kWithinMm);
  EXPECT_LT(distance(placed_by(job.parts(1).placements(0)), about(first, ring_middle), parts[1]), kWithinMm);
  EXPECT_LT(distance(placed_by(job.parts(1).placements(1)), about(second, ring_middle), parts[1]), kWithinMm);
  const ProcessResult moved = import(file, {"--file-origin", "1,2,3"});
  ASSERT_EQ(moved.exit_code, cli::kExitOk) << moved.err;
  const Placement by(Eigen::Translation3d(-1, -2, -3));
  EXPECT_LT(distance(placed_by(cli::read_job_file(path("plate.json")).parts(1).placements(0)),
                     by * about(first, ring_middle), parts[1]),
            kWithinMm);
  EXPECT_EQ(run({"plan", path("plate.json")}).exit_code, cli::kExitOk);
}

TEST_F(CommandLineTray, ImportsOnePlateOfABambuProject) {
  const std::string file = job();
  const auto parts = exported(file);
  const auto instance = [](int object, int number) {
    return "<model_instance><metadata key=\"object_id\" value=\"" + std::to_string(object) +
           "\"/><metadata key=\"instance_id\" value=\"" + std::to_string(number) + "\"/></model_instance>";
  };
  const auto plate = [](int number, const std::string& instances) {
    return "<plate><metadata key=\"plater_id\" value=\"" + std::to_string(number) + "\"/>" + instances + "</plate>";
  };
  const auto object = [](int id, const std::string& sub_path) {
    return cli::object_text(id, cli::components_text("<component p:path=\"" + sub_path +
                                                     "\" objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 0 0 4\"/>"));
  };
  const Placement here = motion(Vec3::UnitZ(), 90, Vec3(50, 60, 0)), there = motion(Vec3::UnitZ(), 0, Vec3(350, 60, 0));
  cli::write_package(
      path("plate.3mf"),
      {{"3D/3dmodel.model",
        cli::model_text(object(2, "/3D/Objects/box_1.model") + object(4, "/3D/Objects/ring_2.model"),
                        cli::item_text(2, here) + cli::item_text(2, there) + cli::item_text(4, there))},
       {"3D/Objects/box_1.model", cli::model_text(cli::object_text(1, cli::mesh_text(parts[0])), "")},
       {"3D/Objects/ring_2.model", cli::model_text(cli::object_text(1, cli::mesh_text(parts[1])), "")},
       {"Metadata/model_settings.config", "<config><object id=\"2\"><metadata key=\"name\" value=\"box\"/></object>" +
                                              plate(1, instance(2, 0)) + plate(2, instance(2, 1) + instance(4, 0)) +
                                              plate(3, "") + "</config>"}});
  EXPECT_THAT(import(file).err, AllOf(HasSubstr("several plates"), HasSubstr("--plate"), HasSubstr("1, 2")));
  EXPECT_THAT(import(file, {"--plate", "9"}).err, AllOf(HasSubstr("no plate 9"), HasSubstr("1, 2, 3")));
  EXPECT_THAT(import(file, {"--plate", "3"}).err, HasSubstr("nothing on plate 3"));
  const ProcessResult first = import(file, {"--plate", "1"});
  ASSERT_EQ(first.exit_code, cli::kExitOk) << first.err;
  EXPECT_THAT(first.err, AllOf(HasSubstr("lies on plate 2"), HasSubstr("'ring' isn't on the plate")));
  const v1::SliceJob job = cli::read_job_file(path("plate.json"));
  ASSERT_EQ(job.parts_size(), 1);
  EXPECT_EQ(job.parts(0).name(), "box");
  EXPECT_LT(distance(placed_by(job.parts(0).placements(0)), here * Placement(Eigen::Translation3d(0, 0, 4)), parts[0]),
            1e-4);
  EXPECT_EQ(import(file, {"--plate", "2"}).exit_code, cli::kExitOk);
  EXPECT_EQ(cli::read_job_file(path("plate.json")).parts_size(), 2);
}

TEST_F(CommandLineTray, ImportNamesWhatIsNotTheJobs) {
  const std::string file = job();
  const auto parts = exported(file);
  const std::string ours = cli::object_text(1, cli::mesh_text(parts[0]), "name=\"box\"");
  const std::string cube =
      cli::object_text(2, cli::mesh_text({Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)}), "name=\"cube\"");
  const Placement here = motion(Vec3::UnitZ(), 0, Vec3(5, 6, 7));
  write_plate(ours + cube, cli::item_text(1, here) + cli::item_text(2, here));
  const ProcessResult refused = import(file);
  EXPECT_EQ(refused.exit_code, cli::kExitInput);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("plate.3mf"), HasSubstr("object 2 'cube' is none of the job's parts"),
                                 HasSubstr("1 object"), HasSubstr("--leave-out-others")));
  const ProcessResult taken = import(file, {"--leave-out-others"});
  EXPECT_EQ(taken.exit_code, cli::kExitOk) << taken.err;
  EXPECT_THAT(taken.err, HasSubstr("left out"));

  Placement scaled = here;
  scaled.linear() *= 2;
  write_plate(ours, cli::item_text(1, scaled));
  EXPECT_THAT(import(file).err, AllOf(HasSubstr("object 1 'box' is scaled by 2 x 2 x 2"), HasSubstr("100 %")));
  write_plate(ours, cli::item_text(1, here), "inch");
  EXPECT_THAT(import(file).err, HasSubstr("is scaled by 25.4")) << "a program that says inch and means mm";
  write_plate(cube, cli::item_text(2, here));
  EXPECT_THAT(import(file, {"--leave-out-others"}).err, HasSubstr("none of the job's parts is on the plate"));
  std::string items;
  for (int i = 0; i < 5000; ++i) items += cli::item_text(1, here);
  write_plate(ours, items);
  EXPECT_THAT(import(file).err, AllOf(HasSubstr("5000"), HasSubstr("4096")));
  EXPECT_THAT(import(file, {"--plate", "1"}).err, HasSubstr("says nothing of plates"));
  EXPECT_THAT(run({"tray", "import", path("plate.3mf"), "--job", file, "-o", file}).err, HasSubstr("--force"));
  EXPECT_THAT(run({"tray", "import", path("no.3mf"), "--job", file, "-o", path("x.json")}).err, HasSubstr("no.3mf"));
}

TEST_F(CommandLineTray, PrusaSlicerBringsPartsBack) {
  constexpr const char* kPrusaSlicer = "/usr/bin/prusa-slicer";
  if (!fs::exists(kPrusaSlicer)) GTEST_SKIP() << "needs Debian's package prusa-slicer";
  const std::string file = job();
  const auto parts = exported(file);
  const auto save = [&](const std::vector<std::string>& options) {
    std::vector<std::string> command = {kPrusaSlicer,     "--datadir", path("settings"), "--export-3mf",
                                        path("tray.3mf"), "-o",        path("plate.3mf")};
    command.insert(command.end(), options.begin(), options.end());
    fs::remove(path("plate.3mf"));
    const ProcessResult result = Process(command, folder_.path()).wait();
    ASSERT_TRUE(fs::exists(path("plate.3mf"))) << result.err;
  };
  save({"--dont-arrange"});
  ASSERT_EQ(import(file).exit_code, cli::kExitOk);
  const v1::SliceJob before = cli::read_job_file(file), same = cli::read_job_file(path("plate.json"));
  for (int p = 0; p < 2; ++p) {
    ASSERT_EQ(same.parts(p).placements_size(), 2);
    for (const v1::Placement& placement : before.parts(p).placements()) {
      double nearest = 1e9;
      for (const v1::Placement& other : same.parts(p).placements()) {
        nearest =
            std::min(nearest, distance(placed_by(placement), placed_by(other), parts[static_cast<std::size_t>(p)]));
      }
      EXPECT_LT(nearest, 1e-3);
    }
  }
  save({"--rotate", "30", "--duplicate", "3"});
  const ProcessResult copied = import(file, {"--json"});
  ASSERT_EQ(copied.exit_code, cli::kExitOk) << copied.err;
  EXPECT_LT(json_at(copied.out, "max_residual_mm").number_value(), 1e-4);
  EXPECT_EQ(cli::read_job_file(path("plate.json")).parts(1).placements_size(), 6);
  save({"--scale", "110%"});
  EXPECT_THAT(import(file).err, HasSubstr("is scaled by 1.1 x 1.1 x 1.1"));
}

TEST_F(CommandLineTray, HelpTeaches) {
  for (const char* const command : {"pack", "export", "import"}) {
    const ProcessResult help = run_alone({"help", "tray", command});
    EXPECT_EQ(help.exit_code, cli::kExitOk);
    EXPECT_THAT(help.out, HasSubstr(std::string("ccslice tray ") + command));
    EXPECT_THAT(help.out, HasSubstr("Examples:"));
  }
  EXPECT_THAT(run_alone({"tray", "--help"}).out, AllOf(HasSubstr("pack"), HasSubstr("import"), HasSubstr("Examples:")));
  EXPECT_THAT(run_alone({"tray", "pak"}).err, HasSubstr("did you mean pack?"));
  EXPECT_THAT(run_alone({"tray", "pack", "--copys", "3"}).err,
              AllOf(HasSubstr("did you mean --copies?"), HasSubstr("ccslice tray pack --help")));
  EXPECT_EQ(run_alone({"tray"}).exit_code, cli::kExitUsage);
}

}  // namespace
}  // namespace ccslice::client
