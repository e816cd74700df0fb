// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The ccslice program: what files say of cells becomes cell regions and channels.

#include "tests/client/command_line.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "client/cli/base/exit_codes.h"
#include "core/base/read_file.h"
#include "core/mesh_files/read_mesh.h"
#include "core/mesh_import/mesh_file.h"

namespace ccslice::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

TEST_F(CommandLine, CellRegionsComeFromNumbersOfCells) {
  const std::string mesh = path("two.mesh");
  cli::write_file(mesh,
                  "MeshVersionFormatted 2\nDimension 3\nVertices 12\n"
                  "0 0 0 0  1 0 0 0  2 0 0 0  0 1 0 0  1 1 0 0  2 1 0 0\n"
                  "0 0 1 0  1 0 1 0  2 0 1 0  0 1 1 0  1 1 1 0  2 1 1 0\n"
                  "Hexahedra 2\n1 2 5 4 7 8 11 10 5\n2 3 6 5 8 9 12 11 3\nEnd\n");
  EXPECT_THAT(run({"info", mesh}).out, HasSubstr("the cells' 'reference' left out; --regions-from"));
  const ProcessResult info = run({"info", mesh, "--regions-from", "reference", "--json"});
  EXPECT_EQ(json_at(info.out, "cell_regions").list_value().values_size(), 2);
  const ProcessResult slice =
      run({"slice", mesh, "--regions-from", "reference", "--cell-regions", "--pitch", "0.1", "-o", path("r")});
  EXPECT_EQ(slice.exit_code, 0) << slice.err;
  EXPECT_TRUE(std::filesystem::exists(path("r") + "/layer_0000_cell_regions.png"));
  const std::vector<std::string> outlines = {
      "slice", mesh,       "--regions-from", "reference", "--contours", "json",    "--pitch",
      "0.1",   "--layers", "4..4",           "-o",        path("o"),    "--force", "--contours-by-cell-region"};
  ASSERT_EQ(run(outlines).exit_code, 0);
  const std::string loops = read_file_bytes(path("o") + "/layer_0004_contours.json", 1 << 20);
  EXPECT_EQ(json_at(loops, "loops").list_value().values_size(), 2);
  EXPECT_EQ(json_at(loops, "loops").list_value().values(1).struct_value().fields().at("cell_region").number_value(), 2);
  EXPECT_EQ(json_at(read_file_bytes(path("o") + "/manifest.json", 1 << 20), "cell_regions").list_value().values_size(),
            2);
  const ProcessResult picture = run({"picture", mesh, "--regions-from", "reference", "--cell-regions", "--voxels", "24",
                                     "--pixels", "100", "-o", path("regions.png")});
  EXPECT_EQ(picture.exit_code, 0) << picture.err;
  EXPECT_TRUE(read_file_bytes(path("regions.png"), 1 << 20).starts_with("\x89PNG"));
  EXPECT_EQ(run({"slice", mesh, "--contours-by-cell-region", "--pitch", "0.1", "-o", path("n")}).exit_code,
            cli::kExitUsage);
  const ProcessResult unknown = run({"info", mesh, "--regions-from", "part", "--json"});
  EXPECT_EQ(unknown.exit_code, cli::kExitInput);
  EXPECT_EQ(json_at(unknown.out, "error.reason").string_value(), "MESH_BAD_CELL_REGION");
  EXPECT_EQ(run({"info", mesh, "--regions-from", "reference", "--fit", "--smooth"}).exit_code, 0);
}

