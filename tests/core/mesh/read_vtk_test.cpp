// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/read_vtk.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/core/mesh/expect_error.h"

namespace ccslice {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

const std::string kHead = "# vtk DataFile Version 3.0\na title, anything\nASCII\nDATASET UNSTRUCTURED_GRID\n";
const std::string kPoints = "POINTS 8 float\n0 0 0 1 0 0 1 1 0 0 1 0\n0 0 1 1 0 1 1 1 1 0 1 1\n";
const std::string kHex = "CELLS 1 9\n8 0 1 2 3 4 5 6 7\nCELL_TYPES 1\n12\n";

TEST(ReadVtk, ReadsAHexahedron) {
  const MeshFile file = read_vtk(kHead + kPoints + kHex);
  EXPECT_EQ(file.mesh.vertex_count(), 8u);
  EXPECT_THAT(file.mesh.cell_kinds, ElementsAre(CellKind::kHex));
  EXPECT_THAT(file.mesh.cell_vertices, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7));
  EXPECT_TRUE(file.warnings.empty());
}

TEST(ReadVtk, KeywordsAreCaseInsensitiveAndCarriageReturnsAreBlank) {
  EXPECT_EQ(read_vtk("# vtk datafile version 2.0\r\nt\r\nascii\r\ndataset unstructured_grid\r\npoints 8 FLOAT\r\n"
                     "0 0 0 1 0 0 1 1 0 0 1 0 0 0 1 1 0 1 1 1 1 0 1 1\r\ncells 1 9\r\n8 0 1 2 3 4 5 6 7\r\n"
                     "cell_types 1\r\n12\r\n")
                .mesh.cell_count(),
            1u);
}

TEST(ReadVtk, ReordersVoxels) {
  const MeshFile file = read_vtk(kHead + kPoints + "CELLS 1 9\n8 0 1 3 2 4 5 7 6\nCELL_TYPES 1\n11\n");
  EXPECT_THAT(file.mesh.cell_vertices, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7));
}

TEST(ReadVtk, ReadsTetsAndWedges) {
  const MeshFile file = read_vtk(kHead + kPoints + "CELLS 2 12\n4 0 1 2 4\n6 0 1 2 4 5 6\nCELL_TYPES 2\n10 13\n");
  EXPECT_THAT(file.mesh.cell_kinds, ElementsAre(CellKind::kTet, CellKind::kWedge));
}

TEST(ReadVtk, ReadsOffsetsAndConnectivityWithMetadata) {
  const MeshFile file = read_vtk(
      "# vtk DataFile Version 5.1\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nFIELD FieldData 1\nTIME 1 1 double\n0.5\n" +
      kPoints +
      "METADATA\nINFORMATION 1\nNAME L2_NORM_RANGE LOCATION vtkDataArray\nDATA 2 0 1.7\n\nCELLS 2 8\nOFFSETS "
      "vtktypeint64\n0 8\nCONNECTIVITY vtktypeint64\n0 1 2 3 4 5 6 7\nCELL_TYPES 1\n12\n");
  EXPECT_THAT(file.mesh.cell_vertices, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7));
}

TEST(ReadVtk, PointScalarsAndFieldsBecomeChannels) {
  const MeshFile file = read_vtk(kHead + kPoints + kHex +
                                 "CELL_DATA 1\nSCALARS id int 1\nLOOKUP_TABLE default\n7\n"
                                 "POINT_DATA 8\nSCALARS hard%20ness float\nLOOKUP_TABLE default\n0 1 2 3 4 5 6 7\n"
                                 "VECTORS v float\n0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0\n"
                                 "FIELD FieldData 2\nmix 2 8 double\n0 10 1 11 2 12 3 13 4 14 5 15 6 16 7 17\n"
                                 "names 1 8 string\na b\nc\nd\ne\nf\ng\nh\ni\n");
  EXPECT_THAT(file.mesh.channel_names, ElementsAre("hard ness", "mix.0", "mix.1"));
  ASSERT_EQ(file.mesh.channel_values.size(), 24u);
  EXPECT_THAT(std::vector<float>(file.mesh.channel_values.begin() + 3, file.mesh.channel_values.begin() + 6),
              ElementsAre(1.f, 1.f, 11.f));
  EXPECT_THAT(file.warnings,
              ElementsAre("cell data 'id' left out", "point data 'v' left out", "point data 'names' left out"));
}

TEST(ReadVtk, LeavesOutFlatCellsAndSaysSo) {
  const MeshFile file =
      read_vtk(kHead + kPoints + "CELLS 3 16\n4 0 1 2 3\n8 0 1 2 3 4 5 6 7\n1 0\nCELL_TYPES 3\n9 12 1\n");
  EXPECT_EQ(file.mesh.cell_count(), 1u);
  EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("2 points, lines or faces among the cells left out (cells 0, 2)")));
}

