// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What the ccslice program does with meshes, and what it says of them: sizes, memory, how far the limit is from the
// control mesh, other files.

#include <fcntl.h>
#include <gmock/gmock.h>
#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "client/cli/base/exit_codes.h"
#include "core/base/read_file.h"
#include "core/mesh_import/mesh_file.h"
#include "tests/client/command_line.h"

namespace ccslice::client {
namespace {

using google::protobuf::util::MessageDifferencer;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

TEST_F(CommandLine, SlicesAPartOfTheSizeThatIsAskedFor) {
  const std::vector<std::string> size = {"--size", "z=3", "--center", "--on-bed", "--sharp-angle", "40"};
  std::vector<std::string> plan = {"plan", box_, "--pitch", "0.1", "--json"};
  plan.insert(plan.end(), size.begin(), size.end());
  const ProcessResult planned = run(plan);
  ASSERT_EQ(planned.exit_code, cli::kExitOk) << planned.err;
  EXPECT_EQ(json_at(planned.out, "grid.layers").number_value(), 30);
  const auto low = json_at(planned.out, "grid.part_box.min_mm").list_value();
  const auto high = json_at(planned.out, "grid.part_box.max_mm").list_value();
  for (int axis = 0; axis < 2; ++axis) {
    EXPECT_NEAR(low.values(axis).number_value(), -high.values(axis).number_value(), 1e-9) << axis;
  }
  EXPECT_NEAR(low.values(2).number_value(), 0, 1e-9);
  plan.erase(std::ranges::find(plan, "--json"));
  EXPECT_THAT(run(plan).err, HasSubstr("--size z=3 scales by 0.375: the part takes 9 x 6 x 3 mm, from (-4.5, -3, 0)"));
  plan.insert(plan.end(), {"--scale", "1,1,-2", "--grade", "skin=distance:0..1:0.5"});
  const ProcessResult scaled = run(plan);
  EXPECT_THAT(scaled.err, testing::AllOf(HasSubstr("scales by 0.1875, and --scale further: the part takes 4.5 x 3 x 3 "
                                                   "mm, from (-2.25, -1.5, 0)"),
                                         HasSubstr("reaches 1 at a depth of 0.5 mm")));
  EXPECT_THAT(scaled.out, HasSubstr("part       4.5 x 3 x 3 mm, from (-2.25, -1.5, 0)"));
  for (const char* command : {"slice", "plan", "picture", "export", "probe", "convert", "info", "upload"}) {
    EXPECT_THAT(run_alone({command, "--help"}).out,
                testing::AllOf(HasSubstr("--units"), HasSubstr("--size"), HasSubstr("--center"), HasSubstr("--on-bed")))
        << command;
  }
  const ProcessResult large = run({"upload", box_, "--units", "m", "--json"});
  ASSERT_EQ(large.exit_code, cli::kExitOk) << large.err;
  EXPECT_NEAR(json_at(large.out, "mesh.bounding_box.max_mm").list_value().values(0).number_value(), 24'000, 1e-6);
  EXPECT_EQ(json_at(large.out, "notes").list_value().values_size(), 0);
  ASSERT_EQ(run_alone({"convert", box_, "--units", "m", "-o", path("large.ccmesh")}).exit_code, cli::kExitOk);
  EXPECT_THAT(run({"upload", path("large.ccmesh")}).err,
              HasSubstr("note: the longest side of the control mesh is 24000"));
  EXPECT_THAT(
      json_at(run({"upload", path("large.ccmesh"), "--json"}).out, "notes").list_value().values(0).string_value(),
      HasSubstr("Is the file in another unit?"));
}

/// Writes a box of 40 x 40 x 40 cells, which take 2.6 kB each.
void write_large_box(const std::string& path) {
  constexpr int kCells = 40, kPoints = kCells + 1, kLayer = kPoints * kPoints;  // On each side.
  std::ofstream large(path);
  large << "MeshVersionFormatted 2\nDimension 3\nVertices\n" << kLayer * kPoints << "\n";
  for (int i = 0; i < kLayer * kPoints; ++i) {
    large << i % kPoints << ' ' << i / kPoints % kPoints << ' ' << i / kLayer << " 0\n";
  }
  large << "Hexahedra\n" << kCells * kCells * kCells << "\n";
  for (int i = 0; i < kCells * kCells * kCells; ++i) {
    const int low = 1 + i % kCells + kPoints * (i / kCells % kCells) + kLayer * (i / (kCells * kCells));
    for (const int corner : {0, 1, kPoints + 1, kPoints, kLayer, kLayer + 1, kLayer + kPoints + 1, kLayer + kPoints}) {
      large << low + corner << ' ';
    }
    large << "0\n";
  }
  large << "End\n";
}

TEST_F(CommandLine, TellsOfMuchMemory) {
  write_large_box(path("large.mesh"));
  const ProcessResult info = run_alone({"info", path("large.mesh"), "--full"});
  ASSERT_EQ(info.exit_code, cli::kExitOk) << info.err;
  EXPECT_THAT(
      info.err,
      ContainsRegex("^preparing the mesh takes at least 1[0-9]{2}\\.[0-9] MB of memory, here or on a server\n"));
  EXPECT_THAT(info.out, ContainsRegex("\n  memory     1[0-9]{2}\\.[0-9] MB in all, of a server's preparation budget"));
  EXPECT_EQ(run_alone({"info", path("large.mesh"), "--full", "--quiet"}).err, "");
  EXPECT_EQ(run_alone({"info", box_, "--full"}).err, "") << "next to nothing";
}

/// A pipe in the file system that takes no more until it is read.
class FullPipe {
 public:
  explicit FullPipe(const std::string& path) : path_(path) {
    EXPECT_EQ(mkfifo(path.c_str(), 0600), 0);
    ends_ = open(path.c_str(), O_RDWR | O_NONBLOCK);
    while (write(ends_, ".", 1) == 1) {
    }
  }
  ~FullPipe() { close(ends_); }
  FullPipe(const FullPipe&) = delete;
  FullPipe& operator=(const FullPipe&) = delete;

  const std::string& path() const { return path_; }
  /// Without the dots.
  std::string read_all() const {
    std::string text;
    char byte = 0;
    while (::read(ends_, &byte, 1) == 1) {
      if (byte != '.' || !text.empty()) text += byte;
    }
    return text;
  }

 private:
  std::string path_;
  int ends_ = -1;
};

/// Nobody reads the note, so the program goes no further than that.
TEST_F(CommandLine, TellsOfMuchMemoryBeforeItIsTaken) {
  write_large_box(path("large.mesh"));
  const FullPipe notes(path("notes"));
  Process info(
      {"/bin/bash", "-c", "exec \"$0\" info --full \"$1\" 2> \"$2\"", CCSLICE_BINARY, path("large.mesh"), notes.path()},
      folder_.path());
  std::uint64_t peak = 0;
  for (int unchanged = 0; unchanged < 20; ++unchanged) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    const std::uint64_t now = info.peak_memory_bytes();
    if (now != peak) unchanged = 0;
    peak = now;
  }
  ASSERT_GT(peak, 0u) << "it waits";
  std::string told = notes.read_all();
  std::uint64_t most = peak;
  for (std::uint64_t now; (now = info.peak_memory_bytes()) > 0; most = std::max(most, now)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  told += notes.read_all();
  EXPECT_THAT(told, HasSubstr("preparing the mesh takes at least 1")) << "MB";
  EXPECT_EQ(info.wait().exit_code, cli::kExitOk);
  EXPECT_GT(most, peak + 20'000'000) << "the mesh is read before the note, and prepared after it";
}

TEST_F(CommandLine, InfoOfAFilePreparesNothing) {
  write_large_box(path("large.mesh"));
  const ProcessResult quick = run_alone({"info", path("large.mesh")});
  ASSERT_EQ(quick.exit_code, cli::kExitOk) << quick.err;
  EXPECT_EQ(quick.err, "");
  EXPECT_THAT(quick.out, testing::AllOf(HasSubstr("\n  left out   size and volume of the limit"), HasSubstr("--full"),
                                        Not(HasSubstr("\n  moved")), Not(HasSubstr("\n  memory"))));
  const std::string box = run_alone({"info", box_, "--json"}).out;
  EXPECT_FALSE(json_at(box, "full").bool_value());
  EXPECT_NEAR(json_at(box, "control_volume_mm3").number_value(), 3072, 1e-9);
  EXPECT_THAT(box, Not(HasSubstr("deviation")));
  const std::string full = run_alone({"info", box_, "--full", "--json"}).out;
  EXPECT_TRUE(json_at(full, "full").bool_value());
  EXPECT_EQ(json_at(full, "control_volume_mm3").number_value(), 3072);
  EXPECT_THAT(run_alone({"info", box_, "--full"}).out, Not(HasSubstr("left out")));
  for (const std::vector<std::string>& other : {std::vector<std::string>{"info", "--full"},
                                                {"info", "--meshes", "--full"},
                                                {"info", "sha256:" + std::string(64, '0'), "--full"}}) {
    const ProcessResult refused = run(other);
    EXPECT_EQ(refused.exit_code, cli::kExitUsage);
    EXPECT_THAT(refused.err, HasSubstr("--full is for a mesh file"));
  }
}

/// Eight cubes, elements 501 to 508, whose common node lies far outside.
void write_folding_cubes(const std::string& path) {
  std::ofstream file(path);
  file << "*NODE\n";
  for (int i = 0; i < 27; ++i) {
    file << 101 + i << ", " << (i == 13 ? 7 : i % 3) << ", " << i / 3 % 3 << ", " << i / 9 << "\n";
  }
  file << "*ELEMENT, TYPE=C3D8\n";
  for (int i = 0; i < 8; ++i) {
    file << 501 + i;
    for (const int corner : {0, 1, 4, 3, 9, 10, 13, 12}) {
      file << ", " << 101 + corner + i % 2 + 3 * (i / 2 % 2) + 9 * (i / 4);
    }
    file << "\n";
  }
}

TEST_F(CommandLine, InfoOfAFileInFullTellsOfFoldsAsOfAnUploadedMesh) {
  const std::string file = path("folds.inp");
  write_folding_cubes(file);
  const std::string full = run_alone({"info", file, "--allow-folds", "--full"}).out;
  const std::string uploaded = run({"upload", file, "--allow-folds"}).out;
  const auto faults = [](const std::string& text) {
    const std::size_t begin = text.find("\n  folds"), end = text.find("\n  memory");
    return begin < end ? text.substr(begin, end - begin) : "none in " + text;
  };
  EXPECT_THAT(faults(full), ContainsRegex("^\n  folds      element 502 at \\(.*\n  folds      element 504 at "));
  EXPECT_EQ(faults(full), faults(uploaded));
  const std::string json = run_alone({"info", file, "--allow-folds", "--full", "--json"}).out;
  const std::string mesh = run({"upload", file, "--allow-folds", "--json"}).out;
  EXPECT_EQ(json_at(json, "folding_cells").number_value(), 4);
  for (const char* name : {"folding_cells", "undecided_cells", "folds", "overlaps"}) {
    EXPECT_TRUE(MessageDifferencer::Equals(json_at(json, name), json_at(mesh, std::string("mesh.") + name))) << name;
  }
  const google::protobuf::Struct first = json_at(json, "folds").list_value().values(0).struct_value();
  EXPECT_EQ(first.fields().at("control_cell").number_value(), 1);
  EXPECT_EQ(first.fields().at("file_cell").number_value(), 502);
}

TEST_F(CommandLine, TheManifestHasTheWarningsThatQuietJobsDoNotTell) {
  const std::string file = path("folds.inp");
  write_folding_cubes(file);
  const std::vector<std::string> slice = {"slice", file, "--allow-folds", "--pitch", "1", "--smallest-feature", "0"};
  const auto warnings_of = [&](const std::string& folder, const std::vector<std::string>& more) {
    std::vector<std::string> words = slice;
    words.insert(words.end(), {"-o", path(folder)});
    words.insert(words.end(), more.begin(), more.end());
    const ProcessResult result = run(words);
    EXPECT_EQ(result.exit_code, cli::kExitOk) << result.err;
    EXPECT_EQ(result.err.empty(), !more.empty()) << result.err;
    return json_at(read_file_bytes(path(folder) + "/manifest.json", 1 << 20), "warnings").list_value();
  };
  const auto warnings = warnings_of("quiet", {"--quiet"});
  ASSERT_GT(warnings.values_size(), 0);
  const auto& folds = warnings.values(0).struct_value().fields();
  EXPECT_EQ(folds.at("kind").string_value(), "folds");
  EXPECT_THAT(folds.at("message").string_value(), ContainsRegex("one of them in element 50[1-8] near \\("));
  EXPECT_TRUE(MessageDifferencer::Equals(warnings_of("loud", {}), warnings));
  ASSERT_EQ(run({"slice", box_, "--pitch", "1", "-o", path("box")}).exit_code, cli::kExitOk);
  EXPECT_EQ(json_at(read_file_bytes(path("box") + "/manifest.json", 1 << 20), "warnings").list_value().values_size(),
            0);
}

// Cells that the file lists inside out count as all others do.
TEST_F(CommandLine, InfoMeasuresCellsInEitherOrder) {
  ControlMesh box = make_box();
  for (std::size_t c = 0; c < box.cell_vertices.size(); c += 16) {
    std::swap_ranges(&box.cell_vertices[c], &box.cell_vertices[c] + 4, &box.cell_vertices[c] + 4);
  }
  cli::write_file(path("turned.ccmesh"), MeshBytes(cli::to_proto(box)).bytes());
  EXPECT_NEAR(json_at(run_alone({"info", path("turned.ccmesh"), "--json"}).out, "control_volume_mm3").number_value(),
              3072, 1e-9);
}

// Without --full, the volume is that within the corners.
TEST_F(CommandLine, InfoMeasuresCurvedCellsIfItPreparesThem) {
  cli::write_file(
      path("curved.vtk"),
      "# vtk DataFile Version 3.0\na bulge below\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 20 double\n"
      "0 0 0  2 0 0  2 2 0  0 2 0  0 0 2  2 0 2  2 2 2  0 2 2  1 0 -0.2  2 1 0  1 2 0  0 1 0  1 0 2  2 1 2\n"
      "1 2 2  0 1 2  0 0 1  2 0 1  2 2 1  0 2 1\n"
      "CELLS 1 21\n20 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19\nCELL_TYPES 1\n25\n");
  const std::string quick = run_alone({"info", path("curved.vtk"), "--as-meshed", "--json"}).out;
  const std::string full = run_alone({"info", path("curved.vtk"), "--as-meshed", "--full", "--json"}).out;
  EXPECT_NEAR(json_at(quick, "control_volume_mm3").number_value(), 8, 1e-12);
  // The node that is 0.2 mm lower has the shape function (1 - x^2) (1 - y) (1 - z) / 4 over [-1, 1]^3. The integral of
  // its derivative by z is -4/3.
  EXPECT_NEAR(json_at(full, "control_volume_mm3").number_value(), 8 + 0.2 * 4 / 3, 1e-9);
}

TEST_F(CommandLine, TellsHowFarTheLimitIsFromTheControlMesh) {
  ASSERT_EQ(run_alone({"models", "coyote", "-o", path("coyote.ccmesh")}).exit_code, cli::kExitOk);
  const std::string file = run_alone({"info", path("coyote.ccmesh"), "--full", "--json"}).out;
  const std::string uploaded = run({"upload", path("coyote.ccmesh"), "--json"}).out;
  const std::string plan = run({"plan", path("coyote.ccmesh"), "--pitch", "0.5", "--scale", "2", "--json"}).out;
  for (const char* name : {"control_volume_mm3", "limit_volume_mm3", "farthest_vertex", "farthest_distance_mm"}) {
    const std::string at = std::string("deviation.") + name;
    EXPECT_EQ(json_at(file, at).number_value(), json_at(uploaded, "mesh." + at).number_value()) << name;
  }
  const double limit = json_at(file, "deviation.limit_volume_mm3").number_value();
  EXPECT_NEAR(limit, 22631, 1) << "of the voxels in docs/samples.md";
  EXPECT_NEAR(json_at(plan, "deviation.limit_volume_mm3").number_value(), 8 * limit, 1e-6 * limit);
  EXPECT_EQ(json_at(plan, "warnings").list_value().values(0).struct_value().fields().at("kind").string_value(),
            "deviation");
  EXPECT_LT(json_at(file, "bounding_box.max_mm").list_value().values(0).number_value(),
            json_at(file, "deviation.control_box.max_mm").list_value().values(0).number_value());
  for (const ProcessResult& text :
       {run_alone({"info", path("coyote.ccmesh"), "--full"}), run({"upload", path("coyote.ccmesh")}),
        run({"plan", path("coyote.ccmesh"), "--pitch", "0.5"})}) {
    EXPECT_THAT(text.out, testing::AllOf(HasSubstr("volume     22631 mm^3 (-18.62 %), control mesh 27809.7 mm^3"),
                                         HasSubstr("moved      up to 12.0552 mm: boundary vertex 72 from ")));
  }
  EXPECT_THAT(run_alone({"info", path("coyote.ccmesh"), "--fit=boundary", "--smooth", "--full"}).out,
              ContainsRegex("mesh that it (interpolates|was fitted to) [0-9.]+ mm\\^3; between vertices the mesh is "
                            "flat, and the limit round\n"));
  EXPECT_THAT(run_alone({"info", box_, "--fit", "--smooth", "--full"}).out, Not(HasSubstr("is flat"))) << "sharp";
  EXPECT_THAT(run({"plan", box_, "--pitch", "1"}).out,
              testing::AllOf(HasSubstr("volume     3072 mm^3 (the same), control mesh 3072 mm^3"),
                             HasSubstr("moved      no boundary vertex"), testing::Not(HasSubstr("warning"))));
}

/// A box whose edges are sharp is flat between its vertices. A smooth one isn't, nor are edges that look sharp.
TEST_F(CommandLine, TellsWhatMadeTheVolumeOfAFittedMeshAnother) {
  ControlMesh box = make_box();
  box.interpolating = true;
  box.missed_vertices = {{0, box.positions[0] - Vec3(1, 0, 0)}};
  cli::write_file(path("missed.ccmesh"), MeshBytes(cli::to_proto(box)).bytes());
  const std::string missed = run_alone({"info", path("missed.ccmesh"), "--full"}).out;
  EXPECT_THAT(missed, ContainsRegex("mm\\^3; most of it at vertices that the fit missed\n  moved "));
  EXPECT_THAT(missed, Not(HasSubstr("round")));
  box = make_box();
  box.sharp_edges.clear();
  box.sharp_vertices.clear();
  cli::write_file(path("smooth.ccmesh"), MeshBytes(cli::to_proto(box)).bytes());
  const std::vector<std::string> fitted = {"info", path("smooth.ccmesh"), "--fit", "--smooth", "--full"};
  EXPECT_THAT(run_alone(fitted).out,
              ContainsRegex("and the limit round\n  rounded    [0-9]+ edges where the mesh turns by 75 degrees or more "
                            "aren't sharp, and the limit bulges there; the most, by 90 degrees, near \\(.*\n  moved    "
                            "  no boundary vertex"));
  EXPECT_GT(json_at(run_alone({"info", path("smooth.ccmesh"), "--fit", "--smooth", "--full", "--json"}).out,
                    "deviation.rounded_edges")
                .number_value(),
            0);
}

// --smooth has accepted them, and the plan's warning tells of them.
TEST_F(CommandLine, TellsOfRoundedEdgesOnce) {
  ControlMesh box = make_box();
  box.sharp_edges.clear();
  box.sharp_vertices.clear();
  cli::write_file(path("smooth.ccmesh"), MeshBytes(cli::to_proto(box)).bytes());
  const ProcessResult plan = run({"plan", path("smooth.ccmesh"), "--fit", "--smooth", "--pitch", "1"});
  ASSERT_EQ(plan.exit_code, cli::kExitOk) << plan.err;
  const std::string all = plan.err + plan.out, told = "by 75 degrees or more aren't sharp";
  EXPECT_NE(all.find(told), all.npos);
  EXPECT_EQ(all.find(told), all.rfind(told)) << all;
}

TEST_F(CommandLine, ConvertsToTheSameBytesEachTime) {
  ASSERT_EQ(run_alone({"convert", box_, "--grade", "a=x:5..7", "-o", path("a.ccmesh")}).exit_code, cli::kExitOk);
  ASSERT_EQ(run_alone({"convert", box_, "--grade", "a=x:5..7", "-o", path("b.ccmesh")}).exit_code, cli::kExitOk);
  EXPECT_EQ(read_whole(path("a.ccmesh")), read_whole(path("b.ccmesh")));
}

TEST_F(CommandLine, ConvertSaysWhatVtuFilesDoNotKeep) {
  const ProcessResult done = run_alone({"convert", box_, "--fit", "--smooth", "-o", path("box.vtu")});
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.err,
              ContainsRegex("note: .vtu files don't keep: [0-9]+ sharp edges, that control points were fitted; "
                            "write a .ccmesh or a .json"));
  EXPECT_THAT(run_alone({"convert", box_, "-o", path("box.json")}).err, Not(HasSubstr("don't keep")));
  EXPECT_THAT(run_alone({"convert", box_, "--limit", "0", "-o", path("limit.vtu")}).err, Not(HasSubstr("don't keep")));
}

TEST_F(CommandLine, ConvertWritesBezierCells) {
  const std::string engine = path("engine.ccmesh"), vtu = path("engine.vtu");
  ASSERT_EQ(run_alone({"models", "engine", "-o", engine}).exit_code, 0);
  const ProcessResult done = run_alone({"convert", engine, "--bezier", "0", "-o", vtu});
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.err, HasSubstr("1,464 of 2,408 cells lie at irregular edges and vertices"));
  EXPECT_THAT(read_file_bytes(vtu, 1 << 30), HasSubstr("Name=\"HigherOrderDegrees\""));
  EXPECT_THAT(run_alone({"convert", vtu, "-o", path("again.ccmesh")}).err,
              HasSubstr("cells of third order or higher taken by their corners"));
  EXPECT_THAT(run_alone({"convert", engine, "--bezier", "0", "-o", path("x.json")}).err,
              HasSubstr("--bezier goes with"));
  EXPECT_EQ(run_alone({"convert", engine, "--bezier", "0", "--limit", "0", "-o", path("x.vtu")}).exit_code,
            cli::kExitUsage);
}

/// What a file's info tells is enough for a server, and a hundredth less isn't.
TEST_F(CommandLine, InfoTellsTheMemoryThatAServerReserves) {
  for (const char* model : {"ring", "coyote", "engine", "grid"}) {
    SCOPED_TRACE(model);
    const std::string mesh = path(std::string(model) + ".ccmesh");
    ASSERT_EQ(run_alone({"models", model, "-o", mesh}).exit_code, 0);
    const auto bytes = static_cast<std::uint64_t>(
        json_at(run_alone({"info", mesh, "--full", "--json"}).out, "preparation_bytes").number_value());
    const auto upload = [&](std::uint64_t budget_bytes) {
      server::ServerOptions options = local_server_options();
      options.preparation_budget_bytes = budget_bytes;
      server::Server server(options);
      return start({"upload", mesh, "--json"}, server.address())->wait().out;
    };
    EXPECT_THAT(upload(bytes), HasSubstr("\"control_cells\""));
    EXPECT_EQ(json_at(upload(bytes - bytes / 100), "error.reason").string_value(), "MESH_EXCEEDS_MEMORY");
  }
}

}  // namespace
}  // namespace ccslice::client
