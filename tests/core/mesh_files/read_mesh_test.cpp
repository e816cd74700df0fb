// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/read_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/read_file.h"
#include "core/mesh/validate.h"
#include "core/mesh_files/read_mesh.h"
#include "tests/core/mesh/expect_error.h"

namespace ccslice {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMaxBytes = 64 << 20;

MeshFile read_shared(const std::string& name) {
  return read_mesh(read_file_bytes((fs::path(CCSLICE_SHARED_MESHES_DIR) / name).string(), kMaxBytes));
}

TEST(MeshFile, OfASurfaceIsRefusedWithARemedy) {
  const std::string triangle = "0 0 0\n1 0 0\n0 1 0\n";
  for (const std::string& text :
       {"# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 3 float\n" + triangle +
            "CELLS 1 4\n3 0 1 2\nCELL_TYPES 1\n5\n",
        std::string(
            "MeshVersionFormatted 2\nDimension 3\nVertices\n3\n0 0 0 0\n1 0 0 0\n0 1 0 0\nTriangles\n1\n1 2 3 0\n"
            "End\n"),
        std::string("OVM ASCII\nVertices\n3\n") + triangle +
            "Edges\n3\n0 1\n1 2\n2 0\nFaces\n1\n3 0 2 4\nPolyhedra\n0\n",
        std::string("*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n*ELEMENT, TYPE=S3\n1, 1, 2, 3\n"),
        std::string(
            "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n$EndNodes\n$Elements\n1\n"
            "1 2 2 1 1 1 2 3\n$EndElements\n")}) {
    expect_error([&] { read_mesh(text); }, ErrorCode::kMeshEmpty, "mesh the inside too, as `gmsh -3` does");
  }
}

// The components of an array and another array may come to one name, which can mean one of them only.
TEST(MeshFile, HasNumbersOfCellsByDifferentNamesOnly) {
  const std::string ovm =
      "OVM ASCII\nVertices\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\nEdges\n6\n0 1\n1 2\n2 0\n0 3\n1 3\n2 3\n"
      "Faces\n4\n3 0 2 4\n3 0 8 7\n3 2 10 9\n3 4 6 11\nPolyhedra\n1\n4 1 2 4 6\n"
      "CProp double \"a.1\"\n7\nCProp vec2d \"a\"\n8 9\n";
  const std::string vtk =
      "# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n0 0 0 1 0 0 0 1 0 0 0 1\n"
      "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\nCELL_DATA 1\nFIELD f 2\na.1 1 1 int\n7\na 2 1 int\n8 9\n";
  for (const std::string& text : {ovm, vtk}) {
    const MeshFile file = read_mesh(text);
    ASSERT_EQ(file.cell_numbers.size(), 2u) << text;
    EXPECT_EQ(file.cell_numbers[0].name, "a.1");
    EXPECT_EQ(file.cell_numbers[0].of_cells, std::vector<double>{7});
    EXPECT_EQ(file.cell_numbers[1].name, "a.0");
    EXPECT_EQ(file.cell_numbers[1].of_cells, std::vector<double>{8});
    EXPECT_THAT(file.warnings,
                testing::ElementsAre("cell data 'a.1' left out: others before are called so, too; rename one of the "
                                     "arrays"));
  }
}

TEST(MeshFile, TellsKindsFromTheirFirstLine) {
  EXPECT_EQ(mesh_file_kind("# vtk DataFile Version 2.0\n"), MeshFileKind::kVtk);
  EXPECT_EQ(mesh_file_kind("\n# comment\nMeshVersionFormatted 1"), MeshFileKind::kMedit);
  EXPECT_EQ(mesh_file_kind("OVM ASCII\n"), MeshFileKind::kOvm);
  EXPECT_EQ(mesh_file_kind("OVM\nVertices 1\n"), MeshFileKind::kOvm);
  EXPECT_EQ(mesh_file_kind("*Heading\n"), MeshFileKind::kAbaqus);
  EXPECT_EQ(mesh_file_kind("\n** a comment\n"), MeshFileKind::kAbaqus);
  EXPECT_EQ(mesh_file_kind("<?xml version=\"1.0\"?>"), MeshFileKind::kVtu);
  EXPECT_EQ(mesh_file_kind("\xef\xbb\xbf<VTKFile>"), MeshFileKind::kVtu);
  EXPECT_EQ(mesh_file_kind(std::string_view("<\0?\0", 4)), MeshFileKind::kUnknown);
  EXPECT_EQ(mesh_file_kind("* a list\n"), MeshFileKind::kUnknown);
  EXPECT_EQ(mesh_file_kind("OVMB"), MeshFileKind::kOvm);
  EXPECT_EQ(mesh_file_kind("$MeshFormat\n4.1 0 8\n"), MeshFileKind::kGmsh);
  for (const char* bytes : {"CDF\x01", "CDF\x02", "CDF\x05"}) EXPECT_EQ(mesh_file_kind(bytes), MeshFileKind::kExodus);
  EXPECT_EQ(mesh_file_kind("CDF\x03"), MeshFileKind::kUnknown);
  EXPECT_EQ(mesh_file_kind("solid cube"), MeshFileKind::kUnknown);
  EXPECT_EQ(mesh_file_kind(""), MeshFileKind::kUnknown);
  expect_error([] { read_mesh("solid cube"); }, ErrorCode::kFileUnsupported, "MEDIT");
}

constexpr const char* kTetAmongOthers =
    "# vtk DataFile Version 2.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 6 float\n9 9 9 0 0 0 1 0 0 8 8 8 0 1 0 "
    "0 0 1\nCELLS 1 5\n4 1 2 4 5\nCELL_TYPES 1\n10\nPOINT_DATA 6\nSCALARS kept float\nLOOKUP_TABLE default\n"
    "9 1 2 9 3 4\n";

TEST(MeshFile, LeavesOutVerticesThatNoCellUses) {
  MeshFile file = read_mesh(kTetAmongOthers);
  EXPECT_THAT(file.mesh.positions, testing::ElementsAre(Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)));
  EXPECT_THAT(file.mesh.cell_vertices, testing::ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(file.mesh.channel_values, testing::ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(file.warnings, testing::ElementsAre(testing::HasSubstr("2 vertices that no cell uses left out")));
  EXPECT_NO_THROW(validate(file.mesh));
}

TEST(MeshFile, LeavesOutChannelsWhoseNamesAreTooLong) {
  const std::string name(300, 'x');
  const MeshFile file =
      read_mesh(std::string(kTetAmongOthers) + "SCALARS " + name + " float\nLOOKUP_TABLE default\n0 0 0 0 0 0\n");
  EXPECT_THAT(file.mesh.channel_names, testing::ElementsAre("kept"));
  EXPECT_THAT(file.mesh.channel_values, testing::ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(file.warnings, testing::Contains(testing::HasSubstr("a name of 300 bytes")));
}

// As CAD programs write them: the contract's texts are UTF-8.
TEST(MeshFile, NamesInLatin1BecomeUtf8) {
  const std::string nodes = "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n";
  const std::string element = "*ELEMENT, TYPE=C3D4, ELSET=", section = "*SOLID SECTION, ELSET=";
  const MeshFile abaqus = read_mesh(nodes + element + "K\xd6RPER\n1, 1, 2, 3, 4\n" + section +
                                    "K\xd6RPER, MATERIAL=S\xc4ULE\n*MATERIAL, NAME=S\xc4ULE\n");
  ASSERT_EQ(abaqus.cell_sets.size(), 1u);
  EXPECT_EQ(abaqus.cell_sets[0].name, "K\xc3\x96RPER");
  ASSERT_EQ(abaqus.cell_materials.size(), 1u);
  EXPECT_EQ(abaqus.cell_materials[0].name, "S\xc3\x84ULE");
  EXPECT_THAT(abaqus.warnings,
              testing::Contains("names that aren't in UTF-8 are taken to be in ISO 8859-1 (Latin-1): 2"));

  const MeshFile vtk = read_mesh(std::string(kTetAmongOthers) +
                                 "SCALARS h\xe4rte float\nLOOKUP_TABLE default\n0 0 0 0 0 0\n"
                                 "CELL_DATA 1\nSCALARS st\xfc"
                                 "ck int\nLOOKUP_TABLE default\n7\n");
  EXPECT_THAT(vtk.mesh.channel_names, testing::ElementsAre("kept", "h\xc3\xa4rte"));
  ASSERT_EQ(vtk.cell_numbers.size(), 1u);
  EXPECT_EQ(vtk.cell_numbers[0].name,
            "st\xc3\xbc"
            "ck");

  const MeshFile utf8 = read_mesh(nodes + element + "K\xc3\x96RPER\n1, 1, 2, 3, 4\n");
  EXPECT_EQ(utf8.cell_sets[0].name, "K\xc3\x96RPER");
  EXPECT_THAT(utf8.warnings, testing::IsEmpty());
}

// Whatever the format: the mark is no part of the text.
TEST(MeshFile, AUtf8MarkBeforeTheTextIsPassedOver) {
  const std::string ovm =
      "OVM ASCII\nVertices\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\nEdges\n6\n0 1\n1 2\n2 0\n0 3\n1 3\n2 3\n"
      "Faces\n4\n3 0 2 4\n3 0 8 7\n3 2 10 9\n3 4 6 11\nPolyhedra\n1\n4 1 2 4 6\n";
  const std::string medit =
      "MeshVersionFormatted 2\nDimension 3\nVertices\n4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\nTetrahedra\n1\n"
      "1 2 3 4 0\nEnd\n";
  const std::string gmsh =
      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n$Elements\n1\n"
      "1 4 2 1 1 1 2 3 4\n$EndElements\n";
  const std::string abaqus =
      "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n";
  for (const std::string& text : {ovm, medit, gmsh, abaqus, std::string(kTetAmongOthers)}) {
    EXPECT_EQ(read_mesh("\xef\xbb\xbf" + text).mesh.cell_vertices, read_mesh(text).mesh.cell_vertices) << text;
  }
}

TEST(MeshFile, PyramidsAndCollapsedCellsAreReadAsWhatTheyAre) {
  const MeshFile file = read_mesh(read_file_bytes(CCSLICE_TEST_DATA_DIR "/meshes/pyramids.vtk", kMaxBytes));
  EXPECT_EQ(file.mesh.cell_kinds, std::vector(12, CellKind::kTet));
  EXPECT_THAT(file.warnings, testing::ElementsAre("6 pyramids are read as two tetrahedra each"));
  ASSERT_EQ(file.cell_numbers.size(), 1u);
  EXPECT_THAT(file.cell_numbers[0].of_cells, testing::ElementsAre(1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6));
}

TEST(MeshFile, FormatsThatAreNotReadHaveARemedy) {
  const auto expect = [](const std::string& bytes, const std::string& part) {
    expect_error([&] { read_mesh(bytes); }, ErrorCode::kFileUnsupported, part);
    EXPECT_TRUE(describe_unread(bytes).known) << part;
  };
  expect("\x89HDF\r\n\x1a\n...", "nccopy -k cdf5 part.e part-classic.e");
  expect("\x89HDF\r\n\x1a\n...", "apt install meshio-tools");
  for (const std::string& text : {std::string("<\0?\0", 4), std::string("\0<\0?", 4), std::string("\xff\xfe<")}) {
    expect(text, "UTF-16");
  }
  expect("\x1f\x8b\x08", "unpack it");
  expect(std::string("\1\0\0\0\2\0\0\0", 8), "save it as .mesh");
  expect(std::string("\0\0\0\1\0\0\0\2", 8), "save it as .mesh");
  expect("$NOD\n8\n", "gmsh -format msh41");
  EXPECT_FALSE(describe_unread("solid cube").known);
}

/// Binary STL: 80 bytes of anything, the number of triangles, and 50 bytes for each.
std::string binary_stl(std::uint32_t triangles, float normal_z = 1) {
  std::string bytes(80, 'x');
  bytes.append(reinterpret_cast<const char*>(&triangles), sizeof triangles);
  const std::array<float, 12> triangle = {0, 0, normal_z, 0, 0, 0, 1, 0, 0, 0, 1, 0};
  for (std::uint32_t i = 0; i < triangles; ++i) {
    bytes.append(reinterpret_cast<const char*>(triangle.data()), sizeof triangle).append(2, '\0');
  }
  return bytes;
}

TEST(MeshFile, FilesOfSurfacesAndOfCadHaveARemedy) {
  const auto expect = [](const std::string& bytes, const std::string& part) {
    expect_error([&] { read_mesh(bytes); }, ErrorCode::kFileUnsupported, part);
    EXPECT_TRUE(describe_unread(bytes).known) << part;
  };
  const std::string surface = "holds a surface only; a solid needs volume cells: mesh the inside too";
  expect("solid cube\n  facet normal 0 0 1\n    outer loop\n", "this is an STL file, which " + surface);
  expect(binary_stl(1), "this is an STL file, which " + surface);
  expect(binary_stl(12, 0), "this is an STL file, which " + surface);
  expect("ply\nformat ascii 1.0\n", "this is a PLY file, which " + surface);
  expect("ply\r\nformat ascii 1.0\r\n", "this is a PLY file, which " + surface);
  expect("PK\x03\x04\x14", "this is a ZIP archive; unpack it first, unless it is a .3mf, which " + surface);
  expect("ISO-10303-21;\nHEADER;\n", "this is a STEP file, a part of CAD; `gmsh -3 part.step -o part.msh`");
  EXPECT_FALSE(describe_unread("plywood").known);
  EXPECT_FALSE(describe_unread("solid facets").known);
  EXPECT_FALSE(describe_unread(binary_stl(0)).known);
  EXPECT_FALSE(describe_unread(binary_stl(2) + "x").known);
  EXPECT_FALSE(describe_unread(binary_stl(2, 7)).known) << "that is no normal";
  EXPECT_FALSE(describe_unread(std::string(84, 'x')).known);
}

TEST(MeshFile, UnreadableFilesAreNamed) {
  expect_error([] { read_file_bytes("/nowhere/at/all.mesh", kMaxBytes); }, ErrorCode::kFileUnreadable,
               "/nowhere/at/all.mesh");
  expect_error([] { read_file_bytes(fs::temp_directory_path().string(), kMaxBytes); }, ErrorCode::kFileUnreadable,
               "is a folder");
}

struct RealMesh {
  const char* name;
  std::size_t cells, vertices;
};

class RealMeshes : public testing::TestWithParam<RealMesh> {};

TEST_P(RealMeshes, AreReadWhole) {
  if (!fs::exists(fs::path(CCSLICE_SHARED_MESHES_DIR) / GetParam().name)) GTEST_SKIP() << "no " << GetParam().name;
  const MeshFile file = read_shared(GetParam().name);
  EXPECT_EQ(file.mesh.cell_count(), GetParam().cells);
  EXPECT_EQ(file.mesh.vertex_count(), GetParam().vertices);
}

INSTANTIATE_TEST_SUITE_P(MeshFile, RealMeshes,
                         testing::Values(RealMesh{"rod.vtk", 1280, 1815}, RealMesh{"lower_arm.vtk", 1328, 1996},
                                         RealMesh{"screw2.mesh", 2699, 3467}, RealMesh{"mountwithhole.vtk", 3712, 5060},
                                         RealMesh{"fertility_cmu.vtk", 4000, 4983},
                                         RealMesh{"ellipsoid.mesh", 6816, 7293},
                                         RealMesh{"bone_octree.vtk", 8619, 10356},
                                         RealMesh{"rockerarm_cinolib.mesh", 10600, 12751},
                                         RealMesh{"mixed_small.vtk", 15, 37}, RealMesh{"cylinder.ovm", 288, 399}),
                         [](const auto& info) {
                           const std::string name = info.param.name;
                           return name.substr(0, name.find('.'));
                         });

TEST(MeshFile, PyramidsAmongRealCellsAreNamed) {
  if (!fs::exists(fs::path(CCSLICE_SHARED_MESHES_DIR) / "mixed_elements.vtk")) GTEST_SKIP() << "no mixed_elements.vtk";
  expect_error([] { read_shared("mixed_elements.vtk"); }, ErrorCode::kMeshUnsupportedCell, "pyramid 730 at cell 739");
}

TEST(MeshFile, ChannelsOfARealFileComeAlong) {
  if (!fs::exists(fs::path(CCSLICE_SHARED_MESHES_DIR) / "mixed_small.vtk")) GTEST_SKIP() << "no mixed_small.vtk";
  EXPECT_THAT(read_shared("mixed_small.vtk").mesh.channel_names, testing::ElementsAre("height", "hardness"));
}

}  // namespace
}  // namespace ccslice
