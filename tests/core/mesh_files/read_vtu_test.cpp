// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/read_vtu.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/base/read_file.h"
#include "core/mesh/validate.h"
#include "core/mesh_files/read_mesh.h"
#include "core/mesh_import/cell_numbers.h"
#include "core/mesh_import/join_points.h"
#include "tests/core/mesh/expect_error.h"

namespace ccslice {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

std::string array(const std::string& name, const std::string& type, const std::string& values, int components = 1) {
  return "<DataArray type=\"" + type + "\" Name=\"" + name + "\" NumberOfComponents=\"" + std::to_string(components) +
         "\" format=\"ascii\">\n" + values + "\n</DataArray>\n";
}

std::string piece(int points, const std::string& positions, int cells, const std::string& connectivity,
                  const std::string& offsets, const std::string& types, const std::string& data = "") {
  return "<Piece NumberOfPoints=\"" + std::to_string(points) + "\" NumberOfCells=\"" + std::to_string(cells) + "\">" +
         data + "<Points>" + array("Points", "Float64", positions, 3) + "</Points><Cells>" +
         array("connectivity", "Int64", connectivity) + array("offsets", "Int64", offsets) +
         array("types", "UInt8", types) + "</Cells></Piece>";
}

std::string whole(const std::string& pieces, const std::string& attributes = "byte_order=\"LittleEndian\"") {
  return "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" " + attributes +
         ">\n<UnstructuredGrid>\n" + pieces + "\n</UnstructuredGrid>\n</VTKFile>\n";
}

std::string point_data(const std::string& arrays, const std::string& attributes = "") {
  return "<PointData " + attributes + ">" + arrays + "</PointData>";
}

const std::string kTetPoints = "0 0 0  1 0 0  0 1 0  0 0 1";
std::string tet(const std::string& data = "") { return piece(4, kTetPoints, 1, "0 1 2 3", "4", "10", data); }

std::string with_replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(ReadVtu, ReadsText) {
  const std::string heat =
      array("heat &amp; &lt;flow&gt;", "Float32", "1 2 3 4") + array("v", "Int8", "1 -1 2 -2 3 -3 4 -4", 2);
  const MeshFile file = read_vtu(whole(tet(point_data(heat))));
  EXPECT_THAT(file.mesh.positions, ElementsAre(Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)));
  EXPECT_THAT(file.mesh.cell_vertices, ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(file.mesh.channel_names, ElementsAre("heat & <flow>", "v.0", "v.1"));
  EXPECT_THAT(file.mesh.channel_values, ElementsAre(1, 1, -1, 2, 2, -2, 3, 3, -3, 4, 4, -4));
  EXPECT_TRUE(file.warnings.empty());
  EXPECT_EQ(read_mesh("\xef\xbb\xbf" + whole(tet())).mesh.cell_count(), 1u);
}

TEST(ReadVtu, LeavesOutWhatIsNoChannel) {
  const std::string data = array("up", "Float32", "0 0 0 0 0 0 0 0 0 0 0 0", 3) +
                           "<Array type=\"String\" Name=\"names\" format=\"ascii\">97 0</Array>" +
                           array(std::string(257, 'x'), "Int32", "1 2 3 4") + array("a", "Int32", "1 2 3 4");
  const std::string cell_data = array("share", "Float32", "0.5") + array("none", "Int32", "", 0) +
                                "<Array type=\"String\" Name=\"id\" format=\"ascii\">97 0</Array>";
  const MeshFile file = read_vtu(whole(with_replaced(tet(point_data(data, "Normals=\"up\"")), "<Points>",
                                                     "<CellData>" + cell_data + "</CellData><Points>")));
  EXPECT_THAT(file.mesh.channel_names, ElementsAre("a"));
  EXPECT_THAT(file.warnings,
              ElementsAre(HasSubstr("a name of 257 bytes"), "point data 'up' left out", "point data 'names' left out",
                          "cell data 'none' left out", "cell data 'id' left out"));
  ASSERT_EQ(file.cell_numbers.size(), 1u);
  EXPECT_THAT(file.cell_numbers[0].of_cells, ElementsAre(0.5));
}

std::string with_cell_data(const std::string& piece, const std::string& data) {
  return with_replaced(piece, "<Points>", "<CellData>" + data + "</CellData><Points>");
}

// Numbers are kept of volume cells that are no ghosts, from all pieces.
TEST(ReadVtu, KeepsNumbersOfCells) {
  const std::string first = with_cell_data(
      piece(4, kTetPoints, 3, "0 1 2 0 1 2 3 0 1 2 3", "3 7 11", "5 10 10", ""),
      array("part", "Float64", "1 2 -3") + array("rank", "Int32", "4 5 6") + array("vtkGhostType", "UInt8", "0 2 1"));
  const std::string second = with_cell_data(piece(4, "5 0 0  6 0 0  5 1 0  5 0 1", 1, "0 1 2 3", "4", "10", ""),
                                            array("late", "Int32", "1") + array("part", "Int8", "9"));
  const MeshFile one = read_vtu(whole(first));
  ASSERT_EQ(one.cell_numbers.size(), 2u);
  EXPECT_EQ(one.cell_numbers[0].name, "part");
  EXPECT_THAT(one.cell_numbers[0].of_cells, ElementsAre(2));
  const MeshFile file = read_vtu(whole(first + second));
  ASSERT_EQ(file.cell_numbers.size(), 1u);
  EXPECT_THAT(file.cell_numbers[0].of_cells, ElementsAre(2, 9));
  EXPECT_THAT(file.warnings, testing::IsSupersetOf({"cell data 'rank' left out", "cell data 'late' left out"}));
}

std::string named_numbers(const std::string& numbers, const std::string& fields) {
  return "<FieldData>" + fields + "</FieldData>" + with_cell_data(tet(), array("part", "Int32", numbers));
}

std::string field(const std::string& name, const std::string& number, const std::string& tuples = "1") {
  return "<DataArray type=\"Int32\" Name=\"" + name + "\" NumberOfTuples=\"" + tuples + "\" format=\"ascii\">" +
         number + "</DataArray>";
}

TEST(ReadVtu, CallsNumbersOfCellsAsFieldDataDo) {
  MeshFile file = read_vtu(whole(named_numbers("7", field("part:core", "7") + field("part:shell", "-1") +
                                                        field("other:x", "7") + field("part", "7") +
                                                        "<Array type=\"String\" Name=\"part:y\" NumberOfTuples=\"1\" "
                                                        "format=\"ascii\">97 0</Array>" +
                                                        field("part:long", "1 2", "2"))));
  ASSERT_EQ(file.cell_numbers.size(), 1u);
  EXPECT_THAT(file.cell_numbers[0].number_names, ElementsAre(std::pair(-1, "shell"), std::pair(7, "core")));
  make_cell_regions("part", file);
  EXPECT_THAT(file.mesh.cell_region_names, ElementsAre("core"));
}

TEST(ReadVtu, TakesNoNamesThatNumbersDoNotHaveOneOfTheirOwnOf) {
  for (const std::string& fields :
       {field("part:core", "8"), field("part:core", "7") + field("part:core", "8"), field("part:", "7"),
        field("part:a", "7") + field("part:b", "7"), field("part:core", "7.5"), field("part:core", "nan")}) {
    MeshFile file = read_vtu(whole(named_numbers("7", fields)));
    EXPECT_TRUE(file.cell_numbers[0].number_names.empty()) << fields;
    make_cell_regions("part", file);
    EXPECT_THAT(file.mesh.cell_region_names, ElementsAre("7"));
  }
}

TEST(ReadVtu, LeavesOutNamesOfNumbersThatAreBroken) {
  const std::string broken_base64 =
      "<DataArray type=\"Int32\" Name=\"part:core\" NumberOfTuples=\"1\" format=\"binary\">no base64!</DataArray>";
  for (const std::string& fields :
       {field("part:core", "x"), field("part:core", ""), field("part:core", "7 8"), broken_base64,
        std::string("<DataArray type=\"Int32\" Name=\"part:core\" NumberOfTuples=\"1\" format=\"appended\" "
                    "offset=\"7\"/>")}) {
    MeshFile file = read_vtu(whole(named_numbers("7", fields)));
    EXPECT_TRUE(file.cell_numbers[0].number_names.empty()) << fields;
    EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("field data 'part:core' left out: "))) << fields;
    make_cell_regions("part", file);
    EXPECT_THAT(file.mesh.cell_region_names, ElementsAre("7"));
  }
  EXPECT_THAT(read_vtu(whole(named_numbers("7", field("part:core", "x")))).warnings,
              ElementsAre(HasSubstr("expected a number with a name, found 'x'")));
}

