#!/usr/bin/env python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Wrote the fixtures of other tools in this folder, once, with Debian's python3-vtk9 (9.1.0) and python3-meshio (5.0.0).

A house: a hexahedron (a voxel in VTK's files), a wedge for its roof and a tetrahedron on the gable. Point data: hardness
(scalars), mix (vectors) and, in VTK's files, count (a field of two integers) and arrays that are left out. The tests
read the files and need neither package.

polyhedra_vtk*.vtu, .vtk: the house with all cells as polyhedra, with the same VTK; polyhedra_vtk_2_3.vtu has their faces
by hand in the arrays that VTK writes from 9.4 on. curved_vtk.vtu: cells of second order of every kind, their nodes where
VTK's parametric coordinates put them, moved by BEND, and Bezier cells with the control points of that.

gmsh_*.msh: by Debian's gmsh (4.8.4) from a file of version 2.2 written by hand, with a point that no cell uses, a face,
two physical groups, and in version 4.1 nodes whose tags have gaps; its fields, which Gmsh saves to files of their own,
were put behind the mesh.

gmsh_plate.msh: by the same gmsh from gmsh_plate.geo, `gmsh gmsh_plate.geo -3 -o gmsh_plate.msh`: 238 tetrahedra round a
bore, for tests/oracle.

exodus_*.e: by Debian's libexodusii (6.02), in three variants of netCDF's format (the last one through nccopy). The
tetrahedron is of second order, a shell and sets of nodes, sides and elements are there too, and two time steps.

second_order*: by write_second_order.py.

By hand: house.inp, assembly.inp; pyramids.vtk, a cube of six pyramids of which two come as hexahedra; house.ovm from
OpenVolumeMesh's description of the format; house.json from protobuf's JSON mapping;
house.ccmesh by `protoc --encode=ccslice.v1.ControlMesh` from house.txtpb.
"""

import ctypes
import itertools
import os
import subprocess

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


def write_vtu(name, mode, appended_base64=False, compressed=None, header64=False, big_endian=False):
    writer = vtk.vtkXMLUnstructuredGridWriter()
    grid = vtk_grid()
    grid.GetPointData().RemoveArray("bits")
    writer.SetInputData(grid)
    writer.SetFileName(name)
    {"ascii": writer.SetDataModeToAscii, "binary": writer.SetDataModeToBinary,
     "appended": writer.SetDataModeToAppended}[mode]()
    writer.SetEncodeAppendedData(appended_base64)
    {None: writer.SetCompressorTypeToNone, "zlib": writer.SetCompressorTypeToZLib, "lz4": writer.SetCompressorTypeToLZ4,
     "lzma": writer.SetCompressorTypeToLZMA}[compressed]()
    writer.SetHeaderTypeToUInt64() if header64 else writer.SetHeaderTypeToUInt32()
    writer.SetByteOrderToBigEndian() if big_endian else writer.SetByteOrderToLittleEndian()
    writer.SetBlockSize(64)  # Several blocks for an array.
    writer.Write()


def write_vtus():
    write_vtu("vtk_ascii.vtu", "ascii")
    write_vtu("vtk_binary.vtu", "binary")
    write_vtu("vtk_binary_zlib.vtu", "binary", compressed="zlib")
    write_vtu("vtk_binary_big_endian.vtu", "binary", header64=True, big_endian=True)
    write_vtu("vtk_appended_raw.vtu", "appended")
    write_vtu("vtk_appended_raw_zlib.vtu", "appended", compressed="zlib", header64=True)
    write_vtu("vtk_appended_base64.vtu", "appended", appended_base64=True)
    write_vtu("vtk_appended_base64_zlib.vtu", "appended", appended_base64=True, compressed="zlib", big_endian=True)
    write_vtu("vtk_binary_lz4.vtu", "binary", compressed="lz4")
    write_vtu("vtk_appended_raw_lzma.vtu", "appended", compressed="lzma", header64=True)
    meshio.write("meshio_binary_zlib.vtu", meshio_mesh(True), compression="zlib")
    meshio.write("meshio_binary.vtu", meshio_mesh(True), compression=None)
    meshio.write("meshio_ascii.vtu", meshio_mesh(True), binary=False)


HOUSE_FACES = [
    [(0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7)],
    [(4, 8, 7), (5, 6, 9), (4, 7, 6, 5), (7, 8, 9, 6), (8, 4, 5, 9)],
    [(5, 9, 6), (5, 6, 10), (6, 9, 10), (9, 5, 10)],
]


def polyhedra():
    grid = vtk.vtkUnstructuredGrid()
    grid.SetPoints(vtk_grid().GetPoints())
    for faces in HOUSE_FACES:
        stream = vtk.vtkIdList()
        for number in [len(faces)] + [number for face in faces for number in (len(face), *face)]:
            stream.InsertNextId(number)
        grid.InsertNextCell(vtk.VTK_POLYHEDRON, stream)
    return grid


def write_polyhedra():
    vtu = vtk.vtkXMLUnstructuredGridWriter()
    vtu.SetFileName("polyhedra_vtk.vtu")
    vtu.SetDataModeToAscii()
    vtk_writer = vtk.vtkUnstructuredGridWriter()
    vtk_writer.SetFileName("polyhedra_vtk_5_1.vtk")
    for writer in (vtu, vtk_writer):
        writer.SetInputData(polyhedra())
        writer.Write()
    write_new_polyhedra()


def write_new_polyhedra():
    def array(name, values):
        return '<DataArray type="Int64" Name="%s" format="ascii">%s</DataArray>\n' % (name, " ".join(map(str, values)))

    def ends(lists):
        return itertools.accumulate(len(entries) for entries in lists)

    faces = [face for cell in HOUSE_FACES for face in cell]
    points = [sorted({point for face in cell for point in face}) for cell in HOUSE_FACES]
    arrays = {"connectivity": sum(points, []), "offsets": ends(points), "types": [42] * len(points),
              "face_connectivity": [point for face in faces for point in face], "face_offsets": ends(faces),
              "polyhedron_to_faces": range(len(faces)), "polyhedron_offsets": ends(HOUSE_FACES)}
    with open("polyhedra_vtk_2_3.vtu", "w", encoding="ascii") as file:
        file.write('<VTKFile type="UnstructuredGrid" version="2.3" byte_order="LittleEndian">\n<UnstructuredGrid>\n'
                   '<Piece NumberOfPoints="%d" NumberOfCells="%d">\n<Points>\n' % (len(POINTS), len(points)))
        file.write(array("Points", sum(POINTS, ())).replace("Name", 'NumberOfComponents="3" Name'))
        file.write("</Points>\n<Cells>\n" + "".join(array(*entry) for entry in arrays.items()))
        file.write("</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n")


BEND = (2, 3, 5)  # (x, y, z) + (2 y (1 - y), 3 z (1 - z), 5 x (1 - x)): nothing at corners.


def bent(place, control):
    """A node, or the control point of a Bezier cell, at these coordinates from 0 to 1."""
    middle = 0.5 if control else 0.25
    bends = [bend * {0: 0, 0.5: middle, 1: 0}[place[(axis + 1) % 3]] for axis, bend in enumerate(BEND)]
    return [12 * place[axis] + bends[axis] for axis in range(3)]


def write_curved():
    grid, points = vtk.vtkUnstructuredGrid(), vtk.vtkPoints()
    points.SetDataTypeToDouble()
    heights = []
    kinds = [("QuadraticTetra", 0), ("QuadraticHexahedron", 0), ("QuadraticWedge", 0), ("TriQuadraticHexahedron", 0),
             ("BiQuadraticQuadraticWedge", 0), ("BiQuadraticQuadraticHexahedron", 0), ("LagrangeTetra", 10),
             ("LagrangeHexahedron", 27), ("LagrangeWedge", 18), ("BezierTetra", 10), ("BezierHexahedron", 27),
             ("BezierWedge", 18)]
    for number, (kind, size) in enumerate(kinds):
        cell = getattr(vtk, "vtk" + kind)()
        if size:
            cell.GetPointIds().SetNumberOfIds(size)
            cell.GetPoints().SetNumberOfPoints(size)
            cell.Initialize()
            if hasattr(cell, "SetUniformOrderFromNumPoints"):
                cell.SetUniformOrderFromNumPoints(size)
            elif hasattr(cell, "GetOrder"):
                cell.GetOrder()
        size = size or cell.GetNumberOfPoints()
        ids = []
        for place in vtk_places(cell, size):
            x, y, z = bent(place, kind.startswith("Bezier"))
            ids.append(points.InsertNextPoint(x + 100 * number, y, z))
            heights.append((z,))
        grid.InsertNextCell(cell.GetCellType(), size, ids)
    grid.SetPoints(points)
    grid.GetPointData().AddArray(vtk_array(vtk.vtkDoubleArray, "height", heights))
    writer = vtk.vtkXMLUnstructuredGridWriter()
    writer.SetInputData(grid)
    writer.SetFileName("curved_vtk.vtu")
    writer.SetDataModeToAscii()
    writer.Write()


def vtk_places(cell, size):
    """The parametric coordinates of the cell's points, in VTK's order."""
    if hasattr(cell, "PointIndexFromIJK"):
        wedge = cell.GetNumberOfFaces() == 5
        steps = [(i, j, k) for i in range(3) for j in range(3) for k in range(3) if not wedge or i + j < 3]
        found = {cell.PointIndexFromIJK(*step): tuple(entry / 2 for entry in step) for step in steps}
        return [found[i] for i in range(size)]
    if hasattr(cell, "ToBarycentricIndex"):
        places = []
        for i in range(size):
            index = [0, 0, 0, 0]
            cell.ToBarycentricIndex(i, index)
            places.append(tuple(entry / 2 for entry in index[:3]))
        return places
    values = cell.GetParametricCoords()
    return [tuple(values[3 * i:3 * i + 3]) for i in range(size)]


def meshio_mesh(graded):
    cells = [("hexahedron", numpy.array([HEX])), ("wedge", numpy.array([WEDGE])), ("tetra", numpy.array([TET]))]
    data = {"hardness": numpy.array(HARDNESS), "mix": numpy.array(MIX)} if graded else {}
    return meshio.Mesh(numpy.array(POINTS, dtype=float), cells, point_data=data)


class ExodusFile:
    """One call of libexodusii after the other, each checked."""

    def __init__(self, path, mode, word_bytes):
        self.library = ctypes.CDLL("libexoIIv2c.so.5")
        compute_bytes, file_bytes = ctypes.c_int(8), ctypes.c_int(word_bytes)
        self.file = self.library.ex_create_int(path.encode(), mode, ctypes.byref(compute_bytes),
                                               ctypes.byref(file_bytes), 602)
        assert self.file > 0

    def __getattr__(self, name):
        def call(*arguments):
            assert getattr(self.library, "ex_" + name)(self.file, *arguments) >= 0, name
        return call


def doubles(values):
    return (ctypes.c_double * len(values))(*values)


def ints(values):
    return (ctypes.c_int * len(values))(*values)


def names(values):
    return (ctypes.c_char_p * len(values))(*[value.encode() for value in values])


class ExodusSizes(ctypes.Structure):
    _fields_ = [("title", ctypes.c_char * 81)] + [(name, ctypes.c_int64) for name in (
        "dim", "nodes", "edges", "edge_blocks", "faces", "face_blocks", "elements", "element_blocks", "node_sets",
        "edge_sets", "face_sets", "side_sets", "element_sets", "node_maps", "edge_maps", "face_maps", "element_maps")]


EX_ELEM_BLOCK, EX_NODE_SET, EX_SIDE_SET, EX_ELEM_SET, EX_NODAL = 1, 2, 3, 10, 14
EX_CLOBBER, EX_LARGE_MODEL, EX_NETCDF4 = 8, 32, 64


def exodus_blocks(points):
    """Appends the middles of the tetrahedron's edges to the points."""
    edges = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]
    middles = []
    for a, b in edges:
        middles.append(len(points))
        points.append([(points[TET[a]][axis] + points[TET[b]][axis]) / 2 for axis in range(3)])
    return [(7, b"SHELL4", "deck", HEX[4:]), (10, b"HEX8", "walls", HEX), (20, b"WEDGE", "roof", WEDGE),
            (30, b"TETRA10", "", TET + middles)]


