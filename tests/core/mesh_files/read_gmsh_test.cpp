// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/read_gmsh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "core/base/read_file.h"
#include "core/mesh/validate.h"
#include "core/mesh_files/read_mesh.h"
#include "tests/core/mesh/expect_error.h"

namespace ccslice {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// The house of the other fixtures, its nodes' tags with gaps, as Gmsh 4.8.4 saved it.
class GmshHouse : public testing::TestWithParam<const char*> {};

TEST_P(GmshHouse, IsReadAsGmshSavedIt) {
  const MeshFile file = read_gmsh(read_file_bytes(CCSLICE_TEST_DATA_DIR "/meshes/" + std::string(GetParam()), 1 << 20));
  ControlMesh mesh = file.mesh;
  ASSERT_EQ(mesh.vertex_count(), 11u);
  EXPECT_EQ(mesh.positions[6], Vec3(12, 12, 12));
  EXPECT_EQ(mesh.positions[10], Vec3(22, 6, 14));
  EXPECT_THAT(mesh.cell_kinds, ElementsAre(CellKind::kTet, CellKind::kHex, CellKind::kWedge));
  EXPECT_THAT(mesh.cell_vertices, ElementsAre(5, 6, 9, 10, 0, 1, 2, 3, 4, 5, 6, 7, 4, 7, 8, 5, 6, 9));
  EXPECT_THAT(mesh.channel_names, ElementsAre("hardness", "mix.0", "mix.1", "mix.2"));
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
    const auto id = static_cast<float>(v);
    const float* row = &mesh.channel_values[4 * v];
    EXPECT_THAT(std::vector(row, row + 4), ElementsAre(20 + 0.5f * id, 0.125f * id, 1 - 0.125f * id, 0.25f));
  }
  EXPECT_THAT(file.warnings,
              ElementsAre(HasSubstr("1 vertex that no cell uses left out"), "2 points, lines and faces left out",
                          HasSubstr("physical groups without cells left out: floor")));
  const bool version_2 = std::string(GetParam()).find("2_2") != std::string::npos;  // Gmsh didn't write groups there.
  EXPECT_EQ(file.cell_sets.size(), version_2 ? 0u : 1u);
  ASSERT_EQ(file.cell_numbers.size(), 1u);
  EXPECT_EQ(file.cell_numbers[0].name, "entity");
  EXPECT_NO_THROW(validate(mesh));
}

INSTANTIATE_TEST_SUITE_P(Files, GmshHouse,
                         testing::Values("gmsh_ascii_2_2.msh", "gmsh_binary_2_2.msh", "gmsh_ascii_4_1.msh",
                                         "gmsh_binary_4_1.msh"),
                         [](const auto& info) {
                           std::string name = info.param;
                           std::replace(name.begin(), name.end(), '.', '_');
                           return name;
                         });

constexpr const char* kTet = R"($MeshFormat
2.2 0 8
$EndMeshFormat
$Comments
anything $EndNodes
$EndComments
$Nodes
4
4 0 0 1
10 0 0 0
7 1 0 0
1000000000007 0 1 0
$EndNodes
$Elements
1
1 4 3 0 1 -2 10 7 1000000000007 4
$EndElements
)";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(ReadGmsh, TakesTagsInAnyOrderAndPassesOverUnknownSections) {
  const MeshFile file = read_gmsh(kTet);
  EXPECT_THAT(file.mesh.cell_vertices, ElementsAre(1, 2, 3, 0));
  EXPECT_EQ(file.mesh.positions[0], Vec3(0, 0, 1));
  EXPECT_TRUE(file.warnings.empty());
}

struct GmshType {
  int number, nodes;
  CellKind kind;
};

class GmshTypes : public testing::TestWithParam<GmshType> {};

