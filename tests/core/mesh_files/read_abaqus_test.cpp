// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/read_abaqus.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "core/base/read_file.h"
#include "core/mesh/validate.h"
#include "core/mesh_files/read_mesh.h"
#include "tests/core/mesh/expect_error.h"

namespace ccslice {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

const std::string kFourNodes = "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n";
const std::string kOneTet = kFourNodes + "*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n";

TEST(ReadAbaqus, ReadsPyramidsAsHexahedraWithFourCornersInOne) {
  const MeshFile file = read_abaqus(
      "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 1, 1, 0\n4, 0, 1, 0\n5, 0, 0, 1\n*ELEMENT, TYPE=C3D5, ELSET=TOP\n"
      "70, 1, 2, 3, 4, 5\n");
  EXPECT_THAT(file.mesh.cell_kinds, testing::ElementsAre(CellKind::kHex));
  EXPECT_THAT(file.mesh.cell_vertices, testing::ElementsAre(0, 1, 2, 3, 4, 4, 4, 4));
  EXPECT_THAT(file.numbers.cells, testing::ElementsAre(70));
  ASSERT_EQ(file.cell_sets.size(), 1u);
  EXPECT_THAT(file.cell_sets[0].cells, testing::ElementsAre(0));
}

TEST(ReadAbaqus, PlacesInstancesOfParts) {
  const std::string path = CCSLICE_TEST_DATA_DIR "/meshes/assembly.inp";
  MeshFile file = read_abaqus(read_file_bytes(path, 1 << 20));
  EXPECT_THAT(file.mesh.cell_kinds, ElementsAre(CellKind::kHex, CellKind::kHex, CellKind::kTet));
  ASSERT_EQ(file.mesh.vertex_count(), 20u);
  EXPECT_EQ(file.mesh.positions[6], Vec3(2, 1, 3));
  // (2, 1, 3), moved to (12, 1, 3), then turned about the axis through (10, 0, 0).
  EXPECT_TRUE(file.mesh.positions[14].isApprox(Vec3(9, 2, 3), 1e-12)) << file.mesh.positions[14].transpose();
  EXPECT_EQ(file.mesh.positions[17], Vec3(4, 0, 20));
  EXPECT_NO_THROW(validate(file.mesh));
  ASSERT_EQ(file.cell_sets.size(), 1u);
  EXPECT_EQ(file.cell_sets[0].name, "solid");
  EXPECT_THAT(file.cell_sets[0].cells, ElementsAre(0, 1));
  EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("3 vertices that no cell uses left out"),
                                         HasSubstr("3 instances placed"), "elements of types left out: S3 (1)",
                                         "sets left out: all, corner", "keywords left out: *ELASTIC, *MATERIAL"));
}

TEST(ReadAbaqus, TakesPartsAsTheyAreWithoutAnAssembly) {
  const MeshFile file =
      read_abaqus("*PART, NAME=a\n" + kOneTet + "*END PART\n*PART, NAME=b\n" + kOneTet + "*END PART\n");
  EXPECT_EQ(file.mesh.cell_count(), 2u);
  const MeshFile one = read_abaqus("*PART, NAME=a\n" + kOneTet + "*END PART\n*PART, NAME=b\n" + kOneTet +
                                   "*END PART\n*ASSEMBLY, NAME=x\n*INSTANCE, NAME=i, PART=b\n*END INSTANCE\n");
  EXPECT_EQ(one.mesh.cell_count(), 1u);
  EXPECT_THAT(one.warnings, ElementsAre("part 'a' left out: it has no instance"));
}

TEST(ReadAbaqus, PlacesMeshesOfInstances) {
  const MeshFile file =
      read_abaqus("*PART, NAME=a\n*END PART\n*ASSEMBLY, NAME=x\n*INSTANCE, NAME=i, PART=a\n1, 2, 3\n" + kOneTet +
                  "*END INSTANCE\n*END ASSEMBLY\n");
  EXPECT_THAT(file.mesh.positions, ElementsAre(Vec3(1, 2, 3), Vec3(2, 2, 3), Vec3(1, 3, 3), Vec3(1, 2, 4)));
}

