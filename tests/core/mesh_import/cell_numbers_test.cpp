// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/cell_numbers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "core/mesh_files/read_medit.h"
#include "core/mesh_files/read_vtk.h"
#include "tests/core/mesh/expect_error.h"

namespace ccslice {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

MeshFile numbered(const std::vector<double>& numbers) {
  MeshFile file;
  file.mesh.cell_kinds.assign(numbers.size(), CellKind::kHex);
  file.cell_numbers = {{"part", std::vector<double>(numbers.size(), 1)}, {"material", numbers}};
  return file;
}

/// The ids that the refusal has, for whoever knows the file's numbers of these cells.
std::vector<std::int64_t> refused_cells(const std::string& names, MeshFile& file) {
  try {
    make_cell_regions(names, file);
  } catch (const Error& error) {
    return error.ids();
  }
  return {};
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
               "no numbers or sets called 'region' for its cells; it has numbers called 'part', 'material'");
  file.cell_sets = {{"core", {0}}};
  expect_error([&] { make_cell_regions("core,shell", file); }, ErrorCode::kMeshBadCellRegion,
               "called 'core,shell' for its cells; it has numbers called 'part', 'material', and sets 'core'");
  file.cell_numbers.clear();
  file.cell_sets.clear();
  expect_error([&] { make_cell_regions("region", file); }, ErrorCode::kMeshBadCellRegion, "it has none");
}

TEST(CellNumbers, OfNamesInAnotherCaseAreRefusedWithAHint) {
  MeshFile file = numbered({1, 2});
  file.cell_sets = {{"Core", {0}}, {"shell", {1}}};
  expect_error([&] { make_cell_regions("MATERIAL", file); }, ErrorCode::kMeshBadCellRegion,
               "sets 'Core', 'shell'; did you mean 'material'?");
  expect_error([&] { make_cell_regions("shell,core", file); }, ErrorCode::kMeshBadCellRegion, "; did you mean 'Core'?");
}

TEST(CellNumbers, ThatAreNotWholeMakeNoRegions) {
  MeshFile file = numbered({1, 2, 0.25});
  expect_error([&] { make_cell_regions("material", file); }, ErrorCode::kMeshBadCellRegion,
               "'material' is 0.25 in cell 2; regions are made of whole numbers only");
  EXPECT_THAT(refused_cells("material", file), ElementsAre(2));
  file = numbered({1, std::nan("")});
  expect_error([&] { make_cell_regions("material", file); }, ErrorCode::kMeshBadCellRegion, "whole numbers");
}

TEST(CellNumbers, AreRefusedIfThereAreTooManyDifferentOnes) {
  std::vector<double> numbers;
  for (int i = 0; i < 255; ++i) numbers.push_back(i);
  MeshFile fits = numbered(numbers);
  make_cell_regions("material", fits);
  EXPECT_EQ(fits.mesh.cell_region_names.size(), 255u);
  numbers.push_back(255);
  MeshFile file = numbered(numbers);
  expect_error([&] { make_cell_regions("material", file); }, ErrorCode::kMeshBadCellRegion, "more than 255");
  EXPECT_THAT(file.mesh.cell_regions, IsEmpty());
}

MeshFile with_sets() {
  MeshFile file = numbered({0, 0, 0, 0, 0});
  file.cell_sets = {{"all", {0, 1, 2, 3, 4}}, {"core", {1, 3}}, {"rest", {0}}, {"a,b", {2, 4}}};
  return file;
}

TEST(CellSets, MayHaveCommasInTheirNames) {
  MeshFile file = with_sets();
  make_cell_regions("core,a,b,rest", file);
  EXPECT_THAT(file.mesh.cell_region_names, ElementsAre("core", "a,b", "rest"));
  EXPECT_THAT(file.mesh.cell_regions, ElementsAre(2, 0, 1, 0, 1));
  make_cell_regions("a,b,core,rest", file);
  EXPECT_THAT(file.mesh.cell_region_names, ElementsAre("a,b", "core", "rest"));
}

/// The longest name first leads nowhere: 'a,b' leaves 'c', which no set is called.
TEST(CellSets, AreFoundHoweverCommasPartTheirNames) {
  MeshFile file = numbered({0, 0, 0, 0, 0});
  file.cell_sets = {{"a", {0}}, {"a,b", {1}}, {"b,c", {2}}, {"d", {3}}, {"c,d", {4}}};
  make_cell_regions("a,b,c", file);
  EXPECT_THAT(file.mesh.cell_region_names, ElementsAre("a", "b,c", "rest"));
  make_cell_regions("d,a,b,c,d", file);
  EXPECT_THAT(file.mesh.cell_region_names, ElementsAre("d", "a,b", "c,d", "rest")) << "the longest that goes on";
  EXPECT_THAT(file.mesh.cell_regions, ElementsAre(3, 1, 3, 0, 2));
  expect_error([&] { make_cell_regions("a,b,b", file); }, ErrorCode::kMeshBadCellRegion, "called 'a,b,b'");
}