TEST_P(GmshTypes, KeepTheirCornersInBothVersions) {
  const auto& [number, nodes, kind] = GetParam();
  const std::string count = std::to_string(nodes), type = std::to_string(number);
  std::string rows, tags, positions, ids;
  for (int n = 1; n <= nodes; ++n) {
    const std::string position = std::to_string(n) + " " + std::to_string(n * n % 7) + " 0\n";
    rows += std::to_string(n) + " " + position;
    tags += std::to_string(n) + "\n";
    positions += position;
    ids += " " + std::to_string(n);
  }
  const std::string old_nodes = "$Nodes\n" + count + "\n" + rows + "$EndNodes\n";
  // In two partitions, which have tags of their own.
  const std::string old_cells = "$Elements\n1\n1 " + type + " 5 0 1 2 1 -2" + ids + "\n$EndElements\n";
  const std::string nodes_4 =
      "$Nodes\n1 " + count + " 1 " + count + "\n3 1 0 " + count + "\n" + tags + positions + "$EndNodes\n";
  const std::string cells_4 = "$Elements\n1 1 1 1\n3 1 " + type + " 1\n1" + ids + "\n$EndElements\n";
  for (const std::string& text : {"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n" + old_nodes + old_cells,
                                  "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PartitionedEntities\n2\n0\n0 0 0 0\n"
                                  "$EndPartitionedEntities\n" +
                                      nodes_4 + cells_4}) {
    const MeshFile file = read_gmsh(text);
    EXPECT_THAT(file.mesh.cell_kinds, ElementsAre(kind));
    ASSERT_EQ(file.mesh.vertex_count(), static_cast<std::size_t>(corner_count(kind)));
    for (std::uint32_t corner = 0; corner < file.mesh.cell_vertices.size(); ++corner) {
      EXPECT_EQ(file.mesh.cell_vertices[corner], corner);
      EXPECT_EQ(file.mesh.positions[corner].x(), corner + 1.0);
    }
    const bool higher = !file.warnings.empty() && file.warnings[0].starts_with("1 cell of third order or higher");
    EXPECT_EQ(file.warnings.size(), higher) << "a cell uses all of its nodes";
    EXPECT_EQ(higher || !file.mesh.mid_nodes.empty(), nodes > corner_count(kind));
  }
}

INSTANTIATE_TEST_SUITE_P(ReadGmsh, GmshTypes,
                         testing::Values(GmshType{4, 4, CellKind::kTet}, GmshType{5, 8, CellKind::kHex},
                                         GmshType{6, 6, CellKind::kWedge}, GmshType{11, 10, CellKind::kTet},
                                         GmshType{12, 27, CellKind::kHex}, GmshType{13, 18, CellKind::kWedge},
                                         GmshType{17, 20, CellKind::kHex}, GmshType{18, 15, CellKind::kWedge},
                                         GmshType{29, 20, CellKind::kTet}, GmshType{71, 84, CellKind::kTet},
                                         GmshType{90, 40, CellKind::kWedge}, GmshType{92, 64, CellKind::kHex},
                                         GmshType{98, 1000, CellKind::kHex}, GmshType{99, 32, CellKind::kHex},
                                         GmshType{111, 24, CellKind::kWedge}, GmshType{137, 16, CellKind::kTet}),
                         [](const auto& info) { return "Type" + std::to_string(info.param.number); });

TEST(ReadGmsh, ReadsPyramidsAsHexahedraWithFourCornersInOne) {
  const MeshFile file = read_gmsh(
      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n5\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n9 0 0 1\n$EndNodes\n"
      "$Elements\n1\n17 7 2 1 1 1 2 3 4 9\n$EndElements\n");
  EXPECT_THAT(file.mesh.cell_kinds, testing::ElementsAre(CellKind::kHex));
  EXPECT_THAT(file.mesh.cell_vertices, testing::ElementsAre(0, 1, 2, 3, 4, 4, 4, 4));
  EXPECT_THAT(file.numbers.cells, testing::ElementsAre(17));
}

TEST(ReadGmsh, RefusesPyramidsOfHigherOrderByTheirTypes) {
  for (const auto& [number, nodes] : {std::pair{14, 14}, {19, 13}, {118, 30}}) {
    std::string cells = "$Elements\n1\n1 " + std::to_string(number) + " 0";
    for (int n = 0; n < nodes; ++n) cells += " 10";
    const std::string text =
        std::string(kTet).substr(0, std::string(kTet).find("$Elements")) + cells + "\n$EndElements\n";
    expect_error([&] { (void)read_gmsh(text); }, ErrorCode::kMeshUnsupportedCell,
                 "is of element type " + std::to_string(number) + "); of pyramids only those of first order are read");
  }
}

