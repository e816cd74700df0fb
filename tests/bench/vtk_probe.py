#!/usr/bin/python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Probes the linear hexahedra of a file at the voxels of some layers with VTK's vtkProbeFilter, and prints the time that
took as JSON.

    vtk_probe.py FILE.vtk THREADS GRID FIRST COUNT     GRID: the "grid" of `ccslice plan --json`
"""

import json
import os
import sys
import time


def voxels(vtk, grid, first, count):
    """The voxel centres of the layers as an image without values."""
    image = vtk.vtkImageData()
    image.SetDimensions(grid["columns"], grid["rows"], count)
    image.SetSpacing(*grid["pitch_mm"])
    layer = (0, 0, first)
    image.SetOrigin(*(o + (i + 0.5) * d for o, i, d in zip(grid["origin_mm"], layer, grid["pitch_mm"])))
    return image


def main(path, threads, grid, first, count):
    os.environ["VTK_SMP_BACKEND_IN_USE"] = "STDThread" if int(threads) > 1 else "Sequential"
    os.environ["VTK_SMP_MAX_THREADS"] = threads
    import vtk  # Reads the environment.

    reader = vtk.vtkUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    probe = vtk.vtkProbeFilter()
    probe.SetSourceData(reader.GetOutput())
    probe.SetInputData(voxels(vtk, json.loads(grid), int(first), int(count)))
    begin = time.monotonic()
    probe.Update()
    seconds = time.monotonic() - begin
    mask = probe.GetOutput().GetPointData().GetArray(probe.GetValidPointMaskArrayName())
    inside = sum(memoryview(mask).cast("B"))
    print(json.dumps({"seconds": seconds, "voxels": inside, "version": vtk.vtkVersion.GetVTKVersion()}))


main(*sys.argv[1:])
