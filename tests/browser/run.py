#!/usr/bin/python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Opens the page of `ccslice view` in Chromium, and does with it what somebody would (view.mjs).

    run.py CCSLICED CCSLICE [FOLDER for screenshots]
"""

import json
import pathlib
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.dont_write_bytecode = True
sys.path.insert(0, str(HERE.parent / "support"))
from ccsliced_process import Server  # noqa: E402
import node_packages  # noqa: E402


def write_block(file):
    """A block of two channels and two cell regions, `core` at its left and `shell` at its right."""
    columns, rows, layers = 4, 3, 2
    corners = [(x, y, z) for z in range(layers + 1) for y in range(rows + 1) for x in range(columns + 1)]
    number = {corner: i for i, corner in enumerate(corners)}
    around = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    cells = [(x, y, z) for z in range(layers) for y in range(rows) for x in range(columns)]
    file.write_text(json.dumps({
        "positionsMm": [10 * a for corner in corners for a in corner],
        "channelNames": ["lime", "salt"],
        "channelValues": [value for x, y, _ in corners for value in (x / columns, 0.6 - y / (2 * rows))],
        "cellKinds": ["CELL_KIND_HEX"] * len(cells),
        "cellVertices": [number[x + dx, y + dy, z + dz] for x, y, z in cells for dx, dy, dz in around],
        "cellRegionNames": ["core", "shell"],
        "cellRegions": [int(x >= columns // 2) for x, _, _ in cells],
    }))


def main(ccsliced, ccslice, pictures=None):
    node_packages.install(HERE)
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        pictures = pathlib.Path(pictures or folder)
        pictures.mkdir(parents=True, exist_ok=True)
        subprocess.run([ccslice, "models", "engine", "-o", folder / "engine.ccmesh", "--quiet"], check=True)
        write_block(folder / "block.json")
        with Server(ccsliced, folder) as server:
            block = subprocess.run([ccslice, "upload", folder / "block.json", "--json", "--server", server.address()],
                                   check=True, stdout=subprocess.PIPE)
            block_id = json.loads(block.stdout)["mesh"]["mesh_id"]
            view = subprocess.Popen([ccslice, "view", folder / "engine.ccmesh", "--no-open", "--server", server.address()],
                                    stdout=subprocess.PIPE, text=True)
            try:
                address = view.stdout.readline().strip()
                page = subprocess.Popen(["node", HERE / "view.mjs", address, pictures, block_id], stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, text=True)
                for line in page.stdout:
                    if line == "kill\n":
                        listen = server.address()
                        server.kill()
                    elif line == "restart\n":
                        time.sleep(1)
                        server.start_at(listen)
                    else:
                        print(line, end="")
                        continue
                    page.stdin.write("\n")
                    page.stdin.flush()
                return page.wait()
            finally:
                view.terminate()
                view.wait()


sys.exit(main(*sys.argv[1:]))