TEST(ReadGmsh, TakesSectionsBeforeTheFormat) {
  const std::string comments = "$Comments\n$Nodes and $MeshFormat are no sections here\n$EndComments\n";
  EXPECT_EQ(read_gmsh(comments + comments + kTet).mesh.cell_count(), 1u);
  EXPECT_EQ(read_mesh(comments + kTet).mesh.cell_count(), 1u);
  expect_error([&] { (void)read_gmsh("$Nodes\n0\n$EndNodes\n" + std::string(kTet)); }, ErrorCode::kFileSyntax,
               "line 1: expected '$MeshFormat', found '$Nodes'");
  expect_error([&] { (void)read_gmsh(comments); }, ErrorCode::kFileSyntax, "'$MeshFormat'");
  EXPECT_NE(mesh_file_kind("$ a comment of another format\n$MeshFormats are none\n"), MeshFileKind::kGmsh);
}

TEST(ReadGmsh, TakesParametricNodes) {
  std::string text =
      replaced(replaced(kTet, "$Nodes", "$ParametricNodes"), "\n$EndNodes\n$El", "\n$EndParametricNodes\n$El");
  text = replaced(text, "4 0 0 1\n", "4 0 0 1 0 -7\n");
  text = replaced(text, "10 0 0 0\n", "10 0 0 0 1 7 0.5\n");
  text = replaced(text, "7 1 0 0\n", "7 1 0 0 2 7 0.5 nan\n");
  text = replaced(text, "7 0 1 0\n", "7 0 1 0 3 7\n");
  EXPECT_EQ(read_gmsh(text).mesh.positions, read_gmsh(kTet).mesh.positions);
  expect_error([&] { (void)read_gmsh(replaced(text, "2 7 0.5 nan", "2 7 0.5")); }, ErrorCode::kFileSyntax,
               "line 14: expected '$EndParametricNodes'");
}

TEST(ReadGmsh, SaysThatNumbersAreTooLarge) {
  for (const char* huge : {"9223372036854775808", "18446744073709551616", "99999999999999999999999"}) {
    expect_error([&] { (void)read_gmsh(replaced(kTet, "7 1 0 0", std::string(huge) + " 1 0 0")); },
                 ErrorCode::kFileSyntax,
                 "line 11: expected a node's number, found '" + std::string(huge) + "', which is beyond 2^53");
  }
}

TEST(ReadGmsh, TakesFieldsInPartitions) {
  const auto field = [](int partition, const std::string& rows) {
    return "$NodeData\n1\n\"heat\"\n1\n0.0\n4\n3\n1\n2\n" + std::to_string(partition) + "\n" + rows + "$EndNodeData\n";
  };
  const std::string first = field(1, "4 1\n7 2\n"), second = field(2, "10 3\n1000000000007 4\n");
  const MeshFile file = read_gmsh(kTet + first + second);
  EXPECT_THAT(file.mesh.channel_values, ElementsAre(1, 3, 2, 4));
  EXPECT_TRUE(file.warnings.empty());
  EXPECT_THAT(read_gmsh(kTet + first + replaced(second, "4\n3\n", "4\n8\n")).warnings,
              ElementsAre(HasSubstr("comes again for another time"), HasSubstr("2 vertices have no value")));
  const MeshFile shared = read_gmsh(kTet + first + second + field(3, "7 2\n10 8\n"));
  EXPECT_THAT(shared.mesh.channel_values, ElementsAre(1, 8, 2, 4));
  EXPECT_THAT(shared.warnings, ElementsAre("field 'heat' has other values for nodes that have one already, 1 in all: "
                                           "the last value of a node is taken"));
}

TEST(ReadGmsh, TakesCellsOfSecondOrderByTheirCorners) {
  std::string text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n10\n";
  for (int n = 1; n <= 10; ++n)
    text += std::to_string(n) + " " + std::to_string(n * n % 7) + " " + std::to_string(n % 3) + " 0\n";
  text += "$EndNodes\n$Elements\n1\n1 11 2 0 1 1 2 3 4 5 6 7 8 9 10\n$EndElements\n";
  const MeshFile file = read_gmsh(text);
  EXPECT_THAT(file.mesh.cell_kinds, ElementsAre(CellKind::kTet));
  EXPECT_EQ(file.mesh.vertex_count(), 4u);
  EXPECT_EQ(file.mesh.mid_nodes.edges.size(), 6u);
  EXPECT_TRUE(file.warnings.empty()) << "whoever takes the mesh says what becomes of its nodes";
}

