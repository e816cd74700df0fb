// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/cell_averages.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "core/mesh/region_values.h"
#include "core/mesh_files/read_vtk.h"
#include "tests/core/mesh/expect_error.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

using testing::ElementsAre;
using testing::FloatNear;

/// A hexahedron of 2 x 3 x 4 and, on its face x = 2, a wedge of a quarter of its volume; a tetrahedron on top of that.
MeshFile three_cells() {
  MeshFile file;
  file.mesh.positions = {{0, 0, 0}, {2, 0, 0}, {2, 3, 0}, {0, 3, 0}, {0, 0, 4}, {2, 0, 4},
                         {2, 3, 4}, {0, 3, 4}, {3, 0, 0}, {3, 0, 4}, {2, 0, 8}};
  file.mesh.cell_kinds = {CellKind::kHex, CellKind::kWedge, CellKind::kTet};
  file.mesh.cell_vertices = {0, 1, 2, 3, 4, 5, 6, 7, 1, 8, 2, 5, 9, 6, 5, 9, 6, 10};
  file.cell_numbers = {{"density", {1, 2, 8}}};
  return file;
}

TEST(CellAverages, AreWeightedByVolume) {
  MeshFile file = three_cells();
  file.mesh.channel_names = {"other"};
  for (int v = 0; v < 11; ++v) file.mesh.channel_values.push_back(static_cast<float>(v));
  average_cell_numbers("density", MeanOver::kAllCells, file);
  EXPECT_THAT(file.mesh.channel_names, ElementsAre("other", "density"));
  std::vector<float> density;
  for (std::size_t v = 0; v < 11; ++v) {
    EXPECT_EQ(file.mesh.channel_values[2 * v], static_cast<float>(v));
    density.push_back(file.mesh.channel_values[2 * v + 1]);
  }
  // Volumes 24, 6 and 2.
  const float hex_wedge = (24 * 1 + 6 * 2) / 30.0f, all = (24 * 1 + 6 * 2 + 2 * 8) / 32.0f;
  const float wedge_tet = (6 * 2 + 2 * 8) / 8.0f;
  EXPECT_THAT(density, ElementsAre(1, FloatNear(hex_wedge, 1e-6f), FloatNear(hex_wedge, 1e-6f), 1, 1,
                                   FloatNear(all, 1e-6f), FloatNear(all, 1e-6f), 1, 2, FloatNear(wedge_tet, 1e-6f), 8));
}

TEST(CellAverages, TurnedAndFlatCellsCountToo) {
  MeshFile file = three_cells();
  for (Vec3& p : file.mesh.positions) p.z() = -p.z();
  average_cell_numbers("density", MeanOver::kAllCells, file);
  EXPECT_FLOAT_EQ(file.mesh.channel_values[5], 1.625f);
  MeshFile flat = three_cells();
  for (Vec3& p : flat.mesh.positions) p.z() = 0;
  average_cell_numbers("density", MeanOver::kAllCells, flat);
  EXPECT_FLOAT_EQ(flat.mesh.channel_values[5], 11 / 3.0f);
}

TEST(CellAverages, OfAConstantAreConstant) {
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    MeshFile file;
    file.mesh = mesh;
    file.cell_numbers = {{"new", std::vector<double>(mesh.cell_count(), 0.1)}};
    average_cell_numbers("new", MeanOver::kAllCells, file);
    const std::size_t channels = file.mesh.channel_count();
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
      ASSERT_FLOAT_EQ(file.mesh.channel_values[channels * v + channels - 1], 0.1f) << name;
    }
  }
}

// Two channels by region, and one over all cells between them.
TEST(CellAverages, OfRegionsJump) {
  MeshFile file = three_cells();
  file.mesh.cell_region_names = {"a", "b"};
  file.mesh.cell_regions = {1, 0, 0};
  file.cell_numbers.push_back({"mass", {10, 20, 80}});
  file.cell_numbers.push_back({"all", {1, 2, 8}});
  average_cell_numbers("density", MeanOver::kEachRegion, file);
  average_cell_numbers("all", MeanOver::kAllCells, file);
  average_cell_numbers("mass", MeanOver::kEachRegion, file);
  const ControlMesh& mesh = file.mesh;
  EXPECT_THAT(mesh.region_value_vertices, ElementsAre(1, 2, 5, 6));
  EXPECT_THAT(mesh.region_value_regions, ElementsAre(0, 0, 0, 0));
  const float wedge_tet = (6 * 2 + 2 * 8) / 8.0f, hex_wedge = (24 * 1 + 6 * 2) / 30.0f;
  const float all = (24 * 1 + 6 * 2 + 2 * 8) / 32.0f;
  EXPECT_THAT(values_in_region(mesh, 1, 1), ElementsAre(1, FloatNear(hex_wedge, 1e-6f), 10));
  EXPECT_THAT(values_in_region(mesh, 1, 0), ElementsAre(2, FloatNear(hex_wedge, 1e-6f), 20));
  EXPECT_THAT(values_in_region(mesh, 5, 1), ElementsAre(1, FloatNear(all, 1e-6f), 10));
  EXPECT_THAT(values_in_region(mesh, 5, 0),
              ElementsAre(FloatNear(wedge_tet, 1e-6f), FloatNear(all, 1e-6f), FloatNear(10 * wedge_tet, 1e-5f)));
  EXPECT_THAT(values_in_region(mesh, 10, 0), ElementsAre(8, 8, 80));
}

TEST(CellAverages, RefuseWhatIsNoNumberOrTaken) {
  MeshFile file = three_cells();
  expect_error([&] { average_cell_numbers("mass", MeanOver::kAllCells, file); }, ErrorCode::kMeshBadChannel,
               "no numbers called 'mass' for its cells; it has numbers called 'density'");
  expect_error([&] { average_cell_numbers("density", MeanOver::kEachRegion, file); }, ErrorCode::kMeshBadCellRegion,
               "means of each region of 'density' need cell regions");
  file.cell_numbers[0].of_cells = {1, std::nan(""), 1e39};
  expect_error([&] { average_cell_numbers("density", MeanOver::kAllCells, file); }, ErrorCode::kMeshNonFinite,
               "'density' is no finite float in cells 1, 2");
  file.mesh.channel_names = {"density"};
  expect_error([&] { average_cell_numbers("density", MeanOver::kAllCells, file); }, ErrorCode::kMeshBadChannel,
               "already");
}

}  // namespace
}  // namespace ccslice
