// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/cell_numbers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/mesh/read_medit.h"
#include "core/mesh/read_vtk.h"
#include "tests/core/mesh/expect_error.h"

namespace ccslice {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

MeshFile numbered(const std::vector<std::int64_t>& numbers) {
  MeshFile file;
  file.mesh.cell_kinds.assign(numbers.size(), CellKind::kHex);
  file.cell_numbers = {{"part", std::vector<std::int64_t>(numbers.size(), 1)}, {"material", numbers}};
  return file;
}

TEST(CellNumbers, MakeRegionsInAscendingOrder) {
  MeshFile file = numbered({7, -2, 7, 10});
  make_cell_regions("material", file);
  EXPECT_THAT(file.mesh.cell_region_names, ElementsAre("-2", "7", "10"));
  EXPECT_THAT(file.mesh.cell_regions, ElementsAre(1, 0, 1, 2));
  make_cell_regions("part", file);
  EXPECT_THAT(file.mesh.cell_region_names, ElementsAre("1"));
}

TEST(CellNumbers, OfOtherNamesAreRefusedWithThoseThatAreThere) {
  MeshFile file = numbered({1, 2});
  expect_error([&] { make_cell_regions("region", file); }, ErrorCode::kMeshBadCellRegion,
               "no integers called 'region' for its cells; it has 'part', 'material'");
  file.cell_numbers.clear();
  expect_error([&] { make_cell_regions("region", file); }, ErrorCode::kMeshBadCellRegion, "it has none");
}

TEST(CellNumbers, AreRefusedIfThereAreTooManyDifferentOnes) {
  std::vector<std::int64_t> numbers;
  for (int i = 0; i < 255; ++i) numbers.push_back(i);
  MeshFile fits = numbered(numbers);
  make_cell_regions("material", fits);
  EXPECT_EQ(fits.mesh.cell_region_names.size(), 255u);
  numbers.push_back(255);
  MeshFile file = numbered(numbers);
  expect_error([&] { make_cell_regions("material", file); }, ErrorCode::kMeshBadCellRegion, "more than 255");
  EXPECT_THAT(file.mesh.cell_regions, IsEmpty());
}

constexpr const char* kVtk =
    "# vtk DataFile Version 3.0\ntwo tetrahedra and a triangle\nASCII\nDATASET UNSTRUCTURED_GRID\n"
    "POINTS 5 float\n0 0 0 1 0 0 0 1 0 0 0 1 1 1 1\n"
    "CELLS 3 14\n4 0 1 2 3\n3 0 1 2\n4 1 2 3 4\nCELL_TYPES 3\n10\n5\n10\n"
    "CELL_DATA 3\nSCALARS material int 1\nLOOKUP_TABLE default\n4\n9\n-3\n"
    "SCALARS share float 1\nLOOKUP_TABLE default\n0.5\n1\n1\n"
    "SCALARS nothing float 1\nLOOKUP_TABLE default\nnan\n1\n1\n"
    "FIELD more 2\nrank 1 3 int\n1\n0\n0\npair 2 3 int\n1 2 3 4 5 6\n";

TEST(CellNumbers, OfVtkFilesAreThoseOfVolumeCells) {
  const MeshFile file = read_vtk(kVtk);
  ASSERT_EQ(file.cell_numbers.size(), 2u);
  EXPECT_EQ(file.cell_numbers[0].name, "material");
  EXPECT_THAT(file.cell_numbers[0].of_cells, ElementsAre(4, -3));
  EXPECT_EQ(file.cell_numbers[1].name, "rank");
  EXPECT_THAT(file.cell_numbers[1].of_cells, ElementsAre(1, 0));
  EXPECT_THAT(file.warnings, testing::IsSupersetOf({"cell data 'share' left out", "cell data 'nothing' left out",
                                                    "cell data 'pair' left out"}));
}

TEST(CellNumbers, OfMeditFilesAreTheirReferences) {
  const std::string text =
      "MeshVersionFormatted 1\nDimension 3\nVertices 5\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n1 1 1 0\n"
      "Tetrahedra 2\n1 2 3 4 ";
  const MeshFile file = read_medit(text + "-5\n2 3 4 5 8\nEnd\n");
  ASSERT_EQ(file.cell_numbers.size(), 1u);
  EXPECT_EQ(file.cell_numbers[0].name, "reference");
  EXPECT_THAT(file.cell_numbers[0].of_cells, ElementsAre(-5, 8));
  EXPECT_THAT(read_medit(text + "x\n2 3 4 5 8\nEnd\n").cell_numbers, IsEmpty());
}

}  // namespace
}  // namespace ccslice
