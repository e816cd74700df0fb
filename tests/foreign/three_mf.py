#!/usr/bin/python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Packs two samples as .3mf and has the 3MF Consortium's own library read them.

    three_mf.py CCSLICE        (which finds its ccsliced by itself)
"""

import json
import pathlib
import subprocess
import sys
import tempfile

sys.dont_write_bytecode = True
from run import install_node_packages, json_of  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent
# The library drops v:composite, and warns of it and of each of its mappings; its own files have none.
UNKNOWN_ELEMENTS = 1
MILLIMETRE = 1  # Of its eModelUnit.
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
    assert sorted(found["properties"]) == sorted("channel:" + name for name in channels), found
    assert found["unit"] == MILLIMETRE, found
    assert found["warnings"] <= found["warnings_of_its_own_file"] + UNKNOWN_ELEMENTS + materials, found


def main(ccslice):
    install_node_packages()
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
            run("slice", mesh, "--local", "--pitch", "0.5", *options, "-o", layers)
            run("package", layers, "--local", "--mesh", mesh, "-o", package)
            surface = run("export", mesh, "--local", "--chord-tolerance", "0.05", "-o", folder / "surface.stl")
            found = json_of(["node", HERE / "node/read_3mf.mjs", package])
            check(found, channels, surface["triangles"])
            print(model, json.dumps(found))


main(sys.argv[1])
