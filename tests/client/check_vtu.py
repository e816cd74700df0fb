#!/usr/bin/python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Whether VTK has the limit volume of `ccslice convert --bezier`: its volume, and the material at points of its cells,
as `ccslice probe` finds it there by inversion.

    check_vtu.py CCSLICED CCSLICE

Needs VTK (deploy/install.sh peers); skips without it.
"""

import json
import os
import random
import subprocess
import sys
import tempfile

try:
    import numpy
    import vtk
except ImportError:
    print("VTK isn't installed (deploy/install.sh peers): skipped")
    sys.exit(77)

BEZIER_HEXAHEDRON = 79
GAUSS = numpy.polynomial.legendre.leggauss(5)  # Exact up to degree 9: det J of a tricubic has 8 along each axis.


def read(path):
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    return reader.GetOutput()


def evaluate(cell, place):
    """The position, and the weight of each point."""
    position, weights = [0.0] * 3, [0.0] * cell.GetNumberOfPoints()
    cell.EvaluateLocation(vtk.reference(0), place, position, weights)
    return numpy.array(position), numpy.array(weights)


def determinant(cell, place):
    step, columns = 1e-3, []
    for axis in range(3):
        at = []
        for k in (-2, -1, 1, 2):
            at.append(evaluate(cell, [x + (k * step if a == axis else 0) for a, x in enumerate(place)])[0])
        columns.append((8 * (at[2] - at[1]) - (at[3] - at[0])) / (12 * step))
    return numpy.linalg.det(columns)


def volume(grid):
    nodes, weights = (GAUSS[0] + 1) / 2, GAUSS[1] / 2
    total = 0
    for number in range(grid.GetNumberOfCells()):
        cell = grid.GetCell(number)
        for i, u in enumerate(nodes):
            for j, v in enumerate(nodes):
                for k, w in enumerate(nodes):
                    total += weights[i] * weights[j] * weights[k] * determinant(cell, (u, v, w))
    return total


def check_materials(ccslice, mesh, grid, channel, seed=1, count=300):
    values = grid.GetPointData().GetArray(channel)
    random.seed(seed)
    places, expected = [], []
    exact = [i for i in range(grid.GetNumberOfCells()) if grid.GetCellType(i) == BEZIER_HEXAHEDRON]
    for _ in range(count):
        cell = grid.GetCell(random.choice(exact))
        position, weights = evaluate(cell, [random.uniform(0.02, 0.98) for _ in range(3)])
        places.append(position)
        expected.append(sum(weight * values.GetValue(cell.GetPointId(i)) for i, weight in enumerate(weights)))
    points = "".join("%.17g %.17g %.17g\n" % tuple(place) for place in places)
    with open("points.txt", "w", encoding="ascii") as file:
        file.write(points)
    run = subprocess.run([ccslice, "probe", mesh, "--points", "points.txt", "--json"], check=True, capture_output=True)
    answers = json.loads(run.stdout)
    assert len(answers) == count
    for place, value, answer in zip(places, expected, answers):
        assert answer["location"] == "inside", (place, answer)
        assert abs(answer["channel_values"][channel] - value) < 2e-6, (place, value, answer)


def check(ccslice, model, levels, tolerance):
    subprocess.run([ccslice, "models", model, "-o", "model.ccmesh", "--force"], check=True, stdout=subprocess.DEVNULL)
    mesh = "part.ccmesh"
    subprocess.run([ccslice, "convert", "model.ccmesh", "--grade", "test=radial:z:0..1", "-o", mesh, "--force"],
                   check=True, stdout=subprocess.DEVNULL)
    subprocess.run([ccslice, "convert", mesh, "--bezier", str(levels), "-o", "limit.vtu", "--force", "--quiet"],
                   check=True, stdout=subprocess.DEVNULL)
    info = json.loads(subprocess.run([ccslice, "info", mesh, "--full", "--json"], check=True, capture_output=True).stdout)
    grid = read("limit.vtu")
    found, known = volume(grid), info["deviation"]["limit_volume_mm3"]
    print("%s, %d cells: %.9g mm^3, expected %.9g" % (model, grid.GetNumberOfCells(), found, known))
    assert abs(found / known - 1) < tolerance
    check_materials(ccslice, mesh, grid, "test")


def main(ccsliced, ccslice):
    os.environ["PATH"] = os.path.dirname(ccsliced) + os.pathsep + os.environ["PATH"]
    ccslice = os.path.abspath(ccslice)
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        check(ccslice, "ring", 0, 1e-8)
        check(ccslice, "box", 1, 1e-2)


main(*sys.argv[1:])