TEST(ReadVtu, ReadsArraysThatComeTwiceOnce) {
  const std::string twice = array("a", "Int32", "1 2 3 4") + array("a", "Int32", "no numbers");
  const MeshFile file = read_vtu(
      whole(with_cell_data(tet(point_data(twice)), array("part", "Int32", "1") + array("part", "Int32", "no number"))));
  EXPECT_THAT(file.mesh.channel_values, ElementsAre(1, 2, 3, 4));
  ASSERT_EQ(file.cell_numbers.size(), 1u);
  EXPECT_THAT(file.cell_numbers[0].of_cells, ElementsAre(1));
  EXPECT_THAT(file.warnings, ElementsAre("point data 'a' comes twice in a piece: the first is read",
                                         "cell data 'part' comes twice in a piece: the first is read"));
}

TEST(ReadVtu, KeepsTheFirstSixteenNumbersOfCells) {
  std::string data;
  for (int i = 0; i < 15; ++i) data += array("n" + std::to_string(i), "Int32", "1");
  data += array("pair", "Int32", "1 2", 2) + array("n15", "Int32", "1") + array("n16", "Int32", "1");
  const MeshFile file = read_vtu(whole(with_cell_data(tet(), data)));
  EXPECT_EQ(file.cell_numbers.size(), 16u);
  EXPECT_THAT(file.warnings, ElementsAre("cell data 'pair' left out", "cell data 'n16' left out"));
}

