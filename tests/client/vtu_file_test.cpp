// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/vtu_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/mesh/read_vtu.h"
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

}  // namespace
}  // namespace ccslice::cli
