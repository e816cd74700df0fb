// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/vtk_cells.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/base/read_file.h"
#include "core/mesh/validate.h"
#include "core/mesh_files/read_mesh.h"
#include "core/mesh_files/read_vtk.h"
#include "core/mesh_files/read_vtu.h"
#include "core/mesh_import/mesh_file.h"
#include "tests/core/mesh/expect_error.h"

namespace ccslice {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

/// As tests/data/meshes/write_fixtures.py has it.
Vec3 moved_by_bend(const Vec3& u) {
  return 12 * u + Vec3(2 * u.y() * (1 - u.y()), 3 * u.z() * (1 - u.z()), 5 * u.x() * (1 - u.x()));
}

/// Cells of it stand 100 apart, so a corner tells its cell and its coordinates.
Vec3 shift_of(const Vec3& corner) { return Vec3(100 * std::floor(corner.x() / 100), 0, 0); }

template <std::size_t kSize>
Vec3 expected_node(const ControlMesh& mesh, const std::array<std::uint32_t, kSize>& corners) {
  Vec3 middle = Vec3::Zero();
  const Vec3 shift = shift_of(mesh.positions[corners[0]]);
  for (const std::uint32_t corner : corners) middle += (mesh.positions[corner] - shift) / 12 / double{kSize};
  return shift + moved_by_bend(middle);
}

/// Corners are where bends are nothing; every node is where the bend puts the middle of its edge or quadrilateral.
void expect_bent(const ControlMesh& mesh) {
  const MidNodes& nodes = mesh.mid_nodes;
  std::size_t next = 0;
  for (const auto& edge : nodes.edges) {
    EXPECT_EQ(nodes.positions[next++], expected_node(mesh, edge)) << edge[0] << " " << edge[1];
  }
  for (const auto& face : nodes.faces) {
    EXPECT_EQ(nodes.positions[next++], expected_node(mesh, face)) << face[0] << " " << face[3];
  }
  for (const std::uint32_t cell : nodes.cells) {
    std::size_t first = 0;
    for (std::uint32_t i = 0; i < cell; ++i) first += static_cast<std::size_t>(corner_count(mesh.cell_kinds[i]));
    const Vec3 shift = shift_of(mesh.positions[mesh.cell_vertices[first]]);
    EXPECT_EQ(nodes.positions[next++], shift + moved_by_bend(Vec3(0.5, 0.5, 0.5)));
  }
  ASSERT_EQ(next, nodes.positions.size());
}

// Cells of the types 24, 25, 26, 29, 32, 33, 71, 72, 73, 78, 79 and 80, whose points are where VTK says.
TEST(VtkCells, OfSecondOrderHaveTheirNodesWhereVtkPutsThem) {
  constexpr std::uint64_t kMaxBytes = 1 << 20;
  MeshFile file = read_mesh(read_file_bytes(CCSLICE_TEST_DATA_DIR "/meshes/curved_vtk.vtu", kMaxBytes));
  constexpr std::size_t kTets = 3, kWedges = 4, kHexes = 5;
  ASSERT_EQ(file.mesh.cell_count(), kTets + kWedges + kHexes);
  const MidNodes& nodes = file.mesh.mid_nodes;
  EXPECT_EQ(nodes.edges.size(), 6 * kTets + 9 * kWedges + 12 * kHexes);
  EXPECT_EQ(nodes.faces.size(), 3 * (kWedges - 1) + 6 * 3 + 4);
  EXPECT_EQ(nodes.cells.size(), 3u);
  expect_bent(file.mesh);
  ASSERT_THAT(file.mesh.channel_names, ElementsAre("height"));
  for (std::size_t node = 0; node < nodes.positions.size(); ++node) {
    EXPECT_EQ(nodes.values[node], static_cast<float>(nodes.positions[node].z())) << "the value follows the place";
  }
  EXPECT_TRUE(file.warnings.empty());
  EXPECT_NO_THROW(validate(file.mesh));
}

/// A hexahedron of 27 points, its edges as files of that version have them.
std::string hexahedron_of_27(const std::string& version, bool old) {
  std::vector<Vec3> places = {{0, 0, 0},   {1, 0, 0},   {1, 1, 0},   {0, 1, 0},   {0, 0, 1},   {1, 0, 1},   {1, 1, 1},
                              {0, 1, 1},   {.5, 0, 0},  {1, .5, 0},  {.5, 1, 0},  {0, .5, 0},  {.5, 0, 1},  {1, .5, 1},
                              {.5, 1, 1},  {0, .5, 1},  {0, 0, .5},  {1, 0, .5},  {1, 1, .5},  {0, 1, .5},  {0, .5, .5},
                              {1, .5, .5}, {.5, 0, .5}, {.5, 1, .5}, {.5, .5, 0}, {.5, .5, 1}, {.5, .5, .5}};
  if (old) std::swap(places[18], places[19]);
  std::string text = "# vtk DataFile Version " + version + "\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 27 double\n";
  std::string ids;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Vec3 place = moved_by_bend(places[i]);
    for (const double number : place) text += std::to_string(number) + " ";
    ids += " " + std::to_string(i);
  }
  return text +
         (version < "5" ? "\nCELLS 1 28\n27" + ids
                        : "\nCELLS 2 27\nOFFSETS vtktypeint64\n0 27\nCONNECTIVITY vtktypeint64\n" + ids) +
         "\nCELL_TYPES 1\n72\n";
}