def write_exodus(path, mode, word_bytes):
    points = [list(point) for point in POINTS]
    blocks = exodus_blocks(points)
    file = ExodusFile(path, EX_CLOBBER | mode, word_bytes)
    sizes = ExodusSizes(b"a house", dim=3, nodes=len(points), elements=4, element_blocks=4, node_sets=1, side_sets=1,
                        element_sets=1)
    file.put_init_ext(ctypes.byref(sizes))
    file.put_coord(*[doubles([point[axis] for point in points]) for axis in range(3)])
    for number, kind, _, nodes in blocks:
        file.put_block(EX_ELEM_BLOCK, ctypes.c_int64(number), kind, *map(ctypes.c_int64, (1, len(nodes), 0, 0, 0)))
        file.put_conn(EX_ELEM_BLOCK, ctypes.c_int64(number), ints([node + 1 for node in nodes]), None, None)
    file.put_names(EX_ELEM_BLOCK, names([name for _, _, name, _ in blocks]))
    for kind, entries in ((EX_NODE_SET, [1, 2]), (EX_SIDE_SET, [2]), (EX_ELEM_SET, [4, 1, 3])):
        file.put_set_param(kind, ctypes.c_int64(5), ctypes.c_int64(len(entries)), ctypes.c_int64(0))
        file.put_set(kind, ctypes.c_int64(5), ints(entries), ints([1] * len(entries)))
    file.put_names(EX_ELEM_SET, names(["upper"]))
    write_exodus_variables(file, points, blocks)
    file.close()