TEST(ReadVtk, RefusesPyramidsByCell) {
  expect_error([] { read_vtk(kHead + kPoints + "CELLS 2 15\n8 0 1 2 3 4 5 6 7\n5 0 1 2 3 4\nCELL_TYPES 2\n12 14\n"); },
               ErrorCode::kMeshUnsupportedCell, "1 pyramids (cells 1, counted from 0)");
  expect_error([] { read_vtk(kHead + kPoints + "CELLS 1 9\n8 0 1 2 3 4 5 6 7\nCELL_TYPES 1\n42\n"); },
               ErrorCode::kMeshUnsupportedCell, "VTK type 42");
}

TEST(ReadVtk, RefusesOtherKindsOfFiles) {
  expect_error([] { read_vtk("# vtk DataFile Version 3.0\nt\nBINARY\nDATASET UNSTRUCTURED_GRID\n"); },
               ErrorCode::kFileUnsupported, "ASCII");
  expect_error([] { read_vtk("# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\n"); },
               ErrorCode::kFileUnsupported, "POLYDATA");
  expect_error([] { read_vtk("<?xml version=\"1.0\"?>"); }, ErrorCode::kFileSyntax, "vtk DataFile");
}

TEST(ReadVtk, NamesLineAndToken) {
  expect_error([] { read_vtk(kHead + "POINTS 2 float\n0 0 0\n1 x 0\n"); }, ErrorCode::kFileSyntax,
               "line 7: expected a coordinate, found 'x'");
  expect_error([] { read_vtk(kHead + kPoints + "SPLINES 3\n"); }, ErrorCode::kFileSyntax, "line 8");
}

TEST(ReadVtk, RefusesCellsThatDoNotFitTogether) {
  expect_error([] { read_vtk(kHead + kPoints + "CELLS 1 9\n7 0 1 2 3 4 5 6\nCELL_TYPES 1\n12\n"); },
               ErrorCode::kFileSyntax, "has 8 corners, but lists 7");
  expect_error([] { read_vtk(kHead + kPoints + "CELLS 1 5\n8 0 1 2 3 4 5 6 7\nCELL_TYPES 1\n12\n"); },
               ErrorCode::kFileSyntax, "announces");
  expect_error([] { read_vtk(kHead + kPoints + "CELLS 1 9\n8 0 1 2 3 4 5 6 7\n"); }, ErrorCode::kFileSyntax,
               "1 cells but 0 cell types");
  expect_error([] { read_vtk(kHead + kPoints + "CELLS 1 9\n8 0 1 2 3 4 5 6 8\nCELL_TYPES 1\n12\n"); },
               ErrorCode::kMeshIndexOutOfRange, "cells 0");
  expect_error([] { read_vtk(kHead + kPoints + kHex + "POINT_DATA 7\nSCALARS a float\n1 2 3 4 5 6 7\n"); },
               ErrorCode::kFileSyntax, "7 values for 8 points");
}

TEST(ReadVtk, RefusesOffsetsThatFall) {
  const std::string head = "# vtk DataFile Version 5.1\nt\nASCII\nDATASET UNSTRUCTURED_GRID\n" + kPoints;
  for (const char* offsets : {"0 8 7", "1 8 8", "0 9 8", "0 8 18446744073709551615", "0 4 7"}) {
    expect_error(
        [&] {
          read_vtk(head + "CELLS 3 8\nOFFSETS vtktypeint64\n" + offsets +
                   "\nCONNECTIVITY vtktypeint64\n0 1 2 3 4 5 6 7\nCELL_TYPES 2\n12 12\n");
        },
        ErrorCode::kFileSyntax, "offset");
  }
}

TEST(ReadVtk, NeverAllocatesOrLoopsOverWhatAFileMerelyClaims) {
  const std::string huge = "9007199254740992";
  expect_error([&] { read_vtk(kHead + "POINTS " + huge + " float\n"); }, ErrorCode::kMeshTooLarge, "at most");
  expect_error([&] { read_vtk(kHead + "POINTS 16000000 float\n"); }, ErrorCode::kFileSyntax, "coordinate");
  expect_error([&] { read_vtk(kHead + kPoints + "CELLS 2 " + huge + "\n" + huge + " 0 1\n"); }, ErrorCode::kFileSyntax,
               "");
  expect_error([&] { read_vtk(kHead + "FIELD f 1\na 0 " + huge + " float\n1 2 3"); }, ErrorCode::kFileSyntax,
               "components");
  expect_error([&] { read_vtk(kHead + "POINT_DATA " + huge + "\nCOLOR_SCALARS c 0\n1 2 3"); }, ErrorCode::kFileSyntax,
               "components");
  expect_error([&] { read_vtk(kHead + "POINT_DATA " + huge + "\nVECTORS v float\n1 2 3"); }, ErrorCode::kFileSyntax,
               "value");
  expect_error([&] { read_vtk(kHead + "FIELD f " + huge); }, ErrorCode::kFileSyntax, "");
  expect_error([&] { read_vtk(kHead + "FIELD f 1\na 1 " + huge + " string\nx\n"); }, ErrorCode::kFileSyntax, "string");
}

TEST(ReadVtk, EveryTruncationFailsCleanly) {
  const std::string text = kHead + kPoints + kHex;
  for (std::size_t length = 0; length + 2 < text.size(); ++length) {
    EXPECT_THROW(read_vtk(text.substr(0, length)), Error) << length;
  }
}

}  // namespace
}  // namespace ccslice