TEST(VtkCells, OfVersionsBeforeVtk9HaveTwoEdgesSwapped) {
  expect_bent(read_vtk(hexahedron_of_27("5.1", false)).mesh);
  expect_bent(read_vtk(hexahedron_of_27("4.2", true)).mesh);
  expect_bent(read_vtk(hexahedron_of_27("5.0", true)).mesh);
}

/// A cell of that type whose points lie anywhere.
MeshFile read_cell(int type, int points) {
  std::string text =
      "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS " + std::to_string(points) + " double\n";
  std::string ids;
  for (int i = 0; i < points; ++i) {
    text += std::to_string(i * i) + " " + std::to_string(i) + " 0\n";
    ids += " " + std::to_string(i);
  }
  return read_vtk(text + "CELLS 1 " + std::to_string(points + 1) + "\n" + std::to_string(points) + ids +
                  "\nCELL_TYPES 1\n" + std::to_string(type) + "\n");
}

TEST(VtkCells, OfFirstOrderAreOrdinaryOnes) {
  for (const auto& [type, points] : {std::pair(71, 4), {72, 8}, {73, 6}, {78, 4}, {79, 8}, {80, 6}}) {
    const MeshFile file = read_cell(type, points);
    EXPECT_EQ(file.mesh.cell_vertices.size(), static_cast<std::size_t>(points)) << type;
    EXPECT_TRUE(file.warnings.empty()) << type;
    EXPECT_TRUE(file.mesh.mid_nodes.empty());
  }
}

TEST(VtkCells, OfHigherOrderAreTakenByTheirCorners) {
  for (const auto& [type, points, corners] : {std::array{71, 20, 4},
                                              {72, 64, 8},
                                              {73, 40, 6},
                                              {78, 35, 4},
                                              {79, 12, 8},
                                              {80, 9, 6},
                                              {74, 14, 8},
                                              {72, 125, 8}}) {
    const MeshFile file = read_cell(type, points);
    EXPECT_EQ(file.mesh.cell_vertices.size(), static_cast<std::size_t>(corners)) << type;
    EXPECT_THAT(file.warnings, ElementsAre("1 cell of third order or higher taken by their corners: curved edges "
                                           "become straight. Nodes of second order can be kept: save the mesh in "
                                           "second order"))
        << type << ": its other nodes are nodes that a cell uses";
  }
}

TEST(VtkCells, LeaveOutNodesThatNoPatchTakes) {
  for (const auto& [type, points, edges] : {std::array{73, 21, 9}, {71, 15, 6}, {37, 19, 8}}) {
    const MeshFile file = read_cell(type, points);
    EXPECT_EQ(file.mesh.mid_nodes.edges.size(), static_cast<std::size_t>(edges)) << type;
    EXPECT_THAT(file.warnings,
                Contains("1 cells have nodes in the middle of triangles or of themselves, which are left "
                         "out"))
        << type;
  }
}