TEST(ReadVtu, VectorsAtCellsBecomeNumbersOfTheirComponents) {
  const auto tet_with = [](const std::string& points, const std::string& data) {
    return with_cell_data(piece(4, points, 1, "0 1 2 3", "4", "10", ""), data);
  };
  const std::string far_points = "5 0 0  6 0 0  5 1 0  5 0 1";
  const std::string first = tet_with(kTetPoints, array("force", "Float32", "1 2 3", 3) + array("n", "Int32", "7"));
  const MeshFile file =
      read_vtu(whole(first + tet_with(far_points, array("n", "Int32", "8") + array("force", "Float64", "4 5 6", 3))));
  ASSERT_EQ(file.cell_numbers.size(), 4u);
  EXPECT_EQ(file.cell_numbers[1].name, "force.1");
  EXPECT_THAT(file.cell_numbers[1].of_cells, ElementsAre(2, 5));
  EXPECT_THAT(file.cell_numbers[2].of_cells, ElementsAre(3, 6));
  EXPECT_THAT(file.cell_numbers[3].of_cells, ElementsAre(7, 8));
  const MeshFile mixed = read_vtu(whole(first + tet_with(far_points, array("force", "Float64", "4 5", 2))));
  ASSERT_EQ(mixed.cell_numbers.size(), 2u) << "components that every piece has";
  EXPECT_THAT(mixed.cell_numbers[1].of_cells, ElementsAre(2, 5));
}

TEST(ReadVtu, TakesCellsOfSecondOrderByTheirCorners) {
  struct Curved {
    int type, points;
    CellKind kind;
  };
  for (const auto& [type, points, kind] :
       {Curved{24, 10, CellKind::kTet}, Curved{25, 20, CellKind::kHex}, Curved{26, 15, CellKind::kWedge},
        Curved{29, 27, CellKind::kHex}, Curved{32, 18, CellKind::kWedge}, Curved{33, 24, CellKind::kHex}}) {
    std::string positions, ids;
    for (int i = 0; i < points; ++i) {
      positions += std::to_string(i) + " 0 0 ";
      ids += std::to_string(i) + " ";
    }
    const MeshFile file =
        read_vtu(whole(piece(points, positions, 1, ids, std::to_string(points), std::to_string(type))));
    EXPECT_THAT(file.mesh.cell_kinds, ElementsAre(kind));
    EXPECT_EQ(file.mesh.vertex_count(), static_cast<std::size_t>(corner_count(kind))) << type;
    EXPECT_EQ(file.mesh.positions.back().x(), corner_count(kind) - 1);
    EXPECT_FALSE(file.mesh.mid_nodes.empty());
    EXPECT_TRUE(file.warnings.empty());
  }
}

