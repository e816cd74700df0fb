// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/abaqus_parts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "core/mesh/validate.h"
#include "core/mesh_files/read_abaqus.h"
#include "tests/core/mesh/expect_error.h"

namespace ccslice {
namespace {

using testing::Contains;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

std::string node(int number, const Vec3& p) {
  return std::to_string(number) + ", " + std::to_string(p.x()) + ", " + std::to_string(p.y()) + ", " +
         std::to_string(p.z()) + "\n";
}

/// Two cubes on each other, with a gap between them: nodes 1 to 8 and 11 to 18.
std::string two_cubes(double gap) {
  std::string text = "*NODE\n";
  for (int cube = 0; cube < 2; ++cube) {
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3 at(corner % 4 == 1 || corner % 4 == 2, corner % 4 > 1, corner / 4 + cube * (1 + gap));
      text += node(10 * cube + corner + 1, at);
    }
  }
  return text + "*ELEMENT, TYPE=C3D8\n501, 1, 2, 3, 4, 5, 6, 7, 8\n503, 11, 12, 13, 14, 15, 16, 17, 18\n";
}

const std::string kCohesive = "*ELEMENT, TYPE=COH3D8, ELSET=GLUE\n502, 5, 6, 7, 8, 11, 12, 13, 14\n";

TEST(AbaqusParts, HaveCellsBetweenFacesThatArePartOfTheVolumeIfTheyAreThick) {
  const MeshFile file = read_abaqus(two_cubes(0.125) + kCohesive);
  EXPECT_THAT(file.numbers.cells, ElementsAre(501, 503, 502));
  EXPECT_EQ(file.cell_sets.at(0).name, "GLUE");
  ControlMesh mesh = file.mesh;
  EXPECT_NO_THROW(validate(mesh));
  EXPECT_TRUE(file.warnings.empty());
}

TEST(AbaqusParts, CountCellsThatAreFlat) {
  // The other axes of hexahedra that are stacked along them.
  const std::string others =
      "*ELEMENT, TYPE=COH3D8\n504, 5, 11, 14, 8, 6, 12, 13, 7\n506, 5, 6, 12, 11, 8, 7, 13, 14\n";
  const MeshFile file =
      read_abaqus(two_cubes(0) + kCohesive + others + "*ELEMENT, TYPE=GK3D6\n505, 5, 6, 7, 11, 12, 13\n");
  EXPECT_THAT(file.numbers.cells, ElementsAre(501, 503));
  EXPECT_EQ(file.mesh.cell_count(), 2u);
  EXPECT_THAT(file.warnings, Contains(HasSubstr("3 elements of type COH3D8 left out: their faces lie on each other")));
  EXPECT_THAT(file.warnings, Contains(HasSubstr("1 element of type GK3D6 left out")));
  EXPECT_THAT(file.warnings, Contains("sets left out: GLUE"));
  const std::string text = two_cubes(0);
  expect_error([&] { (void)read_abaqus(text.substr(0, text.find("*ELEMENT")) + kCohesive); }, ErrorCode::kMeshEmpty,
               "no solid elements (C3D4, C3D6, C3D8, ...); 1 element of type COH3D8 left out");
}

TEST(AbaqusParts, KeepTheOtherCellsAsTheyAreWhereSomeAreFlat) {
  std::string nodes = "*NODE\n";
  for (int i = 0; i < 27; ++i) nodes += node(21 + i, Vec3(5 + i % 3, i / 3 % 3, i / 9));
  const std::string hex =
      "*ELEMENT, TYPE=C3D20\n600, 21, 23, 29, 27, 39, 41, 47, 45, 22, 26, 28, 24, 40, 44, 46, 42, 30, 32,\n38, 36\n";
  const MeshFile file = read_abaqus(two_cubes(0) + kCohesive + nodes + hex);
  EXPECT_THAT(file.numbers.cells, ElementsAre(501, 503, 600));
  ASSERT_EQ(file.mesh.mid_nodes.edges.size(), 12u);
  for (std::size_t e = 0; e < 12; ++e) {
    const auto [a, b] = file.mesh.mid_nodes.edges[e];
    EXPECT_EQ(file.mesh.mid_nodes.positions[e], (file.mesh.positions[a] + file.mesh.positions[b]) / 2);
  }
}

/// Nodes in faces are told by their places, whichever of them there are.
TEST(AbaqusParts, TakeNodesOfFacesWhereTheyAre) {
  std::string nodes = "*NODE\n";
  for (int i = 0; i < 27; ++i) nodes += node(1 + i, Vec3(i % 3, i / 3 % 3, i / 9));
  const std::string edges = "9, 1, 3, 9, 7, 19, 21, 27, 25, 2, 6, 8, 4, 20, 24, 26,\n22, 10, 12, 18, 16, ";
  // The inside, the faces z = 2, none, y = 0, and x = 2.
  const MeshFile file = read_abaqus(nodes + "*ELEMENT, TYPE=C3D27\n" + edges + "14, 23, 0, 11, , 15\n");
  const MidNodes& found = file.mesh.mid_nodes;
  ASSERT_EQ(found.faces.size(), 3u);
  for (std::size_t f = 0; f < 3; ++f) {
    Vec3 sum = Vec3::Zero();
    for (const std::uint32_t corner : found.faces[f]) sum += file.mesh.positions[corner];
    EXPECT_EQ(found.positions[12 + f], sum / 4);
  }
  ASSERT_EQ(found.cells.size(), 1u);
  EXPECT_EQ(found.positions.back(), Vec3(1, 1, 1));
  expect_error([&] { (void)read_abaqus(nodes + "*ELEMENT, TYPE=C3D27\n" + edges + "99\n"); },
               ErrorCode::kMeshIndexOutOfRange, "an element uses node 99");
}

TEST(AbaqusParts, HaveTheirNumbersInEveryInstance) {
  const MeshFile file = read_abaqus(
      "*PART, NAME=a\n*NODE\n9, 9, 9, 9\n11, 0, 0, 0\n12, 1, 0, 0\n13, 0, 1, 0\n14, 0, 0, 1\n*ELEMENT, TYPE=C3D4\n"
      "77, 11, 12, 13, 14\n*END PART\n*INSTANCE, NAME=i, PART=a\n*END INSTANCE\n*INSTANCE, NAME=j, PART=a\n5\n"
      "*END INSTANCE\n");
  EXPECT_THAT(file.numbers.vertices, ElementsAre(11, 12, 13, 14, 11, 12, 13, 14));
  EXPECT_THAT(file.numbers.cells, ElementsAre(77, 77));
}

TEST(AbaqusParts, RefuseNodesBetweenCornersThatNoNumberCanBe) {
  std::string text = "*NODE\n1, 0, 0, 0\n2, 2, 0, 0\n3, 0, 2, 0\n4, 0, 0, 2\n5, 1, nan, 0\n";
  text += "*ELEMENT, TYPE=C3D10\n1, 1, 2, 3, 4, 5, 5, 5, 5, 5, 5\n";
  expect_error([&] { (void)read_abaqus(text); }, ErrorCode::kMeshNonFinite, "line 6: 'nan'");
}

}  // namespace
}  // namespace ccslice