TEST(ReadGmsh, LeavesOutFacesOfAnyOrder) {
  for (const auto& [number, nodes] : {std::pair{36, 16}, {21, 10}, {26, 4}, {51, 121}, {66, 11}}) {
    std::string cells = "$Elements\n2\n2 " + std::to_string(number) + " 0";
    for (int n = 0; n < nodes; ++n) cells += " 10";
    const MeshFile file = read_gmsh(replaced(kTet, "$Elements\n1\n", cells + "\n"));
    EXPECT_EQ(file.mesh.cell_count(), 1u);
    EXPECT_THAT(file.warnings, ElementsAre("1 points, lines and faces left out")) << number;
  }
}

TEST(ReadGmsh, GivesNodesBetweenCornersTheMeanOfTheCornersWhereTheyLackAValue) {
  std::string text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n10\n";
  for (int n = 1; n <= 10; ++n)
    text += std::to_string(n) + " " + std::to_string(n * n % 7) + " " + std::to_string(n % 3) + " 0\n";
  text += "$EndNodes\n$Elements\n1\n1 11 2 0 1 1 2 3 4 5 6 7 8 9 10\n$EndElements\n";
  const MeshFile file =
      read_gmsh(text + "$NodeData\n1\n\"heat\"\n1\n0\n3\n0\n1\n5\n1 1\n2 2\n3 4\n4 8\n5 7\n$EndNodeData\n");
  EXPECT_THAT(file.mesh.channel_values, ElementsAre(1, 2, 4, 8));
  // Edges 0-1, which has a value of its own, 0-2, 0-3, 1-2, 1-3, 2-3.
  EXPECT_THAT(file.mesh.mid_nodes.values, ElementsAre(7, 2.5, 4.5, 3, 5, 6));
}

TEST(ReadGmsh, GivesNodesOfFacesAndInsideTheMeanOfTheirCornersToo) {
  std::string nodes, tags, values;
  for (int n = 1; n <= 27; ++n) {
    nodes += std::to_string(n) + " " + std::to_string(n) + " 0 0\n";
    tags += " " + std::to_string(n);
    if (n <= 8) values += std::to_string(n) + " " + std::to_string(1 << (n - 1)) + "\n";
  }
  const MeshFile file =
      read_gmsh("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n27\n" + nodes + "$EndNodes\n$Elements\n1\n1 12 2 0 1" +
                tags + "\n$EndElements\n$NodeData\n1\n\"heat\"\n1\n0\n3\n0\n1\n8\n" + values + "$EndNodeData\n");
  const std::vector<float>& values_of_nodes = file.mesh.mid_nodes.values;
  ASSERT_EQ(values_of_nodes.size(), 19u);
  // Corners 0 1 2 3, 0 1 4 5, 0 3 4 7, 1 2 5 6, 2 3 6 7, 4 5 6 7, then all.
  EXPECT_THAT(std::vector(values_of_nodes.begin() + 12, values_of_nodes.end()),
              ElementsAre(15 / 4.0f, 51 / 4.0f, 153 / 4.0f, 102 / 4.0f, 204 / 4.0f, 240 / 4.0f, 255 / 8.0f));
}

TEST(ReadGmsh, RefusesNodesBetweenCornersThatAreNone) {
  std::string text =
      replaced(kTet, "1 4 3 0 1 -2 10 7 1000000000007 4", "1 11 0 10 7 1000000000007 4 10 10 10 10 10 5");
  expect_error([&] { (void)read_gmsh(text); }, ErrorCode::kMeshIndexOutOfRange, "a cell uses node 5");
  text = replaced(replaced(text, " 10 5\n", " 10 11\n"), "\n4\n4 0 0 1\n", "\n5\n11 0 nan 1\n4 0 0 1\n");
  expect_error([&] { (void)read_gmsh(text); }, ErrorCode::kMeshNonFinite, "line 9: 'nan'");
}