TEST(VtkCells, KeepTheNodesThatTheyHave) {
  EXPECT_EQ(read_cell(31, 12).mesh.mid_nodes.edges.size(), 6u) << "a wedge with three straight edges";
  const MidNodes pyramid = read_cell(27, 13).mesh.mid_nodes;
  EXPECT_EQ(pyramid.edges.size(), 8u);
  EXPECT_THAT(pyramid.edges, Contains(std::array{3u, 4u}));
  EXPECT_EQ(pyramid.positions.back(), Vec3(12 * 12, 12, 0)) << "of the edge from 3 to 4";
}

TEST(VtkCells, OfOtherSizesAreRefused) {
  const auto refused = [](int type, int points, const std::string& part) {
    SCOPED_TRACE(part);
    expect_error([&] { read_cell(type, points); }, ErrorCode::kFileSyntax, part);
  };
  refused(72, 9, "VTK type 72, which no degree gives as many points as it lists: 9");
  refused(72, 7, "as it lists: 7");
  refused(71, 11, "as it lists: 11");
  refused(73, 10, "as it lists: 10");
  refused(74, 13, "as it lists: 13");
  refused(12, 20, "which has 8 corners, but lists 20; quadratic cells have types of their own: 24, 25, 26, 29 or 32");
  refused(24, 4, "which has 10 points, but lists 4");
  refused(14, 4, "which has 5 corners, but lists 4");
  expect_error([] { read_cell(41, 8); }, ErrorCode::kMeshUnsupportedCell, "save them as tetrahedra");
  expect_error([] { read_cell(15, 10); }, ErrorCode::kMeshUnsupportedCell,
               "1 cell of VTK type 15, pentagonal prisms (cell 0, counted from 0); only hexahedra");
}

// Two cells that have a control point in common, for one of them in the middle of another edge: each gets its own node.
TEST(VtkCells, ControlPointsOfSeveralEdgesBecomeSeveralNodes) {
  const std::string points = "0 0 0  4 0 0  0 4 0  0 0 4  2 0 1  2 2 0  0 2 0  0 0 2  2 0 2  0 2 2  9 9 9 ";
  const auto read = [&](const std::string& second) {
    return read_vtk("# vtk DataFile Version 5.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 11 double\n" + points +
                    "\nCELLS 3 20\nOFFSETS int\n0 10 20\nCONNECTIVITY int\n0 1 2 3 4 5 6 7 8 9 " + second +
                    "\nCELL_TYPES 2\n78 78\n");
  };
  const MidNodes shared = read("1 0 2 10 4 6 5 8 7 9").mesh.mid_nodes;
  EXPECT_EQ(shared.edges.size(), 9u);
  EXPECT_EQ(shared.positions[0], Vec3(2, 0, 0.5)) << "half of the way to the control point";
  const MeshFile other = read("0 10 2 4 4 6 5 8 7 9");  // A control point as a corner.
  EXPECT_EQ(other.mesh.positions[4], Vec3(2, 0, 1)) << "corners stay";
  EXPECT_EQ(other.mesh.mid_nodes.positions[0], Vec3(2, 0, 0.5));
}

TEST(VtkCells, WithRationalWeightsAreRefusedUnlessTheseAreEqual) {
  std::string text = hexahedron_of_27("5.1", false);
  text.replace(text.rfind("72"), 2, "79");
  const MeshFile plain = read_vtk(text);
  EXPECT_EQ(plain.mesh.mid_nodes.cells.size(), 1u);
  const auto with_weights = [&](const std::string& last) {
    std::string weights = "POINT_DATA 27\nSCALARS RationalWeights double\nLOOKUP_TABLE default\n";
    for (int i = 0; i < 26; ++i) weights += "0.5 ";
    return text + weights + last;
  };
  const MeshFile equal = read_vtk(with_weights("0.5"));
  EXPECT_EQ(equal.mesh.mid_nodes.positions, plain.mesh.mid_nodes.positions);
  for (const char* other : {"0.501", "-0.5"}) {
    expect_error([&] { read_vtk(with_weights(other)); }, ErrorCode::kMeshUnsupportedCell,
                 "1 rational Bezier cell (cell 0, counted from 0; RationalWeights of the first from ");
  }
  std::string lagrange = with_weights("0.501");
  lagrange.replace(lagrange.find("CELL_TYPES 1\n79") + 13, 2, "72");
  EXPECT_NO_THROW(read_vtk(lagrange)) << "the weights of other cells say nothing";
}

