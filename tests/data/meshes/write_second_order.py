#!/usr/bin/env python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Wrote second_order*: the house of the other fixtures, made of one hexahedron, one wedge and one tetrahedron of second
order, in the formats of Abaqus, Gmsh, MEDIT and Exodus. Needs nothing but Python.

Every node lies where a map that is no linear one takes its place in the house of straight edges, so that no two nodes
can be confused. Nodes and elements have numbers of their own. The order of the nodes in each format is written down here
as its documentation draws it, once more than in the readers.
"""

import struct

CORNERS = [(0, 0, 0), (4, 0, 0), (4, 4, 0), (0, 4, 0), (0, 0, 4), (4, 0, 4), (4, 4, 4), (0, 4, 4), (0, 2, 7), (4, 2, 7),
           (8, 2, 5)]
HEX = [0, 1, 2, 3, 4, 5, 6, 7]
WEDGE = [4, 7, 8, 5, 6, 9]
TET = [5, 6, 9, 10]

# Nodes by the corners, from 1 as in the drawings, that they lie between.
ABAQUS = {
    "C3D27": [(1, 2), (2, 3), (3, 4), (4, 1), (5, 6), (6, 7), (7, 8), (8, 5), (1, 5), (2, 6), (3, 7), (4, 8),
              (1, 2, 3, 4, 5, 6, 7, 8), (1, 2, 3, 4), (5, 8, 7, 6), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 8, 4),
              (4, 8, 5, 1)],
    "C3D15V": [(1, 2), (2, 3), (3, 1), (4, 5), (5, 6), (6, 4), (1, 4), (2, 5), (3, 6), (1, 2, 5, 4), (2, 3, 6, 5),
               (3, 1, 4, 6)],
    "C3D10": [(1, 2), (2, 3), (1, 3), (1, 4), (2, 4), (3, 4)],
}
GMSH = {
    12: [(1, 2), (1, 4), (1, 5), (2, 3), (2, 6), (3, 4), (3, 7), (4, 8), (5, 6), (5, 8), (6, 7), (7, 8), (1, 4, 3, 2),
         (1, 2, 6, 5), (1, 5, 8, 4), (2, 3, 7, 6), (3, 4, 8, 7), (5, 6, 7, 8), (1, 2, 3, 4, 5, 6, 7, 8)],
    13: [(1, 2), (1, 3), (1, 4), (2, 3), (2, 5), (3, 6), (4, 5), (4, 6), (5, 6), (1, 2, 5, 4), (1, 4, 6, 3),
         (2, 3, 6, 5)],
    11: [(1, 2), (2, 3), (3, 1), (1, 4), (3, 4), (2, 4)],
}
MEDIT = {
    "HexahedraQ2": [(1, 2), (2, 3), (3, 4), (4, 1), (5, 6), (6, 7), (7, 8), (8, 5), (1, 5), (2, 6), (3, 7), (4, 8),
                    (1, 2, 3, 4), (5, 6, 7, 8), (1, 2, 6, 5), (2, 3, 7, 6), (3, 4, 8, 7), (4, 1, 5, 8),
                    (1, 2, 3, 4, 5, 6, 7, 8)],
    "PrismsP2": [(1, 2), (2, 3), (3, 1), (1, 4), (2, 5), (3, 6), (4, 5), (5, 6), (6, 4), (3, 1, 4, 6), (1, 2, 5, 4),
                 (2, 3, 6, 5)],
    "TetrahedraP2": [(1, 2), (2, 3), (3, 1), (1, 4), (2, 4), (3, 4)],
}
EXODUS = {
    "HEX27": [(1, 2), (2, 3), (3, 4), (4, 1), (1, 5), (2, 6), (3, 7), (4, 8), (5, 6), (6, 7), (7, 8), (8, 5),
              (1, 2, 3, 4, 5, 6, 7, 8), (1, 2, 3, 4), (5, 6, 7, 8), (1, 4, 8, 5), (2, 3, 7, 6), (1, 2, 6, 5),
              (3, 4, 8, 7)],
    "WEDGE18": [(1, 2), (2, 3), (3, 1), (1, 4), (2, 5), (3, 6), (4, 5), (5, 6), (6, 4), (1, 2, 5, 4), (2, 3, 6, 5),
                (3, 1, 4, 6)],
    "TETRA10": [(1, 2), (2, 3), (1, 3), (1, 4), (2, 4), (3, 4)],
}


def bent(x, y, z):
    return x + y * y / 32, y + z * z / 32, z + x * x / 32


class House:
    """Nodes by their indices from 0, the corners first, and elements (type, nodes) of the formats' types."""

    def __init__(self, types):
        self.points = [bent(*corner) for corner in CORNERS]
        self.middles = {}
        self.elements = []
        for (kind, places), corners in zip(types.items(), (HEX, WEDGE, TET)):
            between = [tuple(sorted(corners[corner - 1] for corner in place)) for place in places]
            self.elements.append((kind, corners + [self.middle(place) for place in between]))

    def middle(self, corners):
        if corners not in self.middles:
            self.middles[corners] = len(self.points)
            self.points.append(bent(*(sum(CORNERS[c][axis] for c in corners) / len(corners) for axis in range(3))))
        return self.middles[corners]


def number(node):
    return 10 + 3 * node


