// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/read_vtk.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <initializer_list>
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
                                 "CELL_DATA 1\nSCALARS id int 1\nLOOKUP_TABLE default\n7\nVECTORS force float\n1 2 3\n"
                                 "POINT_DATA 8\nSCALARS hard%20ness float\nLOOKUP_TABLE default\n0 1 2 3 4 5 6 7\n"
                                 "VECTORS v float\n0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0\n"
                                 "FIELD FieldData 2\nmix 2 8 double\n0 10 1 11 2 12 3 13 4 14 5 15 6 16 7 17\n"
                                 "names 1 8 string\na b\nc\nd\ne\nf\ng\nh\ni\n");
  EXPECT_THAT(file.mesh.channel_names, ElementsAre("hard ness", "v.0", "v.1", "v.2", "mix.0", "mix.1"));
  ASSERT_EQ(file.mesh.channel_values.size(), 48u);
  EXPECT_THAT(std::vector<float>(file.mesh.channel_values.begin() + 6, file.mesh.channel_values.begin() + 12),
              ElementsAre(1.f, 0.f, 0.f, 0.f, 1.f, 11.f));
  EXPECT_THAT(file.warnings, ElementsAre("point data 'names' left out"));
  ASSERT_EQ(file.cell_numbers.size(), 4u);
  EXPECT_EQ(file.cell_numbers[0].name, "id");
  EXPECT_EQ(file.cell_numbers[3].name, "force.2");
  EXPECT_THAT(file.cell_numbers[3].of_cells, ElementsAre(3));
}

TEST(ReadVtk, HasNoComments) {
  const MeshFile file =
      read_vtk(kHead + kPoints + kHex + "POINT_DATA 8\nSCALARS #1 double 1\nLOOKUP_TABLE default\n0 1 2 3 4 5 6 7\n");
  EXPECT_THAT(file.mesh.channel_names, ElementsAre("#1"));
  EXPECT_THAT(file.mesh.channel_values, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7));
}

TEST(ReadVtk, TakesCellsOfSecondOrderByTheirCorners) {
  const MeshFile file = read_vtk(kHead + "POINTS 11 float\n" + "nan 0 0 0 0 0 1 0 0 0 1 0 0 0 1 " +
                                 "1 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1 1\nCELLS 2 15\n10 1 2 3 4 5 6 7 8 9 10\n3 1 2 3\n" +
                                 "CELL_TYPES 2\n24 21\nPOINT_DATA 11\nSCALARS a double\n"
                                 "LOOKUP_TABLE default\nnan 1 2 3 4 5 6 7 8 9 10\nFIELD f 1\n" +
                                 std::string(257, 'x') + " 1 11 int\n0 0 0 0 0 0 0 0 0 0 0\n");
  EXPECT_THAT(file.mesh.cell_kinds, ElementsAre(CellKind::kTet));
  EXPECT_THAT(file.mesh.cell_vertices, ElementsAre(0, 1, 2, 3));
  EXPECT_EQ(file.mesh.positions[3], Vec3(0, 0, 1));
  EXPECT_THAT(file.mesh.channel_values, ElementsAre(1, 2, 3, 4));
  EXPECT_EQ(file.mesh.mid_nodes.edges.size(), 6u);
  EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("a name of 257 bytes"), HasSubstr("1 points, lines or faces"),
                                         HasSubstr("1 vertex that no cell uses")));
}

TEST(ReadVtk, LeavesOutFlatCellsAndSaysSo) {
  const MeshFile file =
      read_vtk(kHead + kPoints + "CELLS 3 16\n4 0 1 2 3\n8 0 1 2 3 4 5 6 7\n1 0\nCELL_TYPES 3\n9 12 1\n");
  EXPECT_EQ(file.mesh.cell_count(), 1u);
  EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("2 points, lines or faces among the cells left out (cells 0, 2)")));
}

TEST(ReadVtk, RefusesOtherCellsByCell) {
  expect_error([] { read_vtk(kHead + kPoints + "CELLS 2 15\n8 0 1 2 3 4 5 6 7\n5 0 1 2 3 4\nCELL_TYPES 2\n12\n41\n"); },
               ErrorCode::kMeshUnsupportedCell, "line 13: 1 cell of VTK type 41 (cell 1, counted from 0)");
  expect_error([] { read_vtk(kHead + kPoints + "CELLS 1 9\n8 0 1 2 3 4 5 6 7\nCELL_TYPES 1\n42\n"); },
               ErrorCode::kMeshUnsupportedCell, "VTK type 42");
}