TEST(VtkCells, OfVtuFilesWithRationalWeightsAreRefusedByTheirNumbers) {
  const auto file = [](const std::string& attribute, const std::string& name, const std::string& weights) {
    const auto array = [](const std::string& called, const std::string& type, const std::string& values) {
      return "<DataArray type=\"" + type + "\" Name=\"" + called + "\" format=\"ascii\">" + values + "</DataArray>";
    };
    const auto piece = [&](const std::string& data) {
      return "<Piece NumberOfPoints=\"4\" NumberOfCells=\"1\">" + data +
             "<Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 0 1 0 0 0 1"
             "</DataArray></Points><Cells>" +
             array("connectivity", "Int64", "0 1 2 3") + array("offsets", "Int64", "4") +
             array("types", "UInt8", "78") + "</Cells></Piece>";
    };
    return "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\"><UnstructuredGrid>" + piece("") +
           piece("<PointData" + attribute + ">" + array(name, "Float64", weights) + "</PointData>") +
           "</UnstructuredGrid></VTKFile>";
  };
  EXPECT_EQ(read_vtu(file("", "RationalWeights", "1 1 1 1")).mesh.cell_count(), 2u);
  const std::string refusal =
      "1 rational Bezier cell (cell 1, counted from 0; RationalWeights of the first from 0.7 to 1), of which only "
      "those "
      "with equal weights are read; save the part with Lagrange cells of second order";
  for (const auto& [attribute, name] : {std::pair("", "RationalWeights"), std::pair(" RationalWeights=\"w\"", "w")}) {
    expect_error([&] { read_vtu(file(attribute, name, "1 0.7 1 1")); }, ErrorCode::kMeshUnsupportedCell, refusal);
  }
}

TEST(VtkCells, HaveNumbersOfTheFile) {
  const MeshFile file = read_vtk(
      "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 6 float\n9 9 9 0 0 0 1 0 0 0 1 0 8 8 8 "
      "0 0 "
      "1\nCELLS 3 11\n1 1\n4 1 2 3 5\n3 1 2 3\nCELL_TYPES 3\n1\n10\n5\n");
  EXPECT_THAT(file.numbers.vertices, ElementsAre(1, 2, 3, 5));
  EXPECT_THAT(file.numbers.cells, ElementsAre(1));
  EXPECT_EQ(file.numbers.vertex_noun, "point");
  EXPECT_EQ(file.numbers.cell_noun, "cell");
}

std::string legacy_polyhedron(const std::string& stream, int size) {
  return "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 float\n0 0 0 1 0 0 1 1 0 0 1 0 0 0 "
         "1\n"
         "CELLS 1 " +
         std::to_string(size + 1) + "\n" + std::to_string(size) + " " + stream + "\nCELL_TYPES 1\n42\n";
}

// Its number of faces is no point of the file.
TEST(VtkCells, PolyhedraThatAreKnownCellsAreRead) {
  const MeshFile file = read_vtk(legacy_polyhedron("5 4 0 3 2 1 3 0 1 4 3 1 2 4 3 2 3 4 3 3 0 4", 22));
  EXPECT_THAT(file.mesh.cell_vertices, ElementsAre(1, 2, 3, 0, 4, 4, 4, 4)) << "a pyramid";
}

TEST(VtkCells, OtherPolyhedraAreNamed) {
  const auto refused = [](const std::string& stream, int size, ErrorCode code, const std::string& part) {
    SCOPED_TRACE(part);
    expect_error([&] { read_vtk(legacy_polyhedron(stream, size)); }, code, part);
  };
  refused("3 3 0 1 2 3 0 1 4 3 1 2 4", 13, ErrorCode::kMeshUnsupportedCell,
          "cell 0 (from 0), a polyhedron (VTK type 42), is a polyhedron of 3 faces (3 triangles, 0 quadrilaterals)");
  refused("4 3 0 1 2 3 0", 7, ErrorCode::kFileSyntax, "ends within its faces");
  refused("2 3 0 1 2 3 0 1 60", 9, ErrorCode::kMeshIndexOutOfRange, "point id 60; the file has 5 points");
  refused("63 3 0 1 2", 5, ErrorCode::kFileSyntax, "ends within its faces");
  refused("70 3 0 1 2", 5, ErrorCode::kMeshIndexOutOfRange, "point id 70");
}

}  // namespace
}  // namespace ccslice