// Ways to part a text multiply with each comma, and names in it with the sets that there are.
TEST(CellSets, AreFoundInNoTimeAmongMany) {
  MeshFile file = numbered(std::vector<double>(3, 0));
  std::string names;
  for (int i = 0; i < 20'000; ++i) names += "a,";
  file.cell_sets = {{"a", {0}}, {"a,a", {1}}, {"a,a,a", {2}}};
  for (int i = 0; i < 20'000; ++i) file.cell_sets.push_back({"set " + std::to_string(i), {0}});
  expect_error([&] { make_cell_regions(names + "b", file); }, ErrorCode::kMeshBadCellRegion, "called 'a,a,");
  make_cell_regions(names + "a,a", file);
  EXPECT_THAT(file.mesh.cell_region_names, ElementsAre("a,a,a", "a", "rest")) << "20,002 of them";
}

TEST(CellSets, MakeRegionsInTheOrderOfTheirNames) {
  MeshFile file = with_sets();
  make_cell_regions("rest,core", file);
  EXPECT_THAT(file.mesh.cell_region_names, ElementsAre("rest", "core", "rest_"));
  EXPECT_THAT(file.mesh.cell_regions, ElementsAre(0, 1, 2, 1, 2));
  make_cell_regions("core", file);
  EXPECT_THAT(file.mesh.cell_region_names, ElementsAre("core", "rest"));
  EXPECT_THAT(file.mesh.cell_regions, ElementsAre(1, 0, 1, 0, 1));
  make_cell_regions("a,b", file);
  EXPECT_THAT(file.mesh.cell_regions, ElementsAre(1, 1, 0, 1, 0));
  make_cell_regions("all,all", file);
  EXPECT_THAT(file.mesh.cell_region_names, ElementsAre("all"));
}

TEST(CellSets, ThatHaveCellsInCommonAreRefused) {
  MeshFile file = with_sets();
  expect_error(
      [&] { make_cell_regions("sets", file); }, ErrorCode::kMeshBadCellRegion,
      "cell 1 is in both 'all' and 'core'; name sets that have no cells in common, such as 'rest,core,a,b', and "
      "the rest becomes one region");
  EXPECT_THAT(refused_cells("sets", file), ElementsAre(1));
  make_cell_regions("rest,core,a,b", file);
  file.cell_sets.erase(file.cell_sets.begin());
  make_cell_regions("sets", file);
  EXPECT_THAT(file.mesh.cell_region_names, ElementsAre("core", "rest", "a,b"));
  EXPECT_THAT(file.mesh.cell_regions, ElementsAre(1, 0, 2, 0, 2));
  expect_error([&] { make_cell_regions("core,", file); }, ErrorCode::kMeshBadCellRegion, "called 'core,'");
}

TEST(CellSets, AreRefusedIfThereAreTooMany) {
  MeshFile file = numbered(std::vector<double>(300, 0));
  for (std::uint32_t cell = 0; cell < 255; ++cell) file.cell_sets.push_back({std::to_string(cell), {cell}});
  expect_error([&] { make_cell_regions("sets", file); }, ErrorCode::kMeshBadCellRegion, "the rest are more than 255");
  for (std::uint32_t cell = 255; cell < 300; ++cell) file.cell_sets.push_back({std::to_string(cell), {cell}});
  expect_error([&] { make_cell_regions("sets", file); }, ErrorCode::kMeshBadCellRegion, "the sets are more than 255");
}

TEST(ExactInteger, IsThatOfWholeNumbersOnly) {
  EXPECT_EQ(exact_integer(-3), -3);
  EXPECT_EQ(exact_integer(0x1p53), std::int64_t{1} << 53);
  for (const double value : {0.5, 0x1p54, std::nan(""), -HUGE_VAL}) EXPECT_FALSE(exact_integer(value)) << value;
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
  ASSERT_EQ(file.cell_numbers.size(), 6u);
  EXPECT_EQ(file.cell_numbers[0].name, "material");
  EXPECT_THAT(file.cell_numbers[0].of_cells, ElementsAre(4, -3));
  EXPECT_EQ(file.cell_numbers[1].name, "share");
  EXPECT_THAT(file.cell_numbers[1].of_cells, ElementsAre(0.5, 1));
  EXPECT_TRUE(std::isnan(file.cell_numbers[2].of_cells[0]));
  EXPECT_EQ(file.cell_numbers[3].name, "rank");
  EXPECT_THAT(file.cell_numbers[3].of_cells, ElementsAre(1, 0));
  EXPECT_EQ(file.cell_numbers[5].name, "pair.1");
  EXPECT_THAT(file.cell_numbers[5].of_cells, ElementsAre(2, 6));
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