struct AbaqusType {
  const char* name;
  int nodes;
  CellKind kind;
};

class AbaqusTypes : public testing::TestWithParam<AbaqusType> {};

TEST_P(AbaqusTypes, KeepTheirCorners) {
  const auto& [name, nodes, kind] = GetParam();
  std::string text = "*NODE\n", element = "7";
  for (int n = 1; n <= nodes; ++n) {
    text += std::to_string(n) + ", " + std::to_string(n) + ", " + std::to_string(n * n % 7) + ", 0\n";
    element += (n == 15 ? ",\n" : ", ") + std::to_string(n);
  }
  const MeshFile file = read_abaqus(text + "*ELEMENT, TYPE=" + name + "\n" + element + "\n");
  EXPECT_THAT(file.mesh.cell_kinds, ElementsAre(kind));
  ASSERT_EQ(file.mesh.vertex_count(), static_cast<std::size_t>(corner_count(kind)));
  for (std::uint32_t corner = 0; corner < file.mesh.cell_vertices.size(); ++corner) {
    EXPECT_EQ(file.mesh.cell_vertices[corner], corner);
    EXPECT_EQ(file.mesh.positions[corner].x(), corner + 1.0);
  }
}

INSTANTIATE_TEST_SUITE_P(
    ReadAbaqus, AbaqusTypes,
    testing::Values(AbaqusType{"C3D4", 4, CellKind::kTet}, AbaqusType{"c3d4h", 4, CellKind::kTet},
                    AbaqusType{"C3D6", 6, CellKind::kWedge}, AbaqusType{"C3D8", 8, CellKind::kHex},
                    AbaqusType{"C3D8R", 8, CellKind::kHex}, AbaqusType{"C3D8I", 8, CellKind::kHex},
                    AbaqusType{"DC3D8", 8, CellKind::kHex}, AbaqusType{"SC8R", 8, CellKind::kHex},
                    AbaqusType{"SC6R", 6, CellKind::kWedge}, AbaqusType{"C3D10", 10, CellKind::kTet},
                    AbaqusType{"C3D10M", 10, CellKind::kTet}, AbaqusType{"C3D15", 15, CellKind::kWedge},
                    AbaqusType{"C3D15V", 18, CellKind::kWedge}, AbaqusType{"C3D20", 20, CellKind::kHex},
                    AbaqusType{"C3D20R", 20, CellKind::kHex}, AbaqusType{"C3D27", 27, CellKind::kHex},
                    AbaqusType{"C3D27R", 21, CellKind::kHex}),
    [](const auto& info) { return info.param.name + std::to_string(info.param.nodes); });

/// Nodes 1 to `nodes` in a line, which is enough for the syntax.
std::string nodes_up_to(int nodes) {
  std::string text = "*NODE\n";
  for (int n = 1; n <= nodes; ++n) text += std::to_string(n) + ", " + std::to_string(n) + "\n";
  return text;
}

TEST(ReadAbaqus, TakesCommasBehindTheLastNode) {
  for (const auto& [type, nodes] : {std::pair{"C3D8", 8},
                                    {"C3D10", 10},
                                    {"C3D15", 15},
                                    {"C3D15V", 15},
                                    {"C3D15V", 18},
                                    {"C3D20", 20},
                                    {"C3D27", 21},
                                    {"C3D27", 27}}) {
    SCOPED_TRACE(std::string(type) + " " + std::to_string(nodes));
    std::string element = "7";
    for (int n = 1; n <= nodes; ++n) element += (n % 16 == 0 ? ",\n" : ", ") + std::to_string(n);
    const std::string twice = "*ELEMENT, TYPE=" + std::string(type) + "\n" + element + ",\n" + element + ",\n";
    for (const std::string& text : {twice, twice + "*STEP\n", twice + "\n"}) {
      const MeshFile file = read_abaqus(nodes_up_to(nodes) + text);
      EXPECT_EQ(file.mesh.cell_count(), 2u);
      EXPECT_THAT(file.numbers.cells, ElementsAre(7, 7));
    }
  }
  EXPECT_EQ(read_abaqus(kFourNodes + "*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4, , ,\n").mesh.cell_count(), 1u);
}