// Two opposite ones of eight cubes are a region: round the middle vertex the others go all the way round it.
TEST_F(CommandLine, CellRegionsThatNoServerTakesAreRefusedByEveryCommand) {
  const std::string mesh = path("round.mesh");
  std::string text = "MeshVersionFormatted 2\nDimension 3\nVertices 27\n";
  for (const char* z : {"0", "1", "2"}) {
    for (const char* y : {"0", "1", "2"}) {
      for (const char* x : {"0", "1", "2"}) text += std::string(x) + " " + y + " " + z + " 0\n";
    }
  }
  text += "Hexahedra 8\n";
  for (int cell = 0; cell < 8; ++cell) {
    const int low = 1 + cell % 2 + 3 * (cell / 2 % 2) + 9 * (cell / 4);
    for (const int corner : {0, 1, 4, 3, 9, 10, 13, 12}) text += std::to_string(low + corner) + " ";
    text += cell == 0 || cell == 7 ? "1\n" : "2\n";
  }
  cli::write_file(mesh, text + "End\n");
  EXPECT_EQ(run_alone({"info", mesh}).exit_code, 0);
  for (const auto& command : {std::vector<std::string>{"convert", mesh, "-o", path("round.ccmesh")}, {"info", mesh}}) {
    std::vector<std::string> with_regions = command;
    with_regions.insert(with_regions.end(), {"--regions-from", "reference"});
    const ProcessResult result = run_alone(with_regions);
    EXPECT_EQ(result.exit_code, cli::kExitInput) << command.front();
    EXPECT_THAT(result.err, AllOf(HasSubstr("round.mesh: the cells of one region meet otherwise than in faces"),
                                  HasSubstr("at vertex 14 at (1, 1, 1) mm")));
  }
}

TEST_F(CommandLine, NumbersOfCellsThatAreNotTakenAreTold) {
  const std::string mesh = path("numbers.vtk");
  cli::write_file(mesh,
                  "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 float\n"
                  "0 0 0 1 0 0 0 1 0 0 0 1 0 0 -1\nCELLS 2 10\n4 0 1 2 3\n4 0 2 1 4\nCELL_TYPES 2\n10 10\n"
                  "CELL_DATA 2\nSCALARS part int 1\nLOOKUP_TABLE default\n1 2\n"
                  "SCALARS rank int 1\nLOOKUP_TABLE default\n3 4\n");
  const std::string out = run({"info", mesh, "--regions-from", "part"}).out;
  EXPECT_THAT(out, HasSubstr("the cells' 'rank' left out; --regions-from"));
  EXPECT_THAT(out, Not(HasSubstr("the cells' 'part' left out")));
}

TEST_F(CommandLine, CellRegionsArePrintedByTheirOwnMaps) {
  const std::string mesh = CCSLICE_TEST_DATA_DIR "/meshes/regions.inp";
  EXPECT_THAT(run({"info", mesh}).out,
              HasSubstr("sets of cells left out: 'left', 'right', 'both', 'top', 'low'; --regions-from"));
  const std::vector<std::string> slice = {"slice", mesh,         "--regions-from", "left",       "--pitch",
                                          "0.1",   "--material", "soft=#ff0000",   "--material", "hard=#00ff00",
                                          "-o",    path("p")};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), slice.begin(), slice.end());
    return run(more);
  };
  const ProcessResult printed = with({"--map", "region:left=soft,rest=hard"});
  EXPECT_EQ(printed.exit_code, 0) << printed.err;
  EXPECT_TRUE(std::filesystem::exists(path("p") + "/layer_0000_materials.png"));
  EXPECT_THAT(with({"--map", "region:right=soft", "--map", "material:hard", "--force"}).err,
              HasSubstr("there is no cell region \"right\"; the mesh has \"left\", \"rest\""));
  EXPECT_THAT(run({"info", mesh, "--regions-from", "left,both"}).err,
              HasSubstr("element 10 at (0.5, 0.5, 0.5) mm is in both 'left' and 'both'"));
}

TEST_F(CommandLine, SetsWithACellInCommonAreRefusedWithItsNumberInTheFileAndWithSetsThatDo) {
  const std::string mesh = path("sets.inp");
  cli::write_file(mesh,
                  "*NODE\n11, 0, 0, 0\n12, 1, 0, 0\n13, 0, 1, 0\n14, 0, 0, 1\n15, 0, 0, -1\n"
                  "*ELEMENT, TYPE=C3D4, ELSET=ALL\n501, 11, 12, 13, 14\n502, 11, 13, 12, 15\n"
                  "*ELSET, ELSET=A\n502\n*ELSET, ELSET=B\n501\n");
  const ProcessResult refused = run({"info", mesh, "--regions-from", "sets"});
  EXPECT_EQ(refused.exit_code, cli::kExitInput);
  EXPECT_THAT(refused.err, HasSubstr("element 502 at (0.25, 0.25, -0.25) mm is in both 'ALL' and 'A'; name sets that "
                                     "have no cells in common, such as 'A,B', and the rest becomes one region "
                                     "(--regions-from)"));
  EXPECT_EQ(run({"info", mesh, "--regions-from", "A,B"}).exit_code, 0);
}