TEST(ReadVtk, RefusesOtherKindsOfFiles) {
  expect_error([] { read_vtk("# vtk DataFile Version 3.0\nt\nBASE64\nDATASET UNSTRUCTURED_GRID\n"); },
               ErrorCode::kFileSyntax, "expected 'ASCII' or 'BINARY', found 'BASE64'");
  expect_error([] { read_vtk("# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\n"); },
               ErrorCode::kFileUnsupported, "POLYDATA' holds a surface only; a solid needs volume cells");
  expect_error([] { read_vtk("# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_GRID\n"); },
               ErrorCode::kFileUnsupported, "'STRUCTURED_GRID' is not read; save the mesh as UNSTRUCTURED_GRID");
  expect_error([] { read_vtk("<?xml version=\"1.0\"?>"); }, ErrorCode::kFileSyntax, "vtk DataFile");
}

TEST(ReadVtk, NamesLineAndToken) {
  expect_error([] { read_vtk(kHead + "POINTS 2 float\n0 0 0\n1 x 0\n"); }, ErrorCode::kFileSyntax,
               "line 7: expected a coordinate, found 'x'");
  expect_error([] { read_vtk(kHead + kPoints + "SPLINES 3\n"); }, ErrorCode::kFileSyntax, "line 8");
}

TEST(ReadVtk, RefusesCellsThatDoNotFitTogether) {
  expect_error([] { read_vtk(kHead + kPoints + "CELLS 1 9\n7 0 1 2 3 4 5 6\nCELL_TYPES 1\n12\n"); },
               ErrorCode::kFileSyntax, "line 9: cell 0 (from 0) is of VTK type 12, which has 8 corners, but lists 7");
  expect_error([] { read_vtk(kHead + kPoints + "CELLS 1 5\n8 0 1 2 3 4 5 6 7\nCELL_TYPES 1\n12\n"); },
               ErrorCode::kFileSyntax, "announces");
  expect_error([] { read_vtk(kHead + kPoints + "CELLS 1 9\n8 0 1 2 3 4 5 6 7\n"); }, ErrorCode::kFileSyntax,
               "line 9: the file has 1 cells but 0 cell types");
  expect_error([] { read_vtk(kHead + kPoints + "CELLS 1 9\n8 0 1 2 3 4 5 6 7\nCELL_TYPES 2\n12 12\n"); },
               ErrorCode::kFileSyntax, "line 10: the file has 1 cells but 2 cell types");
  expect_error([] { read_vtk(kHead + kPoints + "CELLS 1 9\n8 0 1 2 3 4 5 6 8\nCELL_TYPES 1\n12\n"); },
               ErrorCode::kMeshIndexOutOfRange, "line 9: point id 8; the file has 8 points");
  expect_error([] { read_vtk(kHead + "CELLS 1 9\n8 0 1 2 3 4 5 6 8\nCELL_TYPES 1\n12\n" + kPoints); },
               ErrorCode::kMeshIndexOutOfRange, "the file has 8 vertices, and others are named in cell 0");
  expect_error([] { read_vtk(kHead + kPoints + kHex + "POINT_DATA 7\nSCALARS a float\n1 2 3 4 5 6 7\n"); },
               ErrorCode::kFileSyntax, "POINT_DATA of 7 points; the file has 8");
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

/// The numbers as a binary file has them.
template <typename Integer>
std::string big_endian(std::initializer_list<Integer> numbers) {
  std::string bytes;
  for (const Integer number : numbers) {
    const auto bits = static_cast<std::uint64_t>(number);
    for (int shift = 8 * (static_cast<int>(sizeof(Integer)) - 1); shift >= 0; shift -= 8) {
      bytes += static_cast<char>(bits >> shift & 0xff);
    }
  }
  return bytes + "\n";
}

const std::string kBinaryHead = "# vtk DataFile Version 4.2\nt\nBINARY\nDATASET UNSTRUCTURED_GRID\n";
const std::string kBinaryPoints =
    "POINTS 4 short\n" + big_endian<std::int16_t>({0, 0, 0, 1, 0, 0, 0, 1, 0, -1, -2, 0x0a20});
const std::string kBinaryTet =
    "CELLS 1 5\n" + big_endian<std::int32_t>({4, 0, 1, 2, 3}) + "CELL_TYPES 1\n" + big_endian<std::int32_t>({10});

TEST(ReadVtk, ReadsBinaryIntegersOfAllSizes) {
  const MeshFile file = read_vtk(kBinaryHead + kBinaryPoints + kBinaryTet + "POINT_DATA 4\nFIELD f 4\nbyte 1 4 char\n" +
                                 big_endian<std::int8_t>({-1, 32, 10, 13}) + "word 1 4 unsigned_short\n" +
                                 big_endian<std::uint16_t>({0, 1, 2, 65535}) + "wide 1 4 vtktypeint64\n" +
                                 big_endian<std::int64_t>({0, -1, 1ll << 40, 7}) + "flag 1 4 bit\n\xa0\n");
  EXPECT_EQ(file.mesh.positions[3], Vec3(-1, -2, 2592));
  EXPECT_THAT(file.mesh.channel_names, ElementsAre("byte", "word", "wide", "flag"));
  EXPECT_THAT(file.mesh.channel_values,
              ElementsAre(-1, 0, 0, 1, 32, 1, -1, 0, 10, 2, 1099511627776.f, 1, 13, 65535, 7, 0));
}

TEST(ReadVtk, NamesTheByteInBinaryFiles) {
  const std::string before = kBinaryHead + kBinaryPoints;
  const auto byte = [](const std::string& text) { return "byte " + std::to_string(text.size()) + ": "; };
  expect_error(
      [&] {
        read_vtk(before + "CELLS 1 5\n" + big_endian<std::int32_t>({4, 0, -1, 2, 3}));
      },
      ErrorCode::kFileSyntax, byte(before + "CELLS 1 5\n" + std::string(8, ' ')) + "expected a point id, found '-1'");
  expect_error([&] { read_vtk(before + "SPLINES"); }, ErrorCode::kFileSyntax, byte(before));
  expect_error([&] { read_vtk(kBinaryHead + "POINTS 4 quad\n"); }, ErrorCode::kFileUnsupported, "'quad' is not known");
  expect_error([&] { read_vtk(kBinaryHead + "POINTS 4 short 7\n"); }, ErrorCode::kFileSyntax, "the end of the line");
  expect_error(
      [&] {
        read_vtk(kBinaryHead + "POINTS 4 float\n" +
                 big_endian<std::int32_t>({0, 0, 0x7fc00000, 0, 0, 0, 0, 0, 0, 0, 0, 0}) + kBinaryTet);
      },
      ErrorCode::kMeshNonFinite,
      byte(kBinaryHead + "POINTS 4 float\n" + std::string(8, ' ')) + "a coordinate of point 0, is not a finite number");
  const std::string whole = before + kBinaryTet;
  expect_error(
      [&] {
        read_vtk(whole + "POINT_DATA 4\nSCALARS a float 1\n" + big_endian<std::int32_t>({0, 0, 0, 0}));
      },
      ErrorCode::kFileSyntax, "LOOKUP_TABLE");
}

TEST(ReadVtk, NeverAllocatesOrLoopsOverWhatABinaryFileMerelyClaims) {
  const std::string before = kBinaryHead + kBinaryPoints, huge = "9007199254740992";
  expect_error([&] { read_vtk(kBinaryHead + "POINTS 16000000 double\n"); }, ErrorCode::kFileSyntax, "end of the file");
  expect_error(
      [&] {
        read_vtk(before + "CELLS 2 " + huge + "\n" + big_endian<std::int32_t>({0x7fffffff, 0}));
      },
      ErrorCode::kFileSyntax, "end of the file");
  expect_error([&] { read_vtk(before + "FIELD f 1\na 1024 " + huge + " double\n"); }, ErrorCode::kFileSyntax,
               "end of the file");
  expect_error([&] { read_vtk(before + "FIELD f 1\na 1 " + huge + " string\n\x01\xff\xff\xff\xff"); },
               ErrorCode::kFileSyntax, "a string");
  expect_error([&] { read_vtk(before + "POINT_DATA 4\nLOOKUP_TABLE t " + huge + "\n"); }, ErrorCode::kFileSyntax,
               "a colour");
}

TEST(ReadVtk, EveryTruncationFailsCleanly) {
  const std::string text = kHead + kPoints + kHex;
  for (std::size_t length = 0; length + 2 < text.size(); ++length) {
    EXPECT_THROW(read_vtk(text.substr(0, length)), Error) << length;
  }
  const std::string binary = kBinaryHead + kBinaryPoints + kBinaryTet;
  for (std::size_t length = 0; length + 2 < binary.size(); ++length) {
    EXPECT_THROW(read_vtk(binary.substr(0, length)), Error) << length;
  }
}

}  // namespace
}  // namespace ccslice