TEST(ReadGmsh, LeavesOutFieldsThatLackAValueOrComeAgain) {
  const std::string field =
      "$NodeData\n1\n\"hardness\"\n1\n0.0\n3\n0\n1\n4\n4 1\n7 2\n10 3\n1000000000007 4\n$EndNodeData\n";
  const MeshFile twice = read_gmsh(std::string(kTet) + field + field);
  EXPECT_THAT(twice.mesh.channel_values, ElementsAre(1, 3, 2, 4));
  EXPECT_THAT(twice.warnings, ElementsAre(HasSubstr("comes again")));
  const MeshFile lacking = read_gmsh(kTet + replaced(replaced(field, "\n4\n4 1\n", "\n3\n4 1\n"), "10 3\n", ""));
  EXPECT_EQ(lacking.mesh.channel_count(), 0u);
  EXPECT_THAT(lacking.warnings, ElementsAre("field 'hardness' left out: 1 vertices have no value in it"));
  const std::string elements = "$ElementNodeData\n1\n\"stress\"\n1\n0\n3\n0\n1\n1\n1 4 5 5 5 5\n$EndElementNodeData\n";
  EXPECT_THAT(read_gmsh(kTet + elements).warnings, ElementsAre(HasSubstr("($ElementNodeData) left out")));
}

TEST(ReadGmsh, TakesAnyNumbersWhereNoCellIs) {
  const std::string field =
      "$NodeData\n1\n\"hardness\"\n1\n0.0\n3\n0\n1\n5\n3 nan\n4 1\n7 2\n10 3\n1000000000007 4\n$EndNodeData\n";
  const std::string text = replaced(kTet, "\n4\n4 0 0 1\n", "\n5\n3 nan 0 inf\n4 0 0 1\n");
  const MeshFile file = read_gmsh(text + field);
  EXPECT_EQ(file.mesh.vertex_count(), 4u);
  EXPECT_THAT(file.mesh.channel_values, ElementsAre(1, 3, 2, 4));
  EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("1 vertex that no cell uses left out")));
  expect_error([&] { (void)read_gmsh(text + replaced(field, "10 3", "10 1e99")); }, ErrorCode::kMeshNonFinite,
               "line 31: '1e99', a value of node 10, ");
}

/// Gmsh itself wrote dimensions there, other programs don't, and ElmerGrid leaves no blank before the name.
TEST(ReadGmsh, ReadsNamesOfVersion2_0) {
  for (const char* version : {"2.0", "2"}) {
    const std::string in_group = replaced(kTet, "1 4 3 0 1 -2", "1 4 3 1 1 -2");
    const std::string old = replaced(in_group, "2.2 0 8", std::string(version) + " 0 8");
    const auto name_of = [&](const std::string& names) {
      const MeshFile file =
          read_gmsh(replaced(old, "$Elements", "$PhysicalNames\n" + names + "$EndPhysicalNames\n$Elements"));
      return file.cell_sets.empty() ? "" : file.cell_sets.front().name;
    };
    EXPECT_EQ(name_of("2\n       1\"body 1\"\n  300 \"other\"\n"), "body 1") << version;
    EXPECT_EQ(name_of("2\n2 1 \"face\"\n3 1 \"My volume\"\n"), "My volume") << version;
    for (const char* broken : {"1\nbody\n", "1\n\"body\"\n", "1\n3 1 2 \"body\"\n", "1\nx 1 \"body\"\n"}) {
      expect_error([&] { (void)name_of(broken); }, ErrorCode::kFileSyntax,
                   "expected a physical group's tag and a name in quotes");
    }
  }
}

TEST(ReadGmsh, LeavesOutFieldsWithLongNames) {
  const std::string name(300, 'x');
  const std::string field =
      "$NodeData\n1\n\"" + name + "\"\n1\n0.0\n3\n0\n1\n4\n4 1\n7 2\n10 3\n1000000000007 4\n$EndNodeData\n";
  const MeshFile file = read_gmsh(kTet + field);
  EXPECT_EQ(file.mesh.channel_count(), 0u);
  EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("a name of 300 bytes, at most 256 are allowed")));
}

