// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The same house as other tools write it, file for file (tests/data/meshes/write_fixtures.py).

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "core/base/read_file.h"
#include "core/mesh/validate.h"
#include "core/mesh_files/read_mesh.h"
#include "core/mesh_import/mesh_file.h"

namespace ccslice {
namespace {

using testing::ElementsAre;

ControlMesh house() {
  ControlMesh mesh;
  mesh.positions = {{0, 0, 0},    {12, 0, 0},  {12, 12, 0}, {0, 12, 0},  {0, 0, 12}, {12, 0, 12},
                    {12, 12, 12}, {0, 12, 12}, {0, 6, 20},  {12, 6, 20}, {22, 6, 14}};
  mesh.cell_kinds = {CellKind::kHex, CellKind::kWedge, CellKind::kTet};
  mesh.cell_vertices = {0, 1, 2, 3, 4, 5, 6, 7, 4, 7, 8, 5, 6, 9, 5, 6, 9, 10};
  return mesh;
}

float hardness(std::size_t vertex) { return 20 + 0.5f * static_cast<float>(vertex); }
std::vector<float> mix(std::size_t vertex) {
  const float share = 0.125f * static_cast<float>(vertex);
  return {share, 1 - share, 0.25f};
}

enum class Channels { kNone, kHardnessAndMix, kNoBits, kAll };

struct Fixture {
  const char* name;
  Channels channels;
};

void expect_channels(const ControlMesh& mesh, Channels channels) {
  if (channels == Channels::kNone) {
    EXPECT_EQ(mesh.channel_count(), 0u);
    return;
  }
  std::vector<std::string> names = {"hardness", "mix.0", "mix.1", "mix.2"};
  const bool counted = channels == Channels::kAll || channels == Channels::kNoBits;
  if (counted) names.insert(names.end(), {"count.0", "count.1"});
  if (channels == Channels::kAll) names.emplace_back("bits");
  ASSERT_EQ(mesh.channel_names, names);
  for (std::size_t vertex = 0; vertex < mesh.vertex_count(); ++vertex) {
    std::vector<float> expected = {hardness(vertex)};
    for (const float share : mix(vertex)) expected.push_back(share);
    const auto id = static_cast<float>(vertex);
    if (counted) expected.insert(expected.end(), {id, -id});
    if (channels == Channels::kAll) expected.push_back(static_cast<float>(vertex % 2));
    const auto row = mesh.channel_values.begin() + static_cast<std::ptrdiff_t>(vertex * names.size());
    EXPECT_TRUE(std::equal(expected.begin(), expected.end(), row)) << vertex;
  }
}

/// The vertices of each cell in ascending order.
std::vector<std::vector<std::uint32_t>> sorted_cells(const ControlMesh& mesh) {
  std::vector<std::vector<std::uint32_t>> cells;
  auto at = mesh.cell_vertices.begin();
  for (const CellKind kind : mesh.cell_kinds) {
    cells.emplace_back(at, at + corner_count(kind));
    std::sort(cells.back().begin(), cells.back().end());
    at += corner_count(kind);
  }
  return cells;
}

class MeshFixtures : public testing::TestWithParam<Fixture> {};

TEST_P(MeshFixtures, AreReadWhole) {
  constexpr std::uint64_t kMaxBytes = 1 << 20;
  MeshFile file =
      read_mesh(read_file_bytes(CCSLICE_TEST_DATA_DIR "/meshes/" + std::string(GetParam().name), kMaxBytes));
  const ControlMesh expected = house();
  EXPECT_EQ(file.mesh.positions, expected.positions);
  EXPECT_EQ(file.mesh.cell_kinds, expected.cell_kinds);
  expect_channels(file.mesh, GetParam().channels);
  // meshio has wedges in an order of its own, the mirrored one; polyhedra don't say which corner comes first.
  const std::vector<std::uint32_t> as_read = file.mesh.cell_vertices;
  const bool mirrored =
      std::string(GetParam().name).starts_with("meshio") && GetParam().name != std::string("meshio.mesh");
  EXPECT_NO_THROW(validate(file.mesh));
  EXPECT_EQ(file.mesh.cell_vertices != as_read, mirrored) << "cells were turned round";
  if (std::string(GetParam().name).starts_with("vtk")) {
    EXPECT_EQ(as_read, expected.cell_vertices);
  }
  EXPECT_EQ(sorted_cells(file.mesh), sorted_cells(expected));
}

INSTANTIATE_TEST_SUITE_P(
    Tools, MeshFixtures,
    testing::Values(
        Fixture{"vtk_ascii_4_2.vtk", Channels::kAll}, Fixture{"vtk_ascii_5_1.vtk", Channels::kAll},
        Fixture{"vtk_binary_4_2.vtk", Channels::kAll}, Fixture{"vtk_binary_5_1.vtk", Channels::kAll},
        Fixture{"meshio_ascii_5_1.vtk", Channels::kHardnessAndMix},
        Fixture{"meshio_binary_5_1.vtk", Channels::kHardnessAndMix}, Fixture{"meshio_from_abaqus.vtk", Channels::kNone},
        Fixture{"meshio.mesh", Channels::kNone}, Fixture{"vtk_ascii.vtu", Channels::kNoBits},
        Fixture{"vtk_binary.vtu", Channels::kNoBits}, Fixture{"vtk_binary_zlib.vtu", Channels::kNoBits},
        Fixture{"vtk_binary_big_endian.vtu", Channels::kNoBits}, Fixture{"vtk_appended_raw.vtu", Channels::kNoBits},
        Fixture{"vtk_appended_raw_zlib.vtu", Channels::kNoBits}, Fixture{"vtk_appended_base64.vtu", Channels::kNoBits},
        Fixture{"vtk_appended_base64_zlib.vtu", Channels::kNoBits}, Fixture{"vtk_binary_lz4.vtu", Channels::kNoBits},
        Fixture{"vtk_appended_raw_lzma.vtu", Channels::kNoBits}, Fixture{"polyhedra_vtk.vtu", Channels::kNone},
        Fixture{"polyhedra_vtk_2_3.vtu", Channels::kNone}, Fixture{"polyhedra_vtk_5_1.vtk", Channels::kNone},
        Fixture{"meshio_binary_zlib.vtu", Channels::kHardnessAndMix},
        Fixture{"meshio_binary.vtu", Channels::kHardnessAndMix}, Fixture{"meshio_ascii.vtu", Channels::kHardnessAndMix},
        Fixture{"house.inp", Channels::kNone}, Fixture{"house.ovm", Channels::kAll},
        Fixture{"exodus_classic.e", Channels::kHardnessAndMix},
        Fixture{"exodus_64_bit_offset.e", Channels::kHardnessAndMix},
        Fixture{"exodus_64_bit_data.e", Channels::kHardnessAndMix}),
    [](const auto& info) {
      std::string name = info.param.name;
      std::replace(name.begin(), name.end(), '.', '_');
      return name;
    });

TEST(MeshFixtures, SayWhatIsLeftOut) {
  constexpr std::uint64_t kMaxBytes = 1 << 20;
  const auto warnings = [&](const char* name) {
    return read_mesh(read_file_bytes(CCSLICE_TEST_DATA_DIR "/meshes/" + std::string(name), kMaxBytes)).warnings;
  };
  EXPECT_THAT(warnings("vtk_binary_5_1.vtk"), ElementsAre("point data 'up' left out", "point data 'names' left out",
                                                          testing::HasSubstr("1 points, lines or faces")));
  EXPECT_THAT(warnings("house.ovm"), ElementsAre("property 'feature edges' (EProp int) left out",
                                                 "property 'author' (MProp string) left out"));
}

}  // namespace
}  // namespace ccslice