// Two tetrahedra that share a face, in two pieces; the second one repeats its points, in another order, and has the
// first one's cell as a ghost.
std::string two_pieces(const std::string& first, const std::string& second) {
  const std::string ghosts = "<CellData>" + array("vtkGhostType", "UInt8", "0 1") + "</CellData>";
  return whole(piece(4, kTetPoints, 1, "0 1 2 3", "4", "10", first) +
               "<Piece NumberOfPoints=\"0\" NumberOfCells=\"0\"></Piece>" +
               piece(5, "1 1 1  0 0 1  0 -0.0 0  1 0 0  0 1 0", 2, "3 4 1 0 2 3 4 1", "4 8", "10 10", ghosts + second));
}

// Points in one place are joined later, like those of any file (core/mesh_import/join_points.h).
TEST(ReadVtu, PutsPiecesOneAfterAnother) {
  const std::string values = point_data(array("c", "Int32", "1 1 1 1 1") + array("a", "Int32", "5 2 1 3 4"));
  MeshFile file =
      read_vtu(two_pieces(point_data(array("a", "Int32", "1 3 4 2") + array("b", "Int32", "1 1 1 1")), values));
  EXPECT_EQ(file.mesh.vertex_count(), 8u) << "without the one of the ghost alone";
  EXPECT_EQ(file.mesh.cell_count(), 2u);
  EXPECT_THAT(file.mesh.cell_vertices, ElementsAre(0, 1, 2, 3, 6, 7, 5, 4));
  EXPECT_THAT(file.mesh.channel_names, ElementsAre("a"));
  EXPECT_THAT(file.mesh.channel_values, ElementsAre(1, 3, 4, 2, 5, 2, 3, 4));
  EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("1 vertex that no cell uses left out"),
                                         "1 ghost cells left out: other pieces have them",
                                         "point data 'c' left out: not every piece has it once",
                                         "point data 'b' left out: not every piece has it once"));
  EXPECT_EQ(join_points(0, file.mesh, file.numbers).places, 3u);
  EXPECT_EQ(file.mesh.vertex_count(), 5u);
  EXPECT_THAT(file.mesh.channel_values, ElementsAre(1, 3, 4, 2, 5));
  EXPECT_NO_THROW(validate(file.mesh));
}

TEST(ReadVtu, TakesAnyNumbersWhereNoCellIs) {
  const std::string data = point_data(array("a", "Float64", "1 2 3 4 1e99"));
  const std::string text = whole(piece(5, kTetPoints + " nan inf 0", 1, "0 1 2 3", "4", "10", data));
  const MeshFile file = read_vtu(text);
  EXPECT_EQ(file.mesh.vertex_count(), 4u);
  EXPECT_THAT(file.warnings, ElementsAre(HasSubstr("1 vertex that no cell uses left out")));
  const std::string used = with_replaced(text, "0 1 2 3\n", "4 1 2 3\n");
  expect_error([&] { read_vtu(used); }, ErrorCode::kMeshNonFinite,
               "byte " + std::to_string(used.find("nan")) + ": 'nan', a coordinate of point 4, is");
}

void expect(const std::string& text, ErrorCode code, const std::string& part) {
  SCOPED_TRACE(part);
  expect_error([&] { (void)read_vtu(text); }, code, part);
}