TEST(ReadGmsh, NamesLineAndRemedy) {
  const auto expect = [](const std::string& text, ErrorCode code, const std::string& part) {
    SCOPED_TRACE(part);
    expect_error([&] { (void)read_gmsh(text); }, code, part);
  };
  const std::string tet = kTet;
  expect(replaced(tet, "2.2 0 8", "4 0 8"), ErrorCode::kFileUnsupported, "gmsh -format msh41");
  expect(replaced(tet, "2.2 0 8", "1.0 0 8"), ErrorCode::kFileUnsupported, "line 2: MSH version 1.0");
  EXPECT_NO_THROW(read_gmsh(replaced(tet, "2.2 0 8", "2.2 0 4"))) << "text has no such numbers";
  expect(replaced(tet, "2.2 0 8", "2.2 1 4"), ErrorCode::kFileUnsupported, "a binary file with numbers of 4 bytes");
  expect(replaced(tet, "$EndMeshFormat", "$End"), ErrorCode::kFileSyntax, "line 3: expected '$EndMeshFormat'");
  expect(replaced(tet, "7 1 0 0", "7 1 x 0"), ErrorCode::kFileSyntax, "line 11: expected a coordinate, found 'x'");
  expect(replaced(tet, "7 1 0 0", "7 1 nan 0"), ErrorCode::kMeshNonFinite, "line 11");
  expect(replaced(tet, "7 1 0 0", "10 1 0 0"), ErrorCode::kFileSyntax, "line 11: node 10 comes twice");
  expect(replaced(tet, "-2 10 7", "-2 11 7"), ErrorCode::kMeshIndexOutOfRange, "line 16: a cell uses node 11");
  expect(replaced(tet, "1 4 3 0", "1 999 3 0"), ErrorCode::kMeshUnsupportedCell, "line 16: element type 999");
  expect(replaced(tet, "1 4 3 0 1 -2 10 7 1000000000007 4", "1 2 2 0 1 10 7 4"), ErrorCode::kMeshEmpty, "gmsh -3");
  expect(replaced(tet, "$Nodes", "$Knots"), ErrorCode::kFileSyntax,
         "expected '$EndKnots', found 'the end of the file'");
  expect(replaced(tet, "\n4\n4 0 0 1", "\n99999999\n4 0 0 1"), ErrorCode::kMeshTooLarge, "line 8");
  expect("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n", ErrorCode::kMeshEmpty, "$Nodes");
  expect(tet + "stray", ErrorCode::kFileSyntax, "expected a section");
  expect(tet + "$Nodes\n0\n$EndNodes\n", ErrorCode::kFileSyntax, "only one $Nodes section");
}

/// The first bytes of a binary file.
std::string binary_header(bool swapped) {
  std::string one("\1\0\0\0", 4);
  if (swapped) std::reverse(one.begin(), one.end());
  return "$MeshFormat\n2.2 1 8\n" + one + "\n$EndMeshFormat\n";
}

template <typename Number>
std::string bytes_of(Number number, bool swapped) {
  const auto raw = std::bit_cast<std::array<char, sizeof(Number)>>(number);
  std::string bytes(raw.begin(), raw.end());
  if (swapped) std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

std::string binary_tet(bool swapped) {
  std::string text = binary_header(swapped) + "$Nodes\n4\n";
  for (std::int32_t n = 0; n < 4; ++n) {
    text += bytes_of(n + 1, swapped);
    for (int axis = 0; axis < 3; ++axis) text += bytes_of(n == axis + 1 ? 1.5 : 0.0, swapped);
  }
  text += "\n$EndNodes\n$Elements\n1\n";
  for (const std::int32_t number : {4, 1, 2, 1, 0, 1, 1, 2, 3, 4}) text += bytes_of(number, swapped);
  return text + "\n$EndElements\n";
}

TEST(ReadGmsh, TakesBothByteOrders) {
  for (const bool swapped : {false, true}) {
    const MeshFile file = read_gmsh(binary_tet(swapped));
    EXPECT_THAT(file.mesh.positions, ElementsAre(Vec3(0, 0, 0), Vec3(1.5, 0, 0), Vec3(0, 1.5, 0), Vec3(0, 0, 1.5)));
    EXPECT_THAT(file.mesh.cell_vertices, ElementsAre(0, 1, 2, 3));
  }
}

TEST(ReadGmsh, NamesTheByteInABinaryFile) {
  const std::string whole = binary_tet(false);
  expect_error([&] { (void)read_gmsh(whole.substr(0, 90)); }, ErrorCode::kFileSyntax, "byte ");
  expect_error([&] { (void)read_gmsh(replaced(whole, std::string("\1\0\0\0", 4), "abcd")); }, ErrorCode::kFileSyntax,
               "the number 1");
  expect_error([&] { (void)read_gmsh(replaced(whole, "$Elements\n1\n", "$Elements\n2\n")); },
               ErrorCode::kMeshUnsupportedCell, "byte ");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  expect_error([&] { (void)read_gmsh(replaced(whole, bytes_of(1.5, false), bytes_of(nan, false))); },
               ErrorCode::kMeshNonFinite, "finite");
}

}  // namespace
}  // namespace ccslice