// A keyword goes on after a comma, but in a line of parameters only.
TEST(ReadAbaqus, TakesCommasBehindKeywords) {
  const std::string nodes = "*NODE,\n** places\n1, 0, 0, 0,\n2, 1, 0, 0\n3, 0, 1, 0\n4, -0, 0, 1\n";
  for (const char* keyword : {"*ELEMENT, TYPE=C3D4,\n", "*ELEMENT, TYPE=C3D4 , \n", "*ELEMENT,\nTYPE=C3D4,\n** tets\n",
                              "*ELEMENT, TYPE=C3D4,\nELSET=E,\n"}) {
    const MeshFile file = read_abaqus(nodes + keyword + "7, 1, 2, 3, 4,\n8, 1, 3, 2, 4\n*END STEP,\n*STEP,\n");
    EXPECT_THAT(file.numbers.cells, ElementsAre(7, 8)) << keyword;
    EXPECT_EQ(file.mesh.positions[3], Vec3(0, 0, 1)) << keyword;
  }
}

TEST(ReadAbaqus, CountsElementsThatItLeavesOut) {
  const std::string others =
      "*ELEMENT, TYPE=S4R, ELSET=SKIN\n1, 1, 2, 3, 4\n2, 1, 2, 3, 4\n*ELEMENT, TYPE=CCL12\n3, 1, 2, 3,\n4, 1\n"
      "*ELEMENT, TYPE=F3D4\n4, 1, 2, 3, 4\n*ELEMENT, TYPE=GK3D8, OFFSET=100\n5, 1, 2, 3, 4\n\n";
  const MeshFile file = read_abaqus(kOneTet + others);
  EXPECT_EQ(file.mesh.cell_count(), 1u);
  EXPECT_THAT(file.warnings,
              ElementsAre("elements of types left out: S4R (2)", HasSubstr("1 element of type CCL12 left out: cells"),
                          HasSubstr("1 element of type F3D4 left out: they are tetrahedra in CalculiX"),
                          HasSubstr("1 element of type GK3D8 left out: half of their nodes come of OFFSET"),
                          "sets left out: SKIN"));
  expect_error([&] { (void)read_abaqus(kFourNodes + others); }, ErrorCode::kMeshEmpty,
               "no solid elements (C3D4, C3D6, C3D8, ...), but elements of types S4R, CCL12, F3D4, GK3D8; ");
}

TEST(ReadAbaqus, SaysThatNumbersAreTooLarge) {
  for (const char* huge : {"9223372036854775808", "18446744073709551616"}) {
    expect_error([&] { (void)read_abaqus("*NODE\n" + std::string(huge) + ", 0\n"); }, ErrorCode::kFileSyntax,
                 "line 2: expected a node's number, found '" + std::string(huge) + "', which is beyond 2^53");
  }
}

TEST(ReadAbaqus, TakesAnyNumbersWhereNoCellIs) {
  const MeshFile file = read_abaqus(kOneTet + "*NODE\n5, nan, inf\n6, 1\n");
  EXPECT_EQ(file.mesh.vertex_count(), 4u);
  EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("2 vertices that no cell uses left out")));
}

/// A folder of files that is gone afterwards.
class IncludedFiles : public testing::Test {
 protected:
  IncludedFiles() { fs::create_directories(folder_ / "deeper"); }
  ~IncludedFiles() override { fs::remove_all(folder_); }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }
  static MeshFile read(const std::string& path) { return read_abaqus(read_file_bytes(path, 1 << 20), {}, {path}); }

  const fs::path folder_ = fs::path(testing::TempDir()) / ("ccslice_included_files_" + std::to_string(getpid()));
};