def write_abaqus():
    house = House(ABAQUS)
    with open("second_order.inp", "w") as file:
        file.write("*HEADING\nbent house\n*NODE\n")
        for node, point in enumerate(house.points):
            file.write("%d, %r, %r, %r\n" % (number(node), *point))
        for i, (kind, nodes) in enumerate(house.elements):
            entries = [str(501 + i)] + [str(number(node)) for node in nodes]
            lines = [", ".join(entries[at:at + 16]) for at in range(0, len(entries), 16)]
            file.write("*ELEMENT, TYPE=%s, ELSET=%s\n%s,\n" % (kind, kind, ",\n".join(lines)))


def write_gmsh(name, binary):
    """Nodes lie on a vertex, a curve, a surface and a volume in turn."""
    house = House(GMSH)
    text = lambda *values: (" ".join(repr(value) for value in values) + "\n").encode()
    ints = lambda *values: struct.pack("<%di" % len(values), *values)
    file = bytearray(b"$Comments\nwritten by hand\n$EndComments\n$MeshFormat\n2.2 %d 8\n" % binary)
    if binary:
        file += ints(1) + b"\n"
    file += b"$EndMeshFormat\n$ParametricNodes\n%d\n" % len(house.points)
    for node, point in enumerate(house.points):
        dimension = node % 4
        parameters = [0.25] * (dimension if dimension < 3 else 0)
        if binary:
            file += ints(number(node)) + struct.pack("<3d", *point) + ints(dimension, 7)
            file += struct.pack("<%dd" % len(parameters), *parameters)
        else:
            file += text(number(node), *point, dimension, 7, *parameters)
    file += b"\n" * binary + b"$EndParametricNodes\n$Elements\n%d\n" % len(house.elements)
    for i, (kind, nodes) in enumerate(house.elements):
        values = [number(node) for node in nodes]
        file += ints(kind, 1, 2, 501 + i, 1, 1, *values) if binary else text(501 + i, kind, 2, 1, 1, *values)
    file += b"\n" * binary + b"$EndElements\n"
    if not binary:
        file += b"$NodeData\n1\n\"height\"\n1\n0.0\n3\n0\n1\n%d\n" % len(house.points)
        for node, point in enumerate(house.points):
            file += text(number(node), point[2])
        file += b"$EndNodeData\n"
    with open(name, "wb") as out:
        out.write(file)


def write_medit():
    house = House(MEDIT)
    with open("second_order.mesh", "w") as file:
        file.write("MeshVersionFormatted 2\nDimension 3\nVertices\n%d\n" % len(house.points))
        for point in house.points:
            file.write("%r %r %r 0\n" % point)
        file.write("EdgesP2\n1\n1 2 12 0\n")
        for kind, nodes in house.elements:
            file.write("%s\n1\n%s 1\n" % (kind, " ".join(str(node + 1) for node in nodes)))
        file.write("End\n")


def padded(text):
    return struct.pack(">i", len(text)) + text.encode() + b"\0" * (-len(text) % 4)


def write_exodus():
    """netCDF's classic format: dimensions, no attributes, variables with their element types, numbers."""
    house = House(EXODUS)
    nodes = len(house.points)
    sizes = [("num_dim", 3), ("num_nodes", nodes), ("num_elem", 3), ("num_el_blk", 3)]
    variables = [("eb_prop1", [3], 4, [1, 2, 3], ""),
                 ("node_num_map", [1], 4, [number(node) for node in range(nodes)], ""),
                 ("elem_num_map", [2], 4, [501, 502, 503], "")]
    for axis in range(3):
        variables.append(("coord" + "xyz"[axis], [1], 6, [point[axis] for point in house.points], ""))
    for i, (kind, of_element) in enumerate(house.elements):
        dimension = len(sizes)
        sizes += [("num_el_in_blk%d" % (i + 1), 1), ("num_nod_per_el%d" % (i + 1), len(of_element))]
        variables.append(("connect%d" % (i + 1), [dimension, dimension + 1], 4, [n + 1 for n in of_element], kind))
    header = lambda begins: b"CDF\1" + struct.pack(">i", 0) + dimensions + struct.pack(">4i", 0, 0, 11, len(
        variables)) + b"".join(head + struct.pack(">i", begin) for head, begin in zip(heads, begins))
    dimensions = struct.pack(">2i", 10, len(sizes)) + b"".join(padded(n) + struct.pack(">i", s) for n, s in sizes)
    heads, data = [], []
    for name, of_dimensions, kind, values, element_type in variables:
        attributes = struct.pack(">2i", 12, 1) + padded("elem_type") + struct.pack(">i", 2) + padded(element_type)
        data.append(struct.pack(">%d%s" % (len(values), "i" if kind == 4 else "d"), *values))
        heads.append(padded(name) + struct.pack(">i%di" % len(of_dimensions), len(of_dimensions), *of_dimensions) +
                     (attributes if element_type else struct.pack(">2i", 0, 0)) + struct.pack(">2i", kind, len(data[-1])))
    begins = [len(header([0] * len(data)))]
    for block in data:
        begins.append(begins[-1] + len(block))
    with open("second_order.e", "wb") as file:
        file.write(header(begins) + b"".join(data))


write_abaqus()
write_gmsh("second_order.msh", False)
write_gmsh("second_order_binary.msh", True)
write_medit()
write_exodus()