def write_exodus_variables(file, points, blocks):
    more = len(points) - len(POINTS)
    columns = {"hardness": HARDNESS + [0] * more}
    for axis in range(3):
        columns["mix.%d" % axis] = [row[axis] for row in MIX] + [0] * more
    file.put_variable_param(EX_NODAL, len(columns))
    file.put_variable_names(EX_NODAL, len(columns), names(list(columns)))
    file.put_variable_param(EX_ELEM_BLOCK, 2)
    file.put_variable_names(EX_ELEM_BLOCK, 2, names(["density", "partial"]))
    file.put_truth_table(EX_ELEM_BLOCK, len(blocks), 2, ints([1, 0, 1, 1, 1, 0, 1, 1]))
    for step in (1, 2):
        file.put_time(step, doubles([step]))
        for i, values in enumerate(columns.values()):
            file.put_var(step, EX_NODAL, i + 1, ctypes.c_int64(1), ctypes.c_int64(len(points)),
                         doubles([value if step == 2 else -1 for value in values]))
        for number, _, name, _ in blocks:
            for variable in (1, 2):
                if variable == 2 and name not in ("", "walls"):
                    continue
                file.put_var(step, EX_ELEM_BLOCK, variable, ctypes.c_int64(number), ctypes.c_int64(1),
                             doubles([number / 4 if step == 2 else -1]))


def write_exodus_files():
    write_exodus("exodus_classic.e", 0, 8)
    write_exodus("exodus_64_bit_offset.e", EX_LARGE_MODEL, 4)
    write_exodus("hdf5.e", EX_NETCDF4, 8)
    subprocess.run(["nccopy", "-k", "cdf5", "hdf5.e", "exodus_64_bit_data.e"], check=True)
    os.remove("hdf5.e")


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
    write_polyhedra()
    write_curved()
    meshio.read("house.inp").write("meshio_from_abaqus.vtk")
    write_exodus_files()


main()