TEST(ReadVtu, NamesByteAndToken) {
  const std::string text = whole(tet());
  const auto expect_at = [&](const std::string& from, const std::string& to, const std::string& token,
                             const std::string& part) {
    const std::string changed = with_replaced(text, from, to);
    expect(changed, ErrorCode::kFileSyntax, "byte " + std::to_string(changed.find(token)) + ": " + part);
  };
  expect_at("1 0 0", "1 zero 0", "zero", "expected a coordinate, found 'zero'");
  expect_at("0 1 2 3\n", "0 1 2 three\n", "three", "expected a point id, found 'three'");
  expect_at("0 1 2 3\n", "0 1 2 3 99\n", "99", "expected the end of the array, found '99'");
  expect_at("\n10\n", "\n1x\n", "1x", "expected a cell type, found '1x'");
  expect_at("\n10\n", "\n300\n", "300", "expected a VTK cell type, found '300'");
  expect_at("\n4\n", "\n-4\n", "-4", "expected an offset, found '-4'");
  expect(with_replaced(text, "\n4\n", "\n99999999999\n"), ErrorCode::kFileSyntax, "expected offsets that never fall");
  expect(with_replaced(text, "\n4\n", "\n5\n"), ErrorCode::kFileSyntax, "expected a point id, found the end");
  expect(with_replaced(text, "\n4\n", "\n3\n"), ErrorCode::kFileSyntax, "expected the end of the array, found '3'");
  expect(with_replaced(text, "0 1 2 3\n", "0 1 2 4\n"), ErrorCode::kMeshIndexOutOfRange, "point id 4; the piece has 4");
  expect(with_replaced(text, "\n10\n", "\n16\n"), ErrorCode::kMeshUnsupportedCell,
         "1 cell of VTK type 16, hexagonal prisms (cell 0");
  expect(with_replaced(text, "\n10\n", "\n42\n"), ErrorCode::kFileSyntax, "expected DataArray 'polyhedron_offsets'");
  expect(with_replaced(text, "\n10\n", "\n12\n"), ErrorCode::kFileSyntax, "which has 8 corners, but lists 4");
  expect(with_replaced(text, "\n10\n", "\n24\n"), ErrorCode::kFileSyntax, "which has 10 points, but lists 4");
  expect(with_replaced(text, "\n10\n", "\n5\n"), ErrorCode::kMeshEmpty, "volume cells");
  expect(with_replaced(text, "NumberOfComponents=\"3\"", "NumberOfComponents=\"2\""), ErrorCode::kFileSyntax,
         "points need 3 components");
  expect(with_replaced(text, "NumberOfCells=\"1\"", "NumberOfCells=\"one\""), ErrorCode::kFileSyntax,
         "expected a whole number as NumberOfCells, found 'one'");
  expect(with_replaced(text, "NumberOfPoints=\"4\"", "NumberOfPoints=\"99999999\""), ErrorCode::kMeshTooLarge,
         "NumberOfPoints is 99999999, at most");
  expect(with_replaced(text, "\"types\"", "\"kinds\""), ErrorCode::kFileSyntax, "expected DataArray 'types' in Cells");
  expect(whole("<Piece NumberOfPoints=\"4\" NumberOfCells=\"1\"/>"), ErrorCode::kFileSyntax, "expected Points");
  expect(whole(""), ErrorCode::kMeshEmpty, "no Piece");
  std::string many;
  for (int i = 0; i < 22; ++i) many += array("v" + std::to_string(i), "Int8", "1 2 3 1 2 3 1 2 3 1 2 3", 3);
  expect(whole(tet(point_data(many))), ErrorCode::kMeshTooLarge, "point data 'v21' makes more than 64 channels");
}

/// The house of tests/data/meshes in one of the layouts of polyhedra.
std::string polyhedra(const char* name) {
  return read_file_bytes(CCSLICE_TEST_DATA_DIR "/meshes/" + std::string(name), 1 << 20);
}

