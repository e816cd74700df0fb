#!/usr/bin/python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Runs the plug-ins of client/plugins in the real Blender and FreeCAD, and compares the cuts that they fetch with those
of the same planes that are asked for here.

    run.py CCSLICED CCSLICE
"""

import io
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import urllib.request

import numpy as np
from PIL import Image

PLUGINS = pathlib.Path(__file__).resolve().parents[2] / "client/plugins"
PIXELS = 512


def pixels(png):
    return np.asarray(Image.open(png).convert("RGBA")).astype(int)


def fetch(address, middle, size, up):
    """The cut about a place in mm, x going to the right."""
    server, token = address.split("#token=")
    vector = lambda v: dict(zip("xyz", v))  # noqa: E731
    plane = {"middle_mm": vector(middle), "across": vector((1, 0, 0)), "up": vector(up),
             "across_mm_per_pixel": size / PIXELS}
    body = {"width": PIXELS, "height": PIXELS, "plane": {"free": plane}, "content": {"channel": {"channel": "hardness"}}}
    request = urllib.request.Request(server + "api/preview", data=json.dumps(body).encode(),
                                     headers={"Authorization": "Bearer " + token})
    with urllib.request.urlopen(request, timeout=60) as answer:
        return pixels(io.BytesIO(answer.read()))


def check(name, address, output, printed, up):
    found = re.search(r"middle (\S+) (\S+) (\S+) size (\S+) is (.*)", printed)
    assert found, f"{name} printed: {printed}"
    *middle, size = map(float, found.groups()[:4])
    assert "'hardness': 0." in found.group(5), found.group(5)
    got, wanted = pixels(output), fetch(address, middle, size, up)
    assert got.shape == wanted.shape and (wanted[..., 3] > 0).sum() > 5000
    # Hosts calculate in floats or print few digits: pixels at outlines may fall to the other side.
    other = (abs(got - wanted).max(axis=2) > 2).mean()
    print(f"{name}: {(got[..., 3] > 0).sum()} pixels of the part, {100 * other:.2f} % differ")
    assert other < 0.005, other


def main(ccsliced, ccslice):
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        environment = {**os.environ, "CCSLICED": ccsliced, "HOME": temporary}
        subprocess.run([ccslice, "models", "engine", "-o", folder / "engine.ccmesh", "--quiet"], check=True)
        view = subprocess.Popen([ccslice, "view", folder / "engine.ccmesh", "--no-open"], stdout=subprocess.PIPE,
                                text=True, env={**environment, "PATH": f"{pathlib.Path(ccsliced).parent}:{os.environ['PATH']}"})
        try:
            address = view.stdout.readline().strip()
            run = lambda command, **more: subprocess.run(command, check=True, text=True, timeout=300,  # noqa: E731
                                                         stdout=subprocess.PIPE, env={**environment, **more}).stdout
            output = folder / "blender.png"
            check("Blender", address, output, run(["blender", "--background", "--python",
                                                   PLUGINS / "blender/ccslice_cut.py", "--", address, "hardness", output]),
                  (0, 1, 0))
            output = folder / "freecad.png"
            check("FreeCAD", address, output,
                  run(["freecadcmd", PLUGINS / "freecad/ccslice_cut.FCMacro"], CCSLICE_VIEW=address,
                      CCSLICE_CHANNEL="hardness", CCSLICE_OUTPUT=str(output)), (0, 0, 1))
        finally:
            view.terminate()
            view.wait()


main(*sys.argv[1:])