TEST_F(IncludedFiles, StandWhereTheyAreNamed) {
  write("deeper/nodes.txt", "** comment\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n");
  write("deeper/cells.inp", "*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n");
  write("deeper/all.inp", "*NODE, INPUT=nodes.txt\n*INCLUDE, INPUT=\"cells.inp\"\n");
  const std::string path =
      write("main.inp",
            "*HEADING\n*INCLUDE,\nINPUT=deeper/all.inp\n*ELEMENT, TYPE=C3D4\n2, 1, 3, 2, 5\n*NODE\n5, 0, 0, -1\n");
  const MeshFile file = read(path);
  EXPECT_EQ(file.mesh.cell_count(), 2u);
  EXPECT_EQ(file.mesh.vertex_count(), 5u);
  EXPECT_EQ(read_mesh(read_file_bytes(path, 1 << 20), {}, {path}).mesh.cell_count(), 2u);
}

// Lest a file that somebody sent reads others, whose lines errors would repeat.
TEST_F(IncludedFiles, StayBelowTheFolderUnlessAllowed) {
  fs::create_directories(folder_ / "common");
  write("common/nodes.inp", "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n");
  const std::string element = "*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n";
  const std::string path = write("deeper/main.inp", "*INCLUDE, INPUT=../common/nodes.inp\n" + element);
  const auto read_with = [&](const std::string& allowed) {
    return read_abaqus(read_file_bytes(path, 1 << 20), {}, {path, allowed});
  };
  expect_error([&] { read_with(""); }, ErrorCode::kFileUnreadable, "--allow-includes");
  expect_error([&] { read_with((folder_ / "comm").string()); }, ErrorCode::kFileUnreadable, "--allow-includes");
  EXPECT_EQ(read_with((folder_ / "common").string()).mesh.cell_count(), 1u);
  EXPECT_EQ(read_with((folder_ / "deeper/..").string()).mesh.cell_count(), 1u);
  fs::create_symlink("/etc/hostname", folder_ / "deeper/linked.inp");
  write("deeper/main.inp", "*INCLUDE, INPUT=linked.inp\n");
  expect_error([&] { read_with(""); }, ErrorCode::kFileUnreadable, "--allow-includes");
  write("deeper/main.inp", "*INCLUDE, INPUT=/etc/hostname\n");
  expect_error([&] { read_with(""); }, ErrorCode::kFileUnreadable, "outside of the folder");
}

// Lest somebody who sends files learns which others there are.
TEST_F(IncludedFiles, AreToldAlikeOutsideOfTheFolderWhetherTheyAreThereOrNot) {
  write("there.inp", "*NODE\n");
  write("THERE.inp", "*NODE\n");
  const auto told_of = [&](const std::string& name) -> std::string {
    try {
      (void)read(write("deeper/main.inp", "*INCLUDE, INPUT=" + name + "\n"));
    } catch (const Error& error) {
      std::string told = error.what();
      const std::size_t at = told.find(name);
      return at == std::string::npos ? told : told.replace(at, name.size(), "NAME");
    }
    return "no error";
  };
  fs::create_symlink(folder_ / "there.inp", folder_ / "deeper/to_there.inp");
  fs::create_symlink(folder_ / "none.inp", folder_ / "deeper/to_none.inp");
  fs::create_directory_symlink(folder_, folder_ / "deeper/up");
  const std::string outside = told_of("../there.inp");
  EXPECT_THAT(outside, HasSubstr("'NAME' is outside of the folder"));
  for (const std::string& name : {std::string("../none.inp"), std::string("..\\none.inp"), std::string("..\\There.inp"),
                                  std::string("../none/none.inp"), std::string("to_there.inp"),
                                  std::string("to_none.inp"), std::string("up/none.inp"), std::string("up/there.inp"),
                                  std::string("/etc/hostname"), std::string("/etc/none.inp")}) {
    EXPECT_EQ(told_of(name), outside) << name;
  }
}

