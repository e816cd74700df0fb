// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/gmsh_element_data.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include "core/mesh_files/read_gmsh.h"
#include "core/mesh_import/cell_averages.h"
#include "core/mesh_import/cell_numbers.h"
#include "tests/core/mesh/expect_error.h"

namespace ccslice {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// A triangle, and two tetrahedra with the numbers 20 and 9.
const std::string kMesh =
    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n5\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 1 1 1\n$EndNodes\n"
    "$Elements\n3\n3 2 2 0 1 1 2 3\n20 4 2 0 1 1 2 3 4\n9 4 2 0 1 2 3 4 5\n$EndElements\n";

std::string field(const std::string& rows, int count, const std::string& name = "density", int components = 1,
                  int step = 0, int partition = 0) {
  return "$ElementData\n1\n\"" + name + "\"\n1\n0.5\n4\n" + std::to_string(step) + "\n" + std::to_string(components) +
         "\n" + std::to_string(count) + "\n" + std::to_string(partition) + "\n" + rows + "$EndElementData\n";
}

TEST(GmshElementData, BecomesNumbersOfCellsInAnyOrder) {
  MeshFile file = read_gmsh(kMesh + field("9 0.25\n3 7\n20 -1e3\n", 3) + field("20 2\n9 1\n", 2, "part"));
  ASSERT_EQ(file.cell_numbers.size(), 3u);
  EXPECT_EQ(file.cell_numbers[0].name, "entity");
  EXPECT_EQ(file.cell_numbers[1].name, "density");
  EXPECT_THAT(file.cell_numbers[1].of_cells, ElementsAre(-1000, 0.25));
  EXPECT_THAT(file.warnings, ElementsAre("1 points, lines and faces left out"));
  average_cell_numbers("density", MeanOver::kAllCells, file);
  EXPECT_EQ(file.mesh.channel_values[0], -1000);
  EXPECT_EQ(file.mesh.channel_values[4], 0.25f);
  make_cell_regions("part", file);
  EXPECT_THAT(file.mesh.cell_region_names, ElementsAre("1", "2"));
  EXPECT_THAT(file.mesh.cell_regions, ElementsAre(1, 0));
}

TEST(GmshElementData, ComponentsBecomeNumbersOfTheirOwn) {
  const MeshFile file = read_gmsh(kMesh + field("9 1 2 3\n20 4 5 6\n", 2, "force", 3));
  ASSERT_EQ(file.cell_numbers.size(), 4u);
  EXPECT_EQ(file.cell_numbers[3].name, "force.2");
  EXPECT_THAT(file.cell_numbers[3].of_cells, ElementsAre(6, 3));
}

TEST(GmshElementData, IsPutTogetherFromPartitions) {
  const MeshFile file = read_gmsh(kMesh + field("9 1\n", 1, "a", 1, 3, 1) + field("20 2\n", 1, "a", 1, 3, 2));
  ASSERT_EQ(file.cell_numbers.size(), 2u);
  EXPECT_THAT(file.cell_numbers[1].of_cells, ElementsAre(2, 1));
}

TEST(GmshElementData, IsReadFromVersionFour) {
  const std::string text =
      "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 4 1 4\n3 1 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
      "$EndNodes\n$Elements\n1 1 70 70\n3 1 4 1\n70 1 2 3 4\n$EndElements\n";
  const MeshFile file = read_gmsh(text + field("70 4\n", 1));
  ASSERT_EQ(file.cell_numbers.size(), 2u);
  EXPECT_THAT(file.cell_numbers[1].of_cells, ElementsAre(4));
}

TEST(GmshElementData, IsLeftOutWhereItDoesNotFit) {
  const auto warnings = [](const std::string& fields) {
    const MeshFile file = read_gmsh(kMesh + fields);
    EXPECT_EQ(file.cell_numbers.size(), 1u);
    return file.warnings;
  };
  EXPECT_THAT(warnings(field("9 1\n", 1)),
              ElementsAre(testing::_, "field 'density' at elements left out: 1 cells have no value in it"));
  EXPECT_THAT(warnings(field("9\n20\n", 2, "force", 0)),
              ElementsAre(testing::_, HasSubstr("'force' at elements left out")));
  std::string many;
  for (int i = 0; i < 17; ++i) many += field("9 1\n20 1\n", 2, "f" + std::to_string(i));
  EXPECT_EQ(read_gmsh(kMesh + many).cell_numbers.size(), kMostCellNumbers);
  const MeshFile twice = read_gmsh(kMesh + field("9 1\n20 2\n", 2) + field("9 3\n20 4\n", 2, "density", 1, 1));
  EXPECT_THAT(twice.warnings, ElementsAre(testing::_, HasSubstr("comes again for another time")));
  EXPECT_THAT(twice.cell_numbers[1].of_cells, ElementsAre(2, 1));
  std::string twins = kMesh;
  twins.replace(twins.find("\n20 4"), 5, "\n9 4 ");
  EXPECT_THAT(read_gmsh(twins + field("9 1\n", 1)).warnings,
              ElementsAre(testing::_, HasSubstr("element 9 comes twice")));
}

TEST(GmshElementData, NamesTheLineAtFault) {
  expect_error([] { (void)read_gmsh(kMesh + field("9 1\n20 x\n", 2)); }, ErrorCode::kFileSyntax, "'x'");
  expect_error([] { (void)read_gmsh(kMesh + field("9 1\n", 2)); }, ErrorCode::kFileSyntax, "an element's number");
  expect_error([] { (void)read_gmsh(kMesh + "$ElementData\n1\n\"a\"\n1\n0\n2\n0\n1\n"); }, ErrorCode::kFileSyntax,
               "at least 3 integer tags");
}

}  // namespace
}  // namespace ccslice
