// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/gmsh_groups.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "core/mesh/validate.h"
#include "core/mesh_files/read_gmsh.h"
#include "tests/core/mesh/expect_error.h"

namespace ccslice {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const std::string kNames =
    "$PhysicalNames\n4\n3 7 \"core\"\n3 8 \"shell \"soft\"\"\n2 7 \"skin\"\n3 9 \"air\"\n$EndPhysicalNames\n";
const std::string kVersion2 = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n" + kNames +
                              "$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n$Elements\n";

TEST(GmshGroups, OfVersionTwoStandWithTheElements) {
  const MeshFile file = read_gmsh(kVersion2 +
                                  "6\n1 2 2 7 1 1 2 3\n2 4 2 8 5 1 2 3 4\n3 4 2 7 -6 1 2 3 4\n4 4 0 1 2 3 4\n"
                                  "5 4 1 -8 1 2 3 4\n6 4 4 12 5 1 3 1 2 3 4\n$EndElements\n");
  ASSERT_EQ(file.cell_sets.size(), 3u);
  EXPECT_EQ(file.cell_sets[0].name, "core");
  EXPECT_THAT(file.cell_sets[0].cells, ElementsAre(1));
  EXPECT_EQ(file.cell_sets[1].name, "shell \"soft\"");
  EXPECT_THAT(file.cell_sets[1].cells, ElementsAre(0, 3));
  EXPECT_EQ(file.cell_sets[2].name, "12");
  EXPECT_THAT(file.cell_sets[2].cells, ElementsAre(4));
  ASSERT_EQ(file.cell_numbers.size(), 1u);
  EXPECT_THAT(file.cell_numbers[0].of_cells, ElementsAre(5, -6, 0, 0, 5));
  EXPECT_THAT(file.warnings,
              ElementsAre("1 points, lines and faces left out", "physical groups without cells left out: skin, air"));
}

TEST(GmshGroups, OfOneNameAreOneSet) {
  const MeshFile file = read_gmsh(
      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n3 2 \"a\"\n3 1 \"a\"\n"
      "$EndPhysicalNames\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n"
      "$Elements\n3\n1 4 2 1 1 1 2 3 4\n2 4 2 2 2 1 2 3 4\n3 4 2 1 3 1 2 3 4\n$EndElements\n");
  ASSERT_EQ(file.cell_sets.size(), 1u);
  EXPECT_THAT(file.cell_sets[0].cells, ElementsAre(0, 1, 2));
}

// Gmsh writes a cell of two groups twice, under two numbers.
TEST(GmshGroups, OfVersionTwoRepeatTheCellsOfSeveral) {
  const MeshFile file = read_gmsh(kVersion2 +
                                  "6\n1 4 2 7 5 1 2 3 4\n2 4 2 8 5 1 2 3 4\n3 4 2 7 5 2 1 4 3\n4 4 2 8 5 2 1 4 3\n"
                                  "5 4 2 8 6 2 1 4 3\n6 4 2 8 6 2 1 4 3\n$EndElements\n");
  ASSERT_EQ(file.mesh.cell_kinds.size(), 4u);  // The last two are the same cell in the same group: a fault to be told.
  EXPECT_THAT(file.mesh.cell_vertices, ElementsAre(0, 1, 2, 3, 1, 0, 3, 2, 1, 0, 3, 2, 1, 0, 3, 2));
  ASSERT_EQ(file.cell_sets.size(), 2u);
  EXPECT_THAT(file.cell_sets[0].cells, ElementsAre(0, 1));
  EXPECT_THAT(file.cell_sets[1].cells, ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(file.cell_numbers[0].of_cells, ElementsAre(5, 5, 6, 6));
}

TEST(GmshGroups, OfVersionTwoCountRepeatedCellsOnce) {
  MeshLimits limits;
  limits.max_cells = 1;
  const std::string twice = "2\n1 11 2 7 5 1 2 3 4 1 2 3 4 1 2\n2 11 2 8 5 1 2 3 4 1 2 3 4 1 2\n$EndElements\n";
  const MeshFile file = read_gmsh(kVersion2 + twice, limits);
  EXPECT_EQ(file.mesh.cell_kinds.size(), 1u);
  EXPECT_EQ(file.mesh.mid_nodes.edges.size(), 6u);
}

// A hundred thousand names take no time to speak of.
TEST(GmshGroups, MayBeMany) {
  constexpr int kMany = 100'000;
  std::string names = "$PhysicalNames\n" + std::to_string(kMany) + "\n", elements = std::to_string(kMany) + "\n";
  for (int i = 1; i <= kMany; ++i) {
    const std::string tag = std::to_string(i);
    names += "3 " + tag + " \"g" + tag + "\"\n";
    elements += tag + " 4 2 " + tag + " " + tag + " 1 2 3 4\n";
  }
  const MeshFile file = read_gmsh("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n" + names +
                                  "$EndPhysicalNames\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n"
                                  "$Elements\n" +
                                  elements + "$EndElements\n");
  ASSERT_EQ(file.cell_sets.size(), std::size_t{kMany});
  EXPECT_EQ(file.cell_sets.back().name, "g100000");
  EXPECT_THAT(file.cell_sets.back().cells, ElementsAre(kMany - 1));
}

const std::string kNodes41 = "$Nodes\n1 4 1 4\n3 1 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n$EndNodes\n";

std::string version_41(const std::string& entities, const std::string& elements) {
  return "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n" + kNames + entities + kNodes41 + "$Elements\n" + elements +
         "$EndElements\n";
}

const std::string kEntities =
    "$Entities\n1 1 1 3\n1 0 0 0 1 4\n1 0 0 0 1 1 1 0 2 1 -1\n1 0 0 0 1 1 1 1 7 1 -1\n"
    "1 0 0 0 1 1 1 1 7 2 1 -2\n2 0 0 0 1 1 1 2 -8 7 0\n3 0 0 0 1 1 1 0 0\n$EndEntities\n";
const std::string kElements = "3 3 1 3\n3 1 4 1\n1 1 2 3 4\n3 2 4 1\n2 1 2 3 4\n3 3 4 1\n3 1 2 3 4\n";

TEST(GmshGroups, OfVersionFourAreThoseOfTheVolumes) {
  const MeshFile file = read_gmsh(version_41(kEntities, kElements));
  ASSERT_EQ(file.cell_sets.size(), 2u);
  EXPECT_EQ(file.cell_sets[0].name, "core");
  EXPECT_THAT(file.cell_sets[0].cells, ElementsAre(0, 1));
  EXPECT_THAT(file.cell_sets[1].cells, ElementsAre(1));
  EXPECT_THAT(file.cell_numbers[0].of_cells, ElementsAre(1, 2, 3));
}

// The entities of partitions are others; they name the volume that they are parts of.
TEST(GmshGroups, OfPartitionsAreThoseOfTheirVolumes) {
  const std::string partitioned =
      "$PartitionedEntities\n2\n1\n9 2\n0 0 0 2\n4 3 1 1 1 0 0 0 1 1 1 1 7 0\n5 3 2 2 1 2 0 0 0 1 1 1 2 8 7 0\n"
      "$EndPartitionedEntities\n";
  const MeshFile file = read_gmsh(version_41(kEntities + partitioned,
                                             "2 2 1 2\n3 4 4 1\n1 1 2 3 4\n3 5 4 1\n"
                                             "2 1 2 3 4\n"));
  ASSERT_EQ(file.cell_sets.size(), 2u);
  EXPECT_THAT(file.cell_sets[0].cells, ElementsAre(0, 1));
  EXPECT_THAT(file.cell_numbers[0].of_cells, ElementsAre(1, 2));
}

// A volume that names a group again and again has it once; one of too many groups for its cells is refused.
TEST(GmshGroups, CannotRepeatCellsWithoutEnd) {
  constexpr int kGroups = 3000, kCells = 3000;
  std::string same, other, elements = "1 " + std::to_string(kCells) + " 1 3000\n3 1 4 " + std::to_string(kCells) + "\n";
  for (int i = 1; i <= kGroups; ++i) {
    same += " 7";
    other += " " + std::to_string(i);
  }
  for (int i = 1; i <= kCells; ++i) elements += std::to_string(i) + " 1 2 3 4\n";
  const auto entities = [&](const std::string& groups) {
    return "$Entities\n0 0 0 1\n1 0 0 0 1 1 1 " + std::to_string(kGroups) + groups + " 0\n$EndEntities\n";
  };
  const MeshFile file = read_gmsh(version_41(entities(same), elements));
  ASSERT_EQ(file.cell_sets.size(), 1u);
  EXPECT_EQ(file.cell_sets[0].cells.size(), std::size_t{kCells});
  expect_error([&] { read_gmsh(version_41(entities(other), elements)); }, ErrorCode::kMeshTooLarge,
               "the physical groups have more than");
}

TEST(GmshGroups, AreReadOnce) {
  std::string odd;
  for (int i = 0; i < 100; ++i) odd += "$Entities\n0 0 0 1\n1 0 0 0 1 1 1 5 7 0\n$EndEntities\n";
  const MeshFile broken = read_gmsh(version_41(odd, kElements));
  EXPECT_THAT(broken.warnings, testing::ElementsAre(HasSubstr("physical groups may be incomplete"),
                                                    HasSubstr("physical groups without cells left out")));
  const MeshFile twice = read_gmsh(version_41(kEntities + odd, kElements));
  EXPECT_EQ(twice.cell_sets.size(), 2u);
}

TEST(GmshGroups, AreDoneWithoutWhereTheEntitiesAreOdd) {
  const std::string odd = "$Entities\n0 0 0 1\n1 0 0 0 1 1 1 5 7 0\n$EndEntities\n";
  const MeshFile file = read_gmsh(version_41(odd, kElements));
  EXPECT_EQ(file.mesh.cell_count(), 3u);
  EXPECT_THAT(file.cell_sets, IsEmpty());
  EXPECT_THAT(file.warnings, testing::Contains(HasSubstr("physical groups may be incomplete, $Entities isn't as Gmsh "
                                                         "writes it: line 14: expected a physical group's tag")));
  expect_error([&] { read_gmsh(version_41("$Entities\n0 0 0 1\n", "")); }, ErrorCode::kFileSyntax, "'$EndEntities'");
}

}  // namespace
}  // namespace ccslice