TEST_F(IncludedFiles, CountTowardsTheMostBytes) {
  const std::string nodes = "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n";
  const std::string include = "*INCLUDE, INPUT=nodes.inp\n", element = "*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n";
  write("nodes.inp", nodes);
  const auto read_within = [&](const std::string& text, std::uint64_t bytes) {
    const std::string path = write("main.inp", text);
    return read_abaqus(read_file_bytes(path, bytes), {}, {path, "", bytes});
  };
  const std::uint64_t all = include.size() + element.size() + nodes.size();
  EXPECT_EQ(read_within(include + element, all).mesh.cell_count(), 1u);
  expect_error([&] { read_within(include + element, all - 1); }, ErrorCode::kMeshTooLarge, "--max-file-bytes");
  expect_error([&] { read_within(include + include + element, all + include.size()); }, ErrorCode::kMeshTooLarge,
               "each time counted");
}

TEST_F(IncludedFiles, AreNamedWithTheirLines) {
  write("nodes.inp", "*NODE\n1, 0, 0, 0\n2, 1, zero, 0\n");
  expect_error([&] { read(write("main.inp", "*INCLUDE, INPUT=nodes.inp\n")); }, ErrorCode::kFileSyntax,
               "nodes.inp: line 3: expected a coordinate, found 'zero'");
  expect_error([&] { read(write("main.inp", "\n*INCLUDE, INPUT=none.inp\n")); }, ErrorCode::kFileUnreadable,
               "line 2: there is no file 'none.inp' in the folder of");
  expect_error([&] { read(write("main.inp", "*INCLUDE, INPUT=deeper\n")); }, ErrorCode::kFileUnreadable, "no file");
  expect_error([&] { read(write("main.inp", "*INCLUDE\n")); }, ErrorCode::kFileSyntax, "INPUT=...");
}

TEST_F(IncludedFiles, AreFoundAsWindowsNamesThem) {
  write("deeper/nodes.inp", "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n");
  const std::string element = "*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n";
  for (const char* name : {"deeper\\nodes.inp", "DEEPER/Nodes.INP", ".\\Deeper\\NODES.inp"}) {
    EXPECT_EQ(read(write("main.inp", "*INCLUDE, INPUT=" + std::string(name) + "\n" + element)).mesh.cell_count(), 1u);
  }
  write("deeper/NODES.INP", "");
  expect_error([&] { read(write("main.inp", "*INCLUDE, INPUT=deeper\\Nodes.inp\n")); }, ErrorCode::kFileUnreadable,
               "line 1: 2 files are called 'deeper\\Nodes.inp' but for the case of letters");
}

TEST_F(IncludedFiles, NeverIncludeThemselves) {
  write("a.inp", "*INCLUDE, INPUT=deeper/b.inp\n");
  write("deeper/b.inp", "*INCLUDE, INPUT=../a.inp\n");
  expect_error([&] { read((folder_ / "a.inp").string()); }, ErrorCode::kFileSyntax,
               "b.inp: line 1: '../a.inp' includes itself");
  expect_error([&] { read(write("c.inp", "*NODE, INPUT=c.inp\n")); }, ErrorCode::kFileSyntax, "includes itself");
  // Files that include the next one twice: a thousand includes from ten of them.
  for (int i = 0; i < 12; ++i) {
    const std::string next = "*INCLUDE, INPUT=" + std::to_string(i + 1) + ".inp\n";
    write(std::to_string(i) + ".inp", i < 11 ? next + next : std::string("** end\n"));
  }
  expect_error([&] { read((folder_ / "0.inp").string()); }, ErrorCode::kMeshTooLarge, "more than 1000 includes");
}

TEST(ReadAbaqus, RefusesIncludesWithoutAPath) {
  expect_error([] { read_abaqus("*NODE, INPUT=nodes.txt\n"); }, ErrorCode::kFileUnsupported,
               "line 1: the file includes 'nodes.txt', which can't be told from its bytes alone: put its lines here");
}

