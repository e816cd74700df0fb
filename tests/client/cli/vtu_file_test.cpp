// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/meshes/vtu_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <string>
#include <vector>

#include "core/mesh_files/read_vtu.h"
#include "core/mesh_import/cell_numbers.h"
#include "tests/support/finite_elements.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::cli {
namespace {

using testing::HasSubstr;

void expect_same(const ControlMesh& read, const ControlMesh& mesh) {
  EXPECT_EQ(read.positions, mesh.positions);
  EXPECT_EQ(read.channel_names, mesh.channel_names);
  EXPECT_EQ(read.channel_values, mesh.channel_values);
  EXPECT_EQ(read.cell_kinds, mesh.cell_kinds);
  EXPECT_EQ(read.cell_vertices, mesh.cell_vertices);
}

TEST(VtuFile, ReadsBackToTheBit) {
  for (const char* name : {"single_hex", "hex_wedge_tet", "cube_of_tets", "single_wedge"}) {
    const ControlMesh& mesh = oracle::tiny_mesh(name);
    expect_same(read_vtu(to_vtu(mesh)).mesh, mesh);
  }
}

TEST(VtuFile, TakesAnyNameAChannelMayHave) {
  ControlMesh mesh = oracle::box_mesh(1, 1, 1);
  mesh.channel_names = {"Härte <a> & \"b\""};
  mesh.channel_values.assign(8, 0.1f);
  expect_same(read_vtu(to_vtu(mesh)).mesh, mesh);
}

TEST(VtuFile, KeepsTheNamesOfCellRegions) {
  ControlMesh mesh = oracle::box_mesh(4, 1, 1);
  mesh.cell_region_names = {"shell", "Kern, <hart> & \"b\"", "10"};
  mesh.cell_regions = {2, 0, 1, 0};
  const std::string text = to_vtu(mesh);
  EXPECT_THAT(text, HasSubstr("<FieldData>\n<DataArray type=\"UInt8\" Name=\"cell_region:shell\" NumberOfTuples=\"1\" "
                              "format=\"ascii\">0</DataArray>"));
  MeshFile file = read_vtu(text);
  EXPECT_TRUE(file.warnings.empty());
  make_cell_regions("cell_region", file);
  EXPECT_EQ(file.mesh.cell_region_names, mesh.cell_region_names);
  EXPECT_EQ(file.mesh.cell_regions, mesh.cell_regions);
  BezierCells cells;
  cells.cell_regions = {1};
  EXPECT_THAT(to_vtu(cells, {}, {"a", "b"}), HasSubstr("Name=\"cell_region:b\" NumberOfTuples=\"1\""));
  EXPECT_THAT(to_vtu(oracle::box_mesh(1, 1, 1)), testing::Not(HasSubstr("FieldData")));
}

TEST(VtuFile, HasOtherNamesForOtherRegionsAndChannelsWhateverXmlCanHold) {
  ControlMesh mesh = oracle::box_mesh(6, 1, 1);
  mesh.cell_region_names = {
      "a\x01"
      "b",
      "a\x02"
      "b",
      "a?b",
      "tab\there",
      "two\nlines\r",
      "M\xfcnchen"};
  mesh.cell_regions = {0, 1, 2, 3, 4, 5};
  mesh.channel_names = {"c\x1f", "c?", "c\x7f"};
  mesh.channel_values.assign(3 * mesh.vertex_count(), 0.5f);
  MeshFile file = read_vtu(to_vtu(mesh));
  EXPECT_TRUE(file.warnings.empty()) << file.warnings.front();
  EXPECT_THAT(file.mesh.channel_names, testing::ElementsAre("c?_2", "c?", "c\x7f"));
  make_cell_regions("cell_region", file);
  EXPECT_THAT(file.mesh.cell_region_names,
              testing::ElementsAre("a?b_2", "a?b_3", "a?b", "tab\there", "two\nlines\r", "M?nchen"));
  EXPECT_EQ(file.mesh.cell_regions, mesh.cell_regions);
}

/// "Man" and its beginnings [RFC 4648]: one array of one, two and three bytes behind a header of eight.
TEST(VtuFile, PadsBase64) {
  ControlMesh mesh = oracle::box_mesh(1, 1, 1);
  EXPECT_THAT(to_vtu(mesh), HasSubstr("format=\"binary\">AQAAAAAAAAAM</DataArray>")) << "types: one hexahedron, 12";
  mesh = oracle::box_mesh(2, 1, 1);
  EXPECT_THAT(to_vtu(mesh), HasSubstr("format=\"binary\">AgAAAAAAAAAMDA==</DataArray>"));
  mesh = oracle::box_mesh(3, 1, 1);
  EXPECT_THAT(to_vtu(mesh), HasSubstr("format=\"binary\">AwAAAAAAAAAMDAw=</DataArray>"));
}

TEST(VtuFile, NamesControlCells) {
  const ControlMesh mesh = oracle::box_mesh(2, 1, 1);
  const std::string text = to_vtu(mesh, std::vector<std::uint32_t>{0, 1});
  EXPECT_THAT(text, HasSubstr("<CellData>\n<DataArray type=\"UInt32\" Name=\"control_cell\" NumberOfComponents=\"1\" "
                              "format=\"binary\">CAAAAAAAAAAAAAAAAQAAAA==</DataArray></CellData>"));
  EXPECT_THAT(to_vtu(mesh), testing::Not(HasSubstr("CellData")));
}

/// The whole numbers of an array, behind its header.
std::vector<std::int64_t> int64s_of(const std::string& text, const std::string& name) {
  const std::size_t begin = text.find('>', text.find("Name=\"" + name + "\"")) + 1;
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned bits = 0, count = 0;
  for (std::size_t at = begin; text[at] != '<' && text[at] != '='; ++at) {
    bits = bits << 6 | static_cast<unsigned>(digits.find(text[at]));
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes += static_cast<char>(bits >> count & 0xff);
  }
  std::vector<std::int64_t> numbers(bytes.size() / 8);
  std::memcpy(numbers.data(), bytes.data(), 8 * numbers.size());
  numbers.erase(numbers.begin());
  return numbers;
}

/// In the order of VTK 9 [vtkHigherOrderHexahedron::PointIndexFromIJK]; plain ones in that of a hexahedron.
TEST(VtuFile, HasBezierCellsInVtksOrder) {
  BezierCells cells;
  for (std::uint32_t p = 0; p < 72; ++p) {
    cells.points.emplace_back(p, 0, 0);
    cells.cell_points.push_back(p);
  }
  cells.cell_orders = {3, 1};
  cells.control_cells = {5, 6};
  const std::string text = to_vtu(cells, {});
  EXPECT_THAT(text, HasSubstr("version=\"2.1\""));
  const std::vector<std::int64_t> points = int64s_of(text, "connectivity");
  ASSERT_EQ(points.size(), 72u);
  const auto expect_at = [&](std::size_t place, int i, int j, int k) {
    EXPECT_EQ(points[place], i + 4 * j + 16 * k) << place;
  };
  expect_at(0, 0, 0, 0), expect_at(1, 3, 0, 0), expect_at(2, 3, 3, 0), expect_at(3, 0, 3, 0), expect_at(6, 3, 3, 3);
  expect_at(8, 1, 0, 0), expect_at(9, 2, 0, 0), expect_at(10, 3, 1, 0), expect_at(12, 1, 3, 0), expect_at(14, 0, 1, 0);
  expect_at(16, 1, 0, 3), expect_at(24, 0, 0, 1), expect_at(26, 3, 0, 1), expect_at(28, 3, 3, 1);
  expect_at(30, 0, 3, 1), expect_at(32, 0, 1, 1), expect_at(33, 0, 2, 1), expect_at(36, 3, 1, 1);
  expect_at(40, 1, 0, 1), expect_at(44, 1, 3, 1), expect_at(48, 1, 1, 0), expect_at(50, 1, 2, 0);
  expect_at(52, 1, 1, 3), expect_at(56, 1, 1, 1), expect_at(57, 2, 1, 1), expect_at(58, 1, 2, 1),
      expect_at(63, 2, 2, 2);
  EXPECT_EQ(points[64 + 2], 64 + 3) << "corners of a plain hexahedron";
  EXPECT_THAT(text, HasSubstr("format=\"binary\">AgAAAAAAAABPDA==</DataArray>")) << "types: 79, 12";
  EXPECT_THAT(text, HasSubstr("<CellData HigherOrderDegrees=\"HigherOrderDegrees\">"));
  EXPECT_THAT(text, HasSubstr("Name=\"HigherOrderDegrees\" NumberOfComponents=\"3\" "
                              "format=\"binary\">BgAAAAAAAAADAwMBAQE=</DataArray>"));
}

TEST(VtuFile, KeepsNodesOfEdgesAlone) {
  for (const char* name : {"single_hex", "hex_wedge_tet", "cube_of_tets", "single_wedge"}) {
    ControlMesh mesh = oracle::tiny_mesh(name);
    mesh.as_meshed = true;
    oracle::add_random_mid_nodes(0.1, false, 1, mesh);
    ASSERT_TRUE(vtu_keeps_mid_nodes(mesh)) << name;
    MeshFile file = read_vtu(to_vtu(mesh));
    EXPECT_TRUE(file.warnings.empty()) << name;
    EXPECT_EQ(file.mesh.positions, mesh.positions);
    EXPECT_EQ(file.mesh.channel_values, mesh.channel_values);
    EXPECT_EQ(file.mesh.cell_vertices, mesh.cell_vertices);
    EXPECT_EQ(file.mesh.mid_nodes.edges, mesh.mid_nodes.edges) << name;
    EXPECT_EQ(file.mesh.mid_nodes.positions, mesh.mid_nodes.positions) << name;
    EXPECT_EQ(file.mesh.mid_nodes.values, mesh.mid_nodes.values) << name;
    mesh.mid_nodes.edges.pop_back();
    mesh.mid_nodes.positions.pop_back();
    mesh.mid_nodes.values.resize(mesh.mid_nodes.positions.size() * mesh.channel_count());
    EXPECT_FALSE(vtu_keeps_mid_nodes(mesh)) << name;
    EXPECT_TRUE(read_vtu(to_vtu(mesh)).mesh.mid_nodes.empty()) << name;
  }
  ControlMesh mesh = oracle::tiny_mesh("single_hex");
  oracle::add_random_mid_nodes(0.1, true, 1, mesh);
  EXPECT_FALSE(vtu_keeps_mid_nodes(mesh));
}

}  // namespace
}  // namespace ccslice::cli
