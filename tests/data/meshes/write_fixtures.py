#!/usr/bin/env python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Wrote the fixtures of other tools in this folder, once, with Debian's python3-vtk9 (9.1.0) and python3-meshio (5.0.0).

A house: a hexahedron (a voxel in VTK's files), a wedge for its roof and a tetrahedron on the gable. Point data: hardness
(scalars), mix (vectors) and, in VTK's files, count (a field of two integers) and arrays that are left out. The tests
read the files and need neither package.

gmsh_*.msh: by Debian's gmsh (4.8.4) from a file of version 2.2 written by hand, with a point that no cell uses, a face,
two physical groups, and in version 4.1 nodes whose tags have gaps; its fields, which Gmsh saves to files of their own,
were put behind the mesh.

By hand: house.inp, assembly.inp; house.ovm from OpenVolumeMesh's description of the format; house.json from protobuf's JSON mapping;
house.ccmesh by `protoc --encode=ccslice.v1.ControlMesh` from house.txtpb.
"""

import meshio
import numpy
import vtk

POINTS = [(0, 0, 0), (12, 0, 0), (12, 12, 0), (0, 12, 0), (0, 0, 12), (12, 0, 12), (12, 12, 12), (0, 12, 12),
          (0, 6, 20), (12, 6, 20), (22, 6, 14)]
HEX = [0, 1, 2, 3, 4, 5, 6, 7]
VOXEL = [0, 1, 3, 2, 4, 5, 7, 6]
WEDGE = [4, 7, 8, 5, 6, 9]
TET = [5, 6, 9, 10]
HARDNESS = [20 + 0.5 * i for i in range(len(POINTS))]
MIX = [(0.125 * i, 1 - 0.125 * i, 0.25) for i in range(len(POINTS))]
COUNT = [(i, -i) for i in range(len(POINTS))]


def vtk_array(kind, name, rows):
    array = kind()
    array.SetName(name)
    array.SetNumberOfComponents(len(rows[0]))
    for row in rows:
        array.InsertNextTuple(row)
    return array


def vtk_grid():
    grid = vtk.vtkUnstructuredGrid()
    points = vtk.vtkPoints()
    points.SetDataTypeToDouble()
    for point in POINTS:
        points.InsertNextPoint(point)
    grid.SetPoints(points)
    for kind, corners in ((vtk.VTK_VOXEL, VOXEL), (vtk.VTK_WEDGE, WEDGE), (vtk.VTK_TETRA, TET), (vtk.VTK_QUAD, HEX[:4])):
        grid.InsertNextCell(kind, len(corners), corners)
    data = grid.GetPointData()
    data.SetScalars(vtk_array(vtk.vtkFloatArray, "hardness", [(value,) for value in HARDNESS]))
    data.SetVectors(vtk_array(vtk.vtkDoubleArray, "mix", MIX))
    data.SetNormals(vtk_array(vtk.vtkFloatArray, "up", [(0, 0, 1)] * len(POINTS)))
    data.AddArray(vtk_array(vtk.vtkIntArray, "count", COUNT))
    names = vtk.vtkStringArray()
    names.SetName("names")
    for point in range(len(POINTS)):
        names.InsertNextValue("point %d, %s" % (point, "x" * (7 * point)))
    data.AddArray(names)
    bits = vtk.vtkBitArray()
    bits.SetName("bits")
    for point in range(len(POINTS)):
        bits.InsertNextValue(point % 2)
    grid.GetCellData().AddArray(bits_of_cells(grid))
    grid.GetFieldData().AddArray(vtk_array(vtk.vtkDoubleArray, "TIME", [(0.5,)]))
    data.AddArray(bits)
    return grid


def bits_of_cells(grid):
    return vtk_array(vtk.vtkIdTypeArray, "cell ids", [(cell,) for cell in range(grid.GetNumberOfCells())])


def write_vtk(name, binary, version):
    writer = vtk.vtkUnstructuredGridWriter()
    writer.SetInputData(vtk_grid())
    writer.SetFileName(name)
    writer.SetHeader("a house")
    writer.SetFileVersion(version)
    writer.SetFileTypeToBinary() if binary else writer.SetFileTypeToASCII()
    writer.Write()


def write_vtu(name, mode, appended_base64=False, compressed=False, header64=False, big_endian=False):
    writer = vtk.vtkXMLUnstructuredGridWriter()
    grid = vtk_grid()
    grid.GetPointData().RemoveArray("bits")
    writer.SetInputData(grid)
    writer.SetFileName(name)
    {"ascii": writer.SetDataModeToAscii, "binary": writer.SetDataModeToBinary,
     "appended": writer.SetDataModeToAppended}[mode]()
    writer.SetEncodeAppendedData(appended_base64)
    writer.SetCompressorTypeToZLib() if compressed else writer.SetCompressorTypeToNone()
    writer.SetHeaderTypeToUInt64() if header64 else writer.SetHeaderTypeToUInt32()
    writer.SetByteOrderToBigEndian() if big_endian else writer.SetByteOrderToLittleEndian()
    writer.SetBlockSize(64)  # Several blocks for an array.
    writer.Write()


def write_vtus():
    write_vtu("vtk_ascii.vtu", "ascii")
    write_vtu("vtk_binary.vtu", "binary")
    write_vtu("vtk_binary_zlib.vtu", "binary", compressed=True)
    write_vtu("vtk_binary_big_endian.vtu", "binary", header64=True, big_endian=True)
    write_vtu("vtk_appended_raw.vtu", "appended")
    write_vtu("vtk_appended_raw_zlib.vtu", "appended", compressed=True, header64=True)
    write_vtu("vtk_appended_base64.vtu", "appended", appended_base64=True)
    write_vtu("vtk_appended_base64_zlib.vtu", "appended", appended_base64=True, compressed=True, big_endian=True)
    meshio.write("meshio_binary_zlib.vtu", meshio_mesh(True), compression="zlib")
    meshio.write("meshio_binary.vtu", meshio_mesh(True), compression=None)
    meshio.write("meshio_ascii.vtu", meshio_mesh(True), binary=False)


def meshio_mesh(graded):
    cells = [("hexahedron", numpy.array([HEX])), ("wedge", numpy.array([WEDGE])), ("tetra", numpy.array([TET]))]
    data = {"hardness": numpy.array(HARDNESS), "mix": numpy.array(MIX)} if graded else {}
    return meshio.Mesh(numpy.array(POINTS, dtype=float), cells, point_data=data)


def main():
    old, new = vtk.vtkDataWriter.VTK_LEGACY_READER_VERSION_4_2, vtk.vtkDataWriter.VTK_LEGACY_READER_VERSION_5_1
    write_vtk("vtk_ascii_4_2.vtk", False, old)
    write_vtk("vtk_binary_4_2.vtk", True, old)
    write_vtk("vtk_ascii_5_1.vtk", False, new)
    write_vtk("vtk_binary_5_1.vtk", True, new)
    meshio.write("meshio_binary_5_1.vtk", meshio_mesh(True), binary=True)
    meshio.write("meshio_ascii_5_1.vtk", meshio_mesh(True), binary=False)
    meshio.write("meshio.mesh", meshio_mesh(False))
    write_vtus()
    meshio.read("house.inp").write("meshio_from_abaqus.vtk")


main()