TEST(ReadAbaqus, NamesLineAndRemedy) {
  const auto expect = [](const std::string& text, ErrorCode code, const std::string& part) {
    SCOPED_TRACE(part);
    expect_error([&] { (void)read_abaqus(text); }, code, part);
  };
  const std::string element = "*ELEMENT, TYPE=C3D4\n";
  expect("*NODE\n1, x\n", ErrorCode::kFileSyntax, "line 2: expected a coordinate, found 'x'");
  expect("*NODE\none, 0\n", ErrorCode::kFileSyntax, "line 2: expected a node's number, found 'one'");
  expect("*NODE, SYSTEM=C\n", ErrorCode::kFileUnsupported, "write rectangular ones");
  expect("*NGEN\n1, 5\n", ErrorCode::kFileUnsupported, "line 1: *NGEN makes or moves");
  expect(kFourNodes + "1, 0, 0, 0\n" + element + "1, 1, 2, 3, 4\n", ErrorCode::kFileSyntax,
         "line 6: node 1 comes twice");
  expect(kFourNodes + "*ELEMENT\n1, 1, 2, 3, 4\n", ErrorCode::kFileSyntax, "TYPE=...");
  expect(kFourNodes + "*ELEMENT, TYPE=C3D13\n", ErrorCode::kMeshUnsupportedCell, "only those of 5 nodes");
  expect(kFourNodes + "*ELEMENT, TYPE=C3D7\n", ErrorCode::kMeshUnsupportedCell, "type C3D7 are not known");
  expect(kFourNodes + element + "1, 1, 2, 3\n*STEP\n", ErrorCode::kFileSyntax,
         "element 1 of type C3D4 has 3 nodes instead");
  expect(kFourNodes + element + "1, 1, 2, 3", ErrorCode::kFileSyntax, "line 7: element 1 of type C3D4 has 3 nodes");
  expect(kFourNodes + element + "1, 1, 2, 3, 4, 5\n", ErrorCode::kFileSyntax, "has more than 4 nodes");
  expect(kFourNodes + element + "1, 1, 2, 3, 9\n", ErrorCode::kMeshIndexOutOfRange, "line 7: an element uses node 9");
  expect("*NODE\n71, 0, nan, 0\n2, 1\n3, 0, 1\n4, 0, 0, 1\n" + element + "1, 71, 2, 3, 4\n", ErrorCode::kMeshNonFinite,
         "line 2: 'nan', a coordinate of node 71, is");
  expect(element + "1, 1, 2, 3, 4\n", ErrorCode::kMeshEmpty, "*NODE");
  expect(kFourNodes + "*ELEMENT, TYPE=S3\n1, 1, 2, 3\n", ErrorCode::kMeshEmpty, "no solid elements");
  expect("*PART\n", ErrorCode::kFileSyntax, "NAME=...");
  expect("*PART, NAME=a\n*END PART\n*PART, NAME=A\n", ErrorCode::kFileSyntax, "line 3: a second part 'A'");
  expect("*INSTANCE, NAME=i, PART=a\n", ErrorCode::kFileSyntax, "put *PART before it");
  expect("*INSTANCE, INSTANCE=i\n", ErrorCode::kFileUnsupported, "from another analysis");
  const std::string instance = "*PART, NAME=a\n*END PART\n*INSTANCE, NAME=i, PART=a\n";
  expect(instance + "0, 0, nan\n", ErrorCode::kMeshNonFinite, "line 4: 'nan'");
  expect(instance + "0, 0, 0\n1, 1, 1, 1, 1, 1, 90\n", ErrorCode::kFileSyntax, "line 5: expected two different points");
  expect(instance + "0\n0\n0\n", ErrorCode::kFileSyntax, "line 6: expected a keyword");
}

TEST(ReadAbaqus, BoundsNodesAndCellsOfAllInstances) {
  MeshLimits limits;
  limits.max_vertices = 10;
  std::string text = "*PART, NAME=a\n" + kOneTet + "*END PART\n*ASSEMBLY, NAME=x\n";
  for (int i = 0; i < 3; ++i) text += "*INSTANCE, NAME=i, PART=a\n*END INSTANCE\n";
  expect_error([&] { read_abaqus(text, limits); }, ErrorCode::kMeshTooLarge, "more than 10 nodes");
  limits.max_vertices = 3;
  expect_error([&] { read_abaqus(kOneTet, limits); }, ErrorCode::kMeshTooLarge, "line 5: more than 3 nodes");
}

}  // namespace
}  // namespace ccslice
