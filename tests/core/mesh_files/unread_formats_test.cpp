// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/unread_formats.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "core/mesh_files/read_mesh.h"
#include "core/mesh_import/mesh_file.h"
#include "tests/core/mesh/expect_error.h"

namespace ccslice {
namespace {

void expect_named(const std::string& bytes, const std::string& what, const std::string& remedy) {
  for (const std::string& text : {bytes, "\xef\xbb\xbf" + bytes}) {
    expect_error([&] { read_mesh(text); }, ErrorCode::kFileUnsupported, what);
    expect_error([&] { read_mesh(text); }, ErrorCode::kFileUnsupported, remedy);
    EXPECT_TRUE(describe_unread(text).known) << what;
  }
}

TEST(UnreadFormats, OfSolversAreNamed) {
  expect_named("*KEYWORD\n*NODE\n$#   nid\n       1             0.0\n", "this is an LS-DYNA keyword file",
               "lsdyna_mesh_reader.Deck('part.k')");
  expect_named("$ made by hand\n*NODE\n       1             0.0\n*ELEMENT_SOLID\n", "LS-DYNA", "to_grid()");
  expect_named("*node\n       1             0.0\n*element_solid\n", "LS-DYNA", "to_grid()");
  expect_named("/COM,ANSYS RELEASE 2023 R1\n/PREP7\n", "this is an ANSYS input file (.cdb)", "mapdl_archive");
  expect_named("!! a mesh\nET,1,185\nNBLOCK,6,SOLID,8,8\n", "ANSYS", "grid.save('part.vtu')");
  expect_named("SOL 101\nCEND\nBEGIN BULK\nGRID,1,,0.,0.,0.\n", "this is a Nastran file", "part.bdf part.vtk");
  expect_named("$ a comment\nGRID           1       0      0.      0.      0.\nGRID*  2\n", "Nastran",
               "meshio convert");
  expect_named("#RADIOSS STARTER\n", "this is a Radioss input file", "Abaqus input");
  expect_named("    -1\n  2411\n         1         1         1        11\n", "I-DEAS Universal file (.unv)",
               "`gmsh part.unv -save -o part.msh`");
}

TEST(UnreadFormats, OfMeshersAndViewersAreNamed) {
  expect_named("MFEM mesh v1.0\n\ndimension\n3\n", "this is MFEM's own mesh format", "`mesh-explorer -m part.mesh`");
  expect_named("MFEM NURBS mesh v1.0\n", "MFEM", "then V");
  expect_named("# UCD\n8 1 0 0 0\n1 0 0 0\n2 1 0 0\n", "this is an AVS UCD file", "--input-format avsucd");
  expect_named("8 3 0 1\n1 0 0 0 1\n", "this is a file of TetGen's", "tetgen -k");
  expect_named("# elements\n2 4 0\n1 1 2 3 4\n", "TetGen", "part.ele");
  expect_named("mesh3d\ndimension\n3\n", "this is a Netgen mesh (.vol)", "part.vol part.vtk");
  expect_named("TITLE = \"part\"\nVARIABLES = \"X\", \"Y\"\nZONE N=8, E=1\n", "this is a Tecplot file", "tecplot");
  expect_named("/*---*\\\nFoamFile\n{\n    class polyBoundaryMesh;\n}\n", "OpenFOAM", "`foamToVTK`");
  expect_named("(0 \"Fluent mesh\")\n(2 3)\n", "this is a Fluent mesh", "ParaView");
  expect_named("NDIME= 3\n", "this is an SU2 mesh", "part.su2");
  expect_named("* FLAC3D grid\n", "this is a FLAC3D grid", "part.f3grid");
  expect_named("MFEM NC mesh v1.0\n", "MFEM", "then V");
  expect_named("libMesh-1.8.0\n8 # number of elements\n", "this is a file of libMesh's (.xda)",
               "`meshtool -i part.xda");
  expect_named("# Created by COMSOL Multiphysics.\n", "this is a COMSOL mesh", "as a NASTRAN file");
  expect_named(
      "\xc0\xa8\xa3\xa9"
      "ADF Database Version A02011>",
      "this is a CGNS file", "ParaView");
  expect_named(std::string("\7\r\0\0\0\f", 6), "this is an AVS UCD file", "ParaView");
  expect_named("v 0 0 0\nv 1 0 0\nf 1 2 3\n", "this is an OBJ file", "mesh the inside too");
  expect_named("OFF\n3 1 0\n", "this is an OFF file", "mesh the inside too");
  expect_named("DBRep_DrawableShape\n", "this is a BREP file", "gmsh -3 part.brep");
}

TEST(UnreadFormats, InContainersAreNamed) {
  const std::string hdf5 = "\x89HDF\r\n\x1a\n ... ";
  expect_named(hdf5 + "CGNSLibraryVersion", "this is a CGNS file", "part.cgns part.vtk");
  expect_named(hdf5 + "INFOS_GENERALES", "this is a MED file", "part.med part.vtk");
  expect_named(hdf5 + "VTKHDF", "this is a VTKHDF file", ".vtu in ParaView");
  expect_named("BZh9", "bzip2", "unpack it");
  expect_named(
      "\xfd"
      "7zXZ",
      "xz", "unpack it");
  expect_named("\x28\xb5\x2f\xfd", "zstd", "unpack it");
  expect_named("7z\xbc\xaf\x27", "7z", "unpack it");
}

TEST(UnreadFormats, ThatStandForFilesAreNamed) {
  expect_named("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n", "this is a Git LFS pointer",
               "`git lfs pull`");
  expect_named("/annex/objects/SHA256E-s1--0.vtu\n", "this is a git-annex pointer", "`git annex get`");
}

TEST(UnreadFormats, InXmlAreNamedByTheirOutermostElement) {
  const auto refused = [](const std::string& text, const std::string& part) {
    expect_error([&] { read_mesh(text); }, ErrorCode::kFileUnsupported, part);
  };
  refused("<?xml version=\"1.0\" ?>\n<!DOCTYPE Xdmf SYSTEM \"Xdmf.dtd\" []>\n<Xdmf Version=\"2.0\"/>",
          "this is an XDMF file, which is not read; 'meshio convert part.xdmf part.vtk'");
  refused("<dolfin xmlns:dolfin=\"http://fenicsproject.org\"/>", "DOLFIN");
  refused("<svg/>", "this is XML, but no file of VTK's");
  refused("<VTKFile type=\"Collection\"><Collection/></VTKFile>", "it names other files: give the .vtu that is meant");
  refused("<VTKFile type=\"PImageData\"/>", "merge its pieces into one .vtu");
}

// Abaqus has no comments with '$', but anything in a heading, and no keywords with '_'.
TEST(UnreadFormats, AreNotTakenForOthers) {
  EXPECT_EQ(mesh_file_kind("*NODE\n1, 0, 0, 0\n*ELEMENT, TYPE=C3D4\n"), MeshFileKind::kAbaqus);
  EXPECT_EQ(mesh_file_kind("** $\n*Solid Section, elset=*SET_\n"), MeshFileKind::kAbaqus);
  EXPECT_EQ(mesh_file_kind("*Heading\n$Id: bracket, revision 7 $\n*NODE\n"), MeshFileKind::kAbaqus);
  EXPECT_EQ(mesh_file_kind("*KEYWORDS\n"), MeshFileKind::kAbaqus);
  for (const char* text : {"", "vertex 1", "1 2 3\n4 5 6\n", "8 0 0 0 0\n1 2\n", "GRIDS\n", "solid"}) {
    EXPECT_FALSE(describe_unread(text).known) << text;
  }
  EXPECT_FALSE(describe_unread(std::string("v 1 2 3\n\0", 9)).known) << "that is no text";
}

}  // namespace
}  // namespace ccslice