TEST(ReadVtu, RefusesFacesThatDoNotFitTogether) {
  const std::string old = polyhedra("polyhedra_vtk.vtu"), now = polyhedra("polyhedra_vtk_2_3.vtu");
  EXPECT_EQ(read_vtu(old).mesh.cell_vertices, read_vtu(now).mesh.cell_vertices);
  const auto refused = [](const std::string& text, const std::string& from, const std::string& to, ErrorCode code,
                          const std::string& part) { expect(with_replaced(text, from, to), code, part); };
  refused(old, "31 55 72", "31 56 72", ErrorCode::kFileSyntax, "expected faces as long as faceoffsets tell");
  refused(old, "31 55 72", "31 55 71", ErrorCode::kFileSyntax, "expected faces as long as faceoffsets tell");
  refused(old, "31 55 72", "31 30 72", ErrorCode::kFileSyntax, "expected offsets that never fall");
  refused(old, "31 55 72", "31 55 73", ErrorCode::kFileSyntax, "expected faces as long as faceoffsets tell");
  refused(old, "31 55 72", "31 55 -1", ErrorCode::kFileSyntax, "expected the end of the array");
  refused(old, "6 4 0 4 7 3", "6 4 0 4 7 99", ErrorCode::kMeshIndexOutOfRange, "point id 99; the piece has 11");
  refused(now, "6 11 15", "6 11 16", ErrorCode::kFileSyntax, "expected a face's number, found the end");
  refused(now, "6 11 15", "6 5 15", ErrorCode::kFileSyntax, "expected offsets that never fall");
  refused(now, ">0 1 2 3 4 5 6 7 8 9 10", ">9999999999999", ErrorCode::kFileSyntax, "expected a face's number");
  refused(now, "0 4 7 3 1 2", "0 4 7 99 1 2", ErrorCode::kMeshIndexOutOfRange, "point id 99; the piece has 11");
  refused(now, "0 4 7 3 1 2", "0 4 7 7 1 2", ErrorCode::kMeshUnsupportedCell,
          "(VTK type 42), is a polyhedron of 6 faces");
  refused(now, "face_offsets", "face_ends", ErrorCode::kFileSyntax, "expected DataArray 'face_offsets'");
}

TEST(ReadVtu, PolyhedraBesideOtherCellsAndInLaterPiecesAreRead) {
  const std::string faces = array("faces", "Int64", "4 3 0 2 1 3 0 1 3 3 1 2 3 3 2 0 3") +
                            array("faceoffsets", "Int64", "-1 17 -1") + "</Cells>";
  const std::string second = with_replaced(
      piece(5, "5 0 0  6 0 0  5 1 0  5 0 1  5 -1 0", 3, "0 1 0 1 2 3 0 1 3 4", "2 6 10", "3 42 10"), "</Cells>", faces);
  const MeshFile file = read_vtu(whole(tet() + second));
  EXPECT_EQ(file.mesh.cell_kinds, std::vector(3, CellKind::kTet));
  EXPECT_THAT(file.numbers.cells, ElementsAre(0, 2, 3)) << "counted through all pieces";
  std::set<std::uint32_t> polyhedron(file.mesh.cell_vertices.begin() + 4, file.mesh.cell_vertices.begin() + 8);
  EXPECT_THAT(polyhedron, ElementsAre(4, 5, 6, 7));
}

TEST(ReadVtu, MindsCompressorsOnlyWhereSomethingIsCompressed) {
  const auto naming = [](std::string text, const std::string& compressor) {
    const std::size_t at = text.find("compressor=\"");
    if (at != std::string::npos) text.erase(at, text.find('"', at + 12) + 1 - at);
    return with_replaced(text, "byte_order", "compressor=\"" + compressor + "\" byte_order");
  };
  for (const char* name : {"vtkLZ4DataCompressor", "vtkLZMADataCompressor", "vtkNewDataCompressor"}) {
    EXPECT_EQ(read_vtu(naming(whole(tet()), name)).mesh.cell_count(), 1u) << name;
  }
  expect(naming(polyhedra("vtk_binary_lz4.vtu"), "vtkNewDataCompressor"), ErrorCode::kFileUnsupported,
         "compressor 'vtkNewDataCompressor' is not known; save it with zlib, LZ4, LZMA or without compression");
}

TEST(ReadVtu, ReadsNumbersWithASign) {
  const std::string text = with_replaced(tet(), "NumberOfPoints=\"4\"", "NumberOfPoints=\"+4\"");
  EXPECT_EQ(read_vtu(whole(piece(0, "", 0, "", "", "") + text)).mesh.cell_count(), 1u);
  expect(whole(with_replaced(tet(), "NumberOfPoints=\"4\"", "NumberOfPoints=\"++4\"")), ErrorCode::kFileSyntax,
         "expected a whole number as NumberOfPoints, found '++4'");
}

TEST(ReadVtu, SaysThatALonePieceIsOne) {
  const std::string ghosts = "<CellData>" + array("vtkGhostType", "UInt8", "0 1") + "</CellData>";
  const MeshFile file = read_vtu(whole(piece(5, kTetPoints + " 1 1 1", 2, "0 1 2 3 1 2 3 4", "4 8", "10 10", ghosts)));
  EXPECT_EQ(file.mesh.cell_count(), 1u);
  EXPECT_THAT(file.warnings, testing::Contains("1 ghost cells left out: other pieces have them, and this is one piece "
                                               "only: give the .pvtu that names all, or merge all into one .vtu"));
}