TEST_F(CommandLine, ChannelsComeFromNumbersOfCells) {
  const std::string mesh = path("density.vtk");
  cli::write_file(mesh,
                  "# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 double\n"
                  "0 0 0 1 0 0 0 1 0 0 0 1 1 1 1\nCELLS 2 10\n4 0 1 2 3\n4 1 2 3 4\nCELL_TYPES 2\n10\n10\n"
                  "CELL_DATA 2\nSCALARS density double 1\nLOOKUP_TABLE default\n0.25\n0.75\n");
  EXPECT_THAT(run({"info", mesh}).out,
              HasSubstr("the cells' 'density' left out; --cell-data density=average makes a channel of it"));
  const ProcessResult info = run({"info", mesh, "--cell-data", "density=average"});
  EXPECT_EQ(info.exit_code, 0) << info.err;
  EXPECT_THAT(info.out, HasSubstr("density"));
  EXPECT_EQ(run({"info", mesh, "--cell-data", "density"}).exit_code, cli::kExitUsage);
  EXPECT_THAT(run({"info", mesh, "--cell-data", "mass=average"}).err,
              HasSubstr("no numbers called 'mass' for its cells; it has numbers called 'density'"));
}

TEST_F(CommandLine, ChannelsOfRegionsJumpAtInterfaces) {
  const std::string mesh = path("two.vtk");
  cli::write_file(mesh,
                  "# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 double\n"
                  "0 0 0 1 0 0 0 1 0 0 0 1 1 1 1\nCELLS 2 10\n4 0 1 2 3\n4 1 2 3 4\nCELL_TYPES 2\n10\n10\n"
                  "CELL_DATA 2\nSCALARS density double 1\nLOOKUP_TABLE default\n0.25\n0.75\n"
                  "SCALARS part int 1\nLOOKUP_TABLE default\n4\n9\n");
  const std::vector<std::string> by_region = {"--regions-from", "part", "--cell-data", "density=by-region"};
  const auto with = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), by_region.begin(), by_region.end());
    return arguments;
  };
  EXPECT_THAT(run({"info", mesh, "--cell-data", "density=by-region"}).err, HasSubstr("goes with --regions-from"));
  for (const char* name : {"two.json", "two.ccmesh", "two.vtu"}) {
    EXPECT_EQ(run_alone(with({"convert", mesh, "-o", path(name)})).exit_code, 0);
  }
  const MeshFile doubled = read_mesh(read_file_bytes(path("two.vtu"), 1 << 20));
  EXPECT_EQ(doubled.mesh.vertex_count(), 8u) << "each cell has vertices of its own";
  const ProcessResult read = run_alone({"convert", path("two.json"), "-o", path("again.ccmesh")});
  EXPECT_EQ(read.exit_code, 0) << read.err;
  EXPECT_EQ(read_file_bytes(path("again.ccmesh"), 1 << 20), read_file_bytes(path("two.ccmesh"), 1 << 20));
  const ProcessResult probe = run({"probe", path("two.ccmesh"), "--at", "0.25,0.25,0.25", "--at", "0.5,0.5,0.5"});
  EXPECT_THAT(probe.out, AllOf(HasSubstr("0.25"), HasSubstr("0.75"))) << probe.err;
  EXPECT_EQ(run(with({"slice", mesh, "--channel", "density", "--pitch", "0.05", "-o", path("jump")})).exit_code, 0);
  EXPECT_EQ(run(with({"info", mesh, "--fit", "--smooth", "--grade", "up=z"})).exit_code, 0);
}

}  // namespace
}  // namespace ccslice::client
