#!/usr/bin/python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Packs two samples as .3mf and has the 3MF Consortium's own library read them. Samples the properties at points of the
part by the rules of the 3MF Volumetric Extension, chapters 3.2 and 4.2, and compares them with ProbePoints.

    three_mf.py CCSLICE        (which finds its ccsliced by itself)
"""

import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
from PIL import Image

HERE = pathlib.Path(__file__).resolve().parent
sys.dont_write_bytecode = True
sys.path.insert(0, str(HERE.parent / "support"))
import node_packages  # noqa: E402
from run import json_of  # noqa: E402

# The library drops v:composite, and warns of it and of each of its mappings; its own files have none.
UNKNOWN_ELEMENTS = 1
MILLIMETRE = 1  # Of its eModelUnit.
POINTS = 10_000
MODELS = {
    # Channels, by the options that make them, and their names as XML has them.
    "ring": (["--channel", "hardness"], ["hardness"]),
    "box": (["--grade", "a b=y:20..80", "--channel", "gradient", "--channel", "a b"], ["gradient", "a_b_1"]),
}


def check(found, channels, triangles):
    images = len(channels) + 1
    materials = max(2, len(channels))
    assert found["triangles"] == triangles, found
    assert found["images"] == images, found
    assert len(found["functions"]) == materials + images, found
    assert found["color"] is True, found
    names = [each["name"] for each in found["properties"]]
    assert sorted(names) == sorted("channel:" + name for name in channels), found
    assert found["unit"] == MILLIMETRE, found
    assert found["warnings"] <= found["warnings_of_its_own_file"] + UNKNOWN_ELEMENTS + materials, found


def sampled(stack, transform, points, clamp=True):
    """The stack (sheets, rows, columns) at points: linear between the middles of voxels; beyond the outer ones constant, or
    going to 0 without `clamp`. The first row is where v is 1."""
    uvw = np.c_[points, np.ones(len(points))] @ transform
    stack = stack[:, ::-1]
    at = uvw[:, ::-1] * stack.shape - 0.5  # In sheets, rows and columns.
    lower = np.floor(at).astype(int)
    values = np.zeros(len(points))
    for corner in np.ndindex(2, 2, 2):
        index = np.clip(lower + corner, 0, np.array(stack.shape) - 1)
        weights = np.prod(np.where(corner, at - lower, 1 - (at - lower)), axis=1)
        values += stack[tuple(index.T)] * weights * (clamp | (index == lower + corner).all(axis=1))
    return values


def pictures(paths):
    return np.stack([np.asarray(Image.open(path), dtype=float) for path in paths]) / 255


def compare_with_probes(ccslice, mesh, layers, sheets, properties, channels):
    """The largest difference in steps of 1/255 of the value range, over points whose neighbouring voxels are inside."""
    transform = np.array(properties[0]["transform"])
    inside = pictures(sorted(layers.glob("layer_*_occupancy.png")))
    random = np.random.default_rng(7)
    # The transform takes the part's box to the unit cube.
    points = (random.random((4 * POINTS, 3)) - transform[3]) @ np.linalg.inv(transform[:3])
    points = points[sampled(inside, transform, points, clamp=False) > 1 - 1e-9][:POINTS + POINTS // 20]
    np.savetxt(sheets / "points.txt", points, fmt="%.17g")
    probed = json_of([ccslice, "probe", mesh, "--local", "--points", sheets / "points.txt", "--json"])
    # Between voxels inside a point may still be outside, where the boundary is hollow.
    known = np.array([point["location"] == "inside" for point in probed])
    assert known.sum() >= POINTS, known.sum()
    worst = 0
    for number, each in enumerate(properties):
        channel = channels[each["name"]]
        assert each["linear"] and each["clamps"] and each["channel"] == "red", each
        stack = pictures(sheets / f"{number}_{k}.png" for k in range(each["sheets"]))
        values = sampled(stack, np.array(each["transform"]), points) * each["scale"] + each["offset"]
        expected = np.array([point["channel_values"][channel] for point in probed if point["location"] == "inside"])
        worst = max(worst, np.abs(values[known] - expected).max() / each["scale"] * 255)
    assert worst <= 1, worst
    return worst


def main(ccslice):
    node_packages.install(HERE / "node")
    for model, (options, channels) in MODELS.items():
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            mesh, layers, package = folder / f"{model}.ccmesh", folder / "layers", folder / f"{model}.3mf"

            def run(*words):
                return json_of([ccslice, *words, "--json"])

            run("models", model, "-o", mesh)
            if "--grade" in options:
                run("convert", mesh, *options[:2], "-o", folder / "graded.ccmesh")
                mesh, options = folder / "graded.ccmesh", options[2:]
            run("slice", mesh, "--local", "--pitch", "0.5", "--occupancy", *options, "-o", layers)
            run("package", layers, "--local", "--mesh", mesh, "-o", package)
            surface = run("export", mesh, "--local", "--chord-tolerance", "0.05", "-o", folder / "surface.stl")
            sheets = folder / "sheets"
            sheets.mkdir()
            found = json_of(["node", HERE / "node/read_3mf.mjs", package, sheets])
            check(found, channels, surface["triangles"])
            asked_for = [word for before, word in zip(options, options[1:]) if before == "--channel"]
            channel_of = dict(zip(("channel:" + name for name in channels), asked_for))
            worst = compare_with_probes(ccslice, mesh, layers, sheets, found["properties"], channel_of)
            print(model, json.dumps(found))
            print(f"{POINTS} points are within {worst:.2f} / 255 of ProbePoints")


main(sys.argv[1])