/// A folder with a .pvtu and what it names.
class ReadPvtu : public testing::Test {
 protected:
  ReadPvtu() { fs::create_directories(folder_ / "pieces"); }
  ~ReadPvtu() override { fs::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) const { std::ofstream(folder_ / name) << text; }
  static std::string naming(const std::vector<std::string>& sources) {
    std::string pieces;
    for (const std::string& source : sources) pieces += "<Piece Source=\"" + source + "\"/>";
    return "<?xml version=\"1.0\"?><VTKFile type=\"PUnstructuredGrid\" version=\"0.1\"><PUnstructuredGrid "
           "GhostLevel=\"0\">" +
           pieces + "</PUnstructuredGrid></VTKFile>";
  }
  MeshFile read(const std::vector<std::string>& sources, const FileOrigin& more = {}) const {
    FileOrigin origin = more;
    origin.path = (folder_ / "part.pvtu").string();
    return read_vtu(naming(sources), {}, origin);
  }
  void refused(const std::vector<std::string>& sources, ErrorCode code, const std::string& part) const {
    expect_error([&] { (void)read(sources); }, code, part);
  }

  const fs::path folder_ = fs::path(testing::TempDir()) / ("ccslice_read_pvtu_" + std::to_string(getpid()));
};

TEST_F(ReadPvtu, ReadsAllPiecesAsOneFile) {
  const auto heat = [](const std::string& values) { return point_data(array("heat", "Float32", values)); };
  const std::string beside = piece(4, "0 0 0  0 1 0  1 0 0  0 0 -1", 1, "0 1 2 3", "4", "10", heat("1 3 2 5"));
  write("pieces/a.vtu", whole(tet(heat("1 2 3 4"))));
  write("empty.vtu", whole(piece(0, "", 0, "", "", "")));
  write("b.vtu", whole(beside));
  MeshFile file = read({"pieces/a.vtu", "empty.vtu", "B.vtu"});
  EXPECT_EQ(file.mesh.cell_count(), 2u);
  EXPECT_THAT(file.numbers.cells, ElementsAre(0, 1));
  EXPECT_THAT(file.numbers.vertices, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7));
  EXPECT_THAT(file.mesh.channel_values, ElementsAre(1, 2, 3, 4, 1, 3, 2, 5));
  EXPECT_EQ(join_points(0, file.mesh, file.numbers).places, 3u);
}

TEST_F(ReadPvtu, RefusesPiecesThatCannotBeRead) {
  write("a.vtu", whole(tet()));
  write("part.pvtu", naming({"a.vtu"}));
  write("nan.vtu", whole(with_replaced(tet(), "0 0 1", "0 0 nan")));
  refused({}, ErrorCode::kMeshEmpty, "no Piece with points");
  refused({"a.vtu", "b.vtu"}, ErrorCode::kFileUnreadable, "there is no file 'b.vtu' in the folder of");
  refused({"../b.vtu"}, ErrorCode::kFileUnreadable, "piece '../b.vtu' is outside of the folder of");
  refused({""}, ErrorCode::kFileSyntax, "the Piece has no Source");
  refused({"part.pvtu"}, ErrorCode::kFileUnsupported, "piece 'part.pvtu': it names other files, and should be a .vtu");
  refused({"a.vtu", "nan.vtu"}, ErrorCode::kMeshNonFinite, "piece 'nan.vtu': byte ");
  refused({"a.vtu", "nan.vtu"}, ErrorCode::kMeshNonFinite, "a coordinate of point 7");
  expect_error([&] { read_vtu(naming({"a.vtu"})); }, ErrorCode::kFileUnsupported,
               "'a.vtu', which can't be told from its bytes alone: merge them into one .vtu");
  FileOrigin small;
  small.max_bytes = naming({"a.vtu"}).size() + 10;
  expect_error([&] { (void)read({"a.vtu"}, small); }, ErrorCode::kMeshTooLarge, "piece 'a.vtu': ");
}

