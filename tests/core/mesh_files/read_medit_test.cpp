// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/read_medit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/core/mesh/expect_error.h"

namespace ccslice {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr const char* kTwoCells = R"(MeshVersionFormatted 2
# A comment, then sections with the cells first.
Dimension
3
Tetrahedra 1
 1 2 3 4 0
Hexahedra
1
1 2 3 4 5 6 7 8 12
Prisms 1
1 2 3 5 6 7 0
Quadrilaterals 1
1 2 3 4 7
SolAtVertices 2
1 2
3.5 4.5
Vertices
8
0 0 0 0
+1 0 0 0
1 1 0 0
0 1 0 0
0 0 1e0 0
1 0 1 0
1 1 1 0
0 1 1 1e-400
End
this is never read
)";

TEST(ReadMedit, ReadsSectionsInAnyOrderAndCountsFromOne) {
  const MeshFile file = read_medit(kTwoCells);
  EXPECT_EQ(file.mesh.vertex_count(), 8u);
  EXPECT_EQ(file.mesh.positions[1], Vec3(1, 0, 0));
  EXPECT_THAT(file.mesh.cell_kinds, ElementsAre(CellKind::kTet, CellKind::kHex, CellKind::kWedge));
  EXPECT_THAT(file.mesh.cell_vertices, ElementsAre(0, 1, 2, 3, 0, 1, 2, 3, 4, 5, 6, 7, 0, 1, 2, 4, 5, 6));
}

TEST(ReadMedit, ReportsWhatItLeavesOut) {
  const MeshFile file = read_medit(kTwoCells);
  EXPECT_THAT(file.warnings, ElementsAre("1 Quadrilaterals left out", HasSubstr("SolAtVertices")));
}

TEST(ReadMedit, NamesLineAndToken) {
  expect_error([] { read_medit("MeshVersionFormatted 1\nDimension 3\nVertices\n1\n0 zero 0 0\n"); },
               ErrorCode::kFileSyntax, "line 5: expected a coordinate, found 'zero'");
  expect_error([] { read_medit("MeshVersionFormatted 1\nVertices 2\n0 0 0 0\n"); }, ErrorCode::kFileSyntax,
               "found the end of the file");
  expect_error([] { read_medit("MeshVersionFormatted 1\nDimension 3\n17\n"); }, ErrorCode::kFileSyntax,
               "line 3: expected a keyword, found '17'");
}

TEST(ReadMedit, ReadsPyramidsAsHexahedraWithFourCornersInOne) {
  const MeshFile file = read_medit(
      "MeshVersionFormatted 2\nDimension 3\nVertices\n5\n0 0 0 0\n1 0 0 0\n1 1 0 0\n0 1 0 0\n0 0 1 0\nPyramids\n1\n"
      "1 2 3 4 5 7\nEnd\n");
  EXPECT_THAT(file.mesh.cell_kinds, testing::ElementsAre(CellKind::kHex));
  EXPECT_THAT(file.mesh.cell_vertices, testing::ElementsAre(0, 1, 2, 3, 4, 4, 4, 4));
  EXPECT_THAT(file.cell_numbers.at(0).of_cells, testing::ElementsAre(7));
}

TEST(ReadMedit, RefusesWhatIsNoSolid) {
  expect_error([] { read_medit("MeshVersionFormatted 1\nDimension 2\n"); }, ErrorCode::kFileUnsupported, "dimension 2");
  expect_error([] { read_medit("MeshVersionFormatted 9\n"); }, ErrorCode::kFileUnsupported, "version 9");
  expect_error([] { read_medit("MeshVersionFormatted 1\nPyramidsP2 3\n"); }, ErrorCode::kMeshUnsupportedCell,
               "3 pyramids");
  expect_error([] { read_medit("MeshVersionFormatted 1\nVertices 1\n0 0 0 0\nEnd"); }, ErrorCode::kMeshEmpty,
               "Hexahedra");
  expect_error([] { read_medit("MeshVersionFormatted 1\nEnd"); }, ErrorCode::kMeshEmpty, "Vertices");
}

TEST(ReadMedit, RefusesNumbersThatAreNotFinite) {
  for (const char* bad : {"nan", "inf", "-inf", "1e999", "-1e999"}) {
    const std::string text = std::string("MeshVersionFormatted 1\nVertices 4\n0 ") + bad +
                             " 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\nTetrahedra 1\n1 2 3 4 0\n";
    expect_error([&] { read_medit(text); }, ErrorCode::kMeshNonFinite,
                 "line 3: '" + std::string(bad) + "', a coordinate of vertex 1, is not a finite number");
  }
}

TEST(ReadMedit, LeavesOutVerticesThatNoCellUses) {
  const MeshFile file = read_medit(
      "MeshVersionFormatted 1\nVertices 6\nnan 0 0 0\n0 0 0 0\n1 0 0 0\n1e999 5 5 0\n0 1 0 0\n0 0 1 0\n"
      "Tetrahedra 1\n2 3 5 6 0\n");
  EXPECT_THAT(file.mesh.positions, ElementsAre(Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)));
  EXPECT_THAT(file.mesh.cell_vertices, ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(file.warnings, ElementsAre(testing::HasSubstr("2 vertices that no cell uses left out")));
}

TEST(ReadMedit, RefusesIdsThatDoNotExist) {
  const std::string vertices = "MeshVersionFormatted 1\nVertices 4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n";
  expect_error([&] { read_medit(vertices + "Tetrahedra 1\n0 1 2 3 0\n"); }, ErrorCode::kMeshIndexOutOfRange,
               "ids count from 1");
  expect_error([&] { read_medit(vertices + "Tetrahedra 2\n1 2 3 4 0\n1 2 3 5 0\n"); }, ErrorCode::kMeshIndexOutOfRange,
               "line 9: vertex id 5; the file has 4 vertices");
  expect_error(
      [&] {
        read_medit("MeshVersionFormatted 1\nPrisms 1\n1 2 3 1 2 3 0\nTetrahedra 3\n1 2 3 4 0\n1 2 3 5 0\n1 2 6 4 0\n" +
                   vertices.substr(23));
      },
      ErrorCode::kMeshIndexOutOfRange, "the file has 4 vertices, and others are named in cells 2, 3");
  expect_error([&] { read_medit(vertices + "Tetrahedra 1\n1 2 3 99999999999 0\n"); }, ErrorCode::kMeshIndexOutOfRange,
               "99999999999");
}

TEST(ReadMedit, NeverAllocatesWhatAFileMerelyClaims) {
  expect_error([] { read_medit("MeshVersionFormatted 1\nVertices 15000000\n"); }, ErrorCode::kFileSyntax, "coordinate");
  expect_error([] { read_medit("MeshVersionFormatted 1\nVertices 99999999999\n"); }, ErrorCode::kMeshTooLarge,
               "at most 16000000");
  expect_error([] { read_medit("MeshVersionFormatted 1\nTriangles 9007199254740992\n"); }, ErrorCode::kFileSyntax,
               "Triangles");
  expect_error([] { read_medit("MeshVersionFormatted 1\nHexahedra -5\n"); }, ErrorCode::kFileSyntax, "'-5'");
}

TEST(ReadMedit, EveryTruncationFailsCleanly) {
  const std::string text = kTwoCells;
  const std::size_t end = text.find("1e-400");
  for (std::size_t length = 0; length < end; ++length) EXPECT_THROW(read_medit(text.substr(0, length)), Error);
}

}  // namespace
}  // namespace ccslice