TEST_F(ReadPvtu, TakesPiecesOfAnotherFolderThatIsAllowed) {
  const fs::path other = folder_.string() + "_other";
  fs::create_directories(other);
  std::ofstream(other / "c.vtu") << whole(tet());
  const std::string source = "../" + other.filename().string() + "/c.vtu";
  refused({source}, ErrorCode::kFileUnreadable, "(--allow-includes)");
  FileOrigin origin;
  origin.includes = other.string();
  EXPECT_EQ(read({source}, origin).mesh.cell_count(), 1u);
  fs::remove_all(other);
}

TEST(ReadVtu, RefusesWhatItDoesNotKnowWithARemedy) {
  const std::string text = whole(tet());
  const auto refuse = [&](const std::string& from, const std::string& to, const std::string& part) {
    expect(with_replaced(text, from, to), ErrorCode::kFileUnsupported, part);
  };
  refuse("type=\"UnstructuredGrid\"", "type=\"PRectilinearGrid\"", "merge its pieces into one .vtu");
  refuse("type=\"UnstructuredGrid\"", "type=\"PolyData\"", "it holds a surface only; a solid needs volume cells");
  refuse("type=\"UnstructuredGrid\"", "type=\"ImageData\"", "save the mesh as UnstructuredGrid");
  refuse("<?xml version=\"1.0\"?>", "<?xml version=\"1.0\" encoding=\"UTF-16\"?>", "save it as UTF-8");
  refuse("Float64", "Float80", "is of type 'Float80'");
  refuse("\"ascii\"", "\"hex\"", "has format 'hex'");
  expect("<svg></svg>", ErrorCode::kFileUnsupported, "no file of VTK's");
  expect(with_replaced(text, "LittleEndian", "MiddleEndian"), ErrorCode::kFileSyntax, "byte_order");
  expect(with_replaced(text, "byte_order", "header_type=\"UInt16\" byte_order"), ErrorCode::kFileSyntax, "header_type");
  expect(text.substr(0, text.size() / 2), ErrorCode::kFileSyntax, "isn't whole XML");
  expect("<VTKFile type=\"UnstructuredGrid\"></VTKFile>", ErrorCode::kFileSyntax, "no UnstructuredGrid");
  std::string wide;
  for (const char c : text) wide += {c, '\0'};
  expect_error([&] { read_mesh(wide); }, ErrorCode::kFileUnsupported, "save it as UTF-8");
  // Entities of its own are no part of what is read, so they can't grow.
  expect(with_replaced(with_replaced(text, "<VTKFile", "<!DOCTYPE VTKFile [<!ENTITY a \"1 0 0\">]><VTKFile"),
                       "1 0 0  0 1", "&a; 0 1"),
         ErrorCode::kFileSyntax, "found '&a;'");
}

TEST(ReadVtu, RefusesWrongOffsetsOfAppendedData) {
  const std::string path = CCSLICE_TEST_DATA_DIR "/meshes/vtk_appended_raw.vtu";
  const std::string file = read_file_bytes(path, 1 << 20);
  const auto at = file.find("offset=\"", file.find("<Points>"));
  const auto with_offset = [&](const std::string& offset) {
    std::string changed = file;
    return changed.replace(at + 8, changed.find('"', at + 8) - at - 8, offset);
  };
  expect(with_offset("99999999"), ErrorCode::kFileSyntax, "has offset 99999999, but the appended data have");
  expect(with_offset("1"), ErrorCode::kFileSyntax, "the array's header claims");
  expect(with_offset("x"), ErrorCode::kFileSyntax, "expected a whole number as offset");
  expect(with_replaced(file, "encoding=\"raw\"", "encoding=\"zip\""), ErrorCode::kFileUnsupported,
         "raw and base64 are read");
  expect(file.substr(0, file.find("<AppendedData")) + "</VTKFile>", ErrorCode::kFileSyntax, "have 0 bytes");
  expect(file.substr(0, file.find("<AppendedData") + 20), ErrorCode::kFileSyntax, "no '_' begins");
  for (std::size_t length = file.find("<AppendedData"); length + 120 < file.size(); length += 7) {
    EXPECT_THROW(read_vtu(file.substr(0, length)), Error) << length;
  }
}

}  // namespace
}  // namespace ccslice
