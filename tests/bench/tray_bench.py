#!/usr/bin/python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""A whole tray of a J850, 11,575 x 4,606 x 7,407 voxels: 100 parts in three resins by blue noise.

    tray_bench.py                                     # a sixteenth of each job, extrapolated: some minutes
    tray_bench.py --every 1 --jobs rgba               # all of one job: ten minutes, 15 GB of pictures
    tray_bench.py --mesh a.vtk --mesh b.msh --json FILE

Ten copies of each of ten meshes: the five samples, and further ones by --mesh. While these are fewer than five, samples
turned on their side take their places. Each is stretched to its share of the tray, 47 x 37 x 199 mm, and graded along
z. Jobs: `rgba`, PNG of four bytes a voxel; `2-bit`, PNG of numbers of materials; `apart`, as `2-bit`, but no copies are
whole voxels apart, and so each is computed. What is extrapolated is from runs of 64 layers, start of the call included.
The pictures are written to a pipe that is read and forgotten. Prints times of all layers, and the memory of server and
client, beside their bars. Exits with 1 if one is missed. Takes a quiet machine.
"""

import argparse
import contextlib
import dataclasses
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.dont_write_bytecode = True
sys.path[:0] = [str(ROOT / "tests/bench"), str(ROOT / "tests/support")]
from ccsliced_process import Server  # noqa: E402
from load.part import Figure  # noqa: E402

SAMPLES = ("ring", "bracket", "coyote", "engine", "grid")
PITCH_MM = (25.4 / 600, 25.4 / 300, 0.027)
EXTENT = (11575, 4606, 7407)
COLUMNS, ROWS = 10, 10
ROOM_MM = (47.0, 37.0, 199.0)
RUN = 64
MINUTE_S = 60
MATERIALS = [{"name": "clear", "rgba": 0xE6E6E6FF}, {"name": "magenta", "rgba": 0xA8004FFF},
             {"name": "cyan", "rgba": 0x0087BCFF}]
STOPS = [{"value": value, "material": material["name"]} for value, material in zip((0, 0.5, 1), MATERIALS)]
ENCODINGS = {"rgba": "PLANE_ENCODING_PNG_RGBA", "2-bit": "PLANE_ENCODING_PNG", "apart": "PLANE_ENCODING_PNG"}
# Ten solids are estimated to take 0.9 GiB a thread, each on the safe side, and a layer to come out as large as it can.
# What they do take is a figure.
SERVER = "--memory 1GiB --scratch-budget-bytes 3GiB --stream-window-bytes 512MiB"
SERVER_APART = "--memory 16GiB --scratch-budget-bytes 20GiB --stream-window-bytes 512MiB"
# Minutes for the whole tray.
BARS = {"rgba": 30, "2-bit": 15}


@dataclasses.dataclass
class Part:
    name: str
    mesh: str  # Its id.
    low: list  # The corners of its box, mm.
    high: list
    turned: bool


class Bench:
    def __init__(self, options, folder):
        self.client = options.build.resolve() / "client/ccslice"
        self.server_program = options.build.resolve() / "server/ccsliced"
        self.folder = folder
        self.every = options.every
        self.meshes = options.mesh

    def run(self, *arguments):
        return subprocess.run([self.client, *map(str, arguments)], check=True, stdout=subprocess.PIPE).stdout

    def upload(self, address):
        """Ten parts."""
        files = []
        for name in SAMPLES:
            files.append(self.folder / f"{name}.ccmesh")
            self.run("models", name, "-o", files[-1], "--force", "-q")
        more = [pathlib.Path(mesh) for mesh in self.meshes[:5]]
        parts = []
        for number, file in enumerate([*files, *more, *files[len(more):]]):
            turned = number >= len(files) + len(more)
            graded = ["--grade", "value=" + ("x" if turned else "z")]
            mesh = json.loads(self.run("upload", file, *graded, "--server", address, "--json"))["mesh"]
            box = mesh["bounding_box"]
            name = f"{file.stem}{'-turned' if turned else ''}"
            parts.append(Part(name, mesh["mesh_id"], box["min_mm"], box["max_mm"], turned))
        return parts

    def job(self, parts, encoding, apart):
        job = {"grid": {"pitch": dict(zip(("x_mm", "y_mm", "z_mm"), PITCH_MM)), "origin_mm": {},
                        "extent": dict(zip(("columns", "rows", "layers"), EXTENT))},
               "printing": {"materials": MATERIALS, "map": {"blend": {"channel": "value", "stops": STOPS}}},
               "planes": [{"materials": {}, "encoding": encoding}], "snap": not apart,
               "parts": [{"name": part.name, "mesh_id": part.mesh, "placements": []} for part in parts]}
        for place in range(COLUMNS * ROWS):
            part = (place % COLUMNS + place // COLUMNS) % len(parts)  # No two of a part side by side.
            corner = [round((x + 1) / p) * p for x, p in
                      zip((place % COLUMNS * 490 / COLUMNS, place // COLUMNS * 390 / ROWS, -0.5), PITCH_MM)]
            if apart:
                corner[0] += place * 1e-3
                corner[1] += place * 1.1e-3
            job["parts"][part]["placements"].append({"matrix": matrix(parts[part], corner)})
        return job


def matrix(part, corner):
    """Stretches the part to its room, with a corner there. A turned one has its x axis along z."""
    axes = (2, 1, 0) if part.turned else (0, 1, 2)  # Which axis of the mesh goes along x, y, z.
    rows = []
    for axis, own in enumerate(axes):
        sign = -1 if part.turned and axis == 0 else 1
        scale = sign * ROOM_MM[axis] / (part.high[own] - part.low[own])
        row = [0.0] * 4
        row[own] = scale
        row[3] = corner[axis] - scale * (part.low[own] if sign > 0 else part.high[own])
        rows += row
    return rows


def peak_mb(pid):
    text = pathlib.Path(f"/proc/{pid}/status").read_text()
    return int(re.search(r"VmHWM:\s+(\d+) kB", text)[1]) / 1024


def cpu_seconds(pid):
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def slice_run(bench, address, job, first, count):
    """Seconds to the first layer and to the last, bytes, voxels inside and the client's memory."""
    command = [bench.client, "slice", job, "--server", address, "--layers", f"{first}..{first + count - 1}",
               "-o", "-", "--no-contact-sheet"]
    begin = time.monotonic()
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    notes = []
    reader = threading.Thread(target=lambda: notes.append(process.stderr.read()))
    reader.start()
    first_s, size, memory = None, 0, 0
    while data := process.stdout.read(1 << 20):
        first_s = first_s or time.monotonic() - begin
        size += len(data)
        with contextlib.suppress(FileNotFoundError, TypeError):
            memory = max(memory, peak_mb(process.pid))
    process.wait()
    reader.join()
    seconds = time.monotonic() - begin
    if process.returncode != 0:
        sys.exit(f"tray_bench: {' '.join(map(str, command))}\n{notes[0].decode()}")
    voxels = re.search(r"([\d,]+) voxels inside", notes[0].decode())
    return first_s, seconds, size, int(voxels[1].replace(",", "")), memory


def measure(bench, name, parts, server):
    path = bench.folder / f"{name}.json"
    path.write_text(json.dumps(bench.job(parts, ENCODINGS[name], name == "apart")))
    first_s, total_s, size, voxels, layers, memory = None, 0, 0, 0, 0, 0
    if bench.every == 1:
        runs = [(0, EXTENT[2])]
    else:
        step = bench.every * RUN
        runs = [(first, RUN) for first in range(step // 2, EXTENT[2] - RUN, step)]
    cpu_s = cpu_seconds(server.pid())
    for first, count in runs:
        to_first, seconds, data, inside, client_mb = slice_run(bench, server.address(), path, first, count)
        first_s = first_s or to_first
        total_s += seconds
        size += data
        voxels += inside
        layers += count
        memory = max(memory, client_mb)
    scale = EXTENT[2] / layers
    bar = {"at_most": BARS[name]} if name in BARS else {}
    return [Figure(f"{name}: all layers" + ("" if bench.every == 1 else f", from {layers} of them"),
                   scale * total_s / MINUTE_S, "min", **bar),
            Figure(f"{name}: server's CPU time", scale * (cpu_seconds(server.pid()) - cpu_s) / MINUTE_S, "min"),
            Figure(f"{name}: inside", scale * voxels / 1e9, "Gvoxel"),
            Figure(f"{name}: pictures", scale * size / 1e9, "GB"),
            Figure(f"{name}: first layer", first_s, "s", at_most=10),
            Figure(f"{name}: client's memory", memory, "MiB", at_most=150)]


def show(figure):
    bar = f"<= {figure.at_most:g}" if figure.at_most is not None else ""
    verdict = ("kept" if figure.kept() else "MISSED") if bar else ""
    print(f"{figure.name:<50} {figure.value:>10.4g} {figure.unit:<8} {bar:>8}  {verdict}", flush=True)


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    arguments.add_argument("--every", type=int, default=16, help="slice one run of layers in so many; 1: all")
    arguments.add_argument("--jobs", default="rgba,2-bit,apart", help="by default all: %(default)s")
    arguments.add_argument("--server", default=SERVER, help="its options but for `apart` (default: %(default)s)")
    arguments.add_argument("--mesh", action="append", default=[], help="a mesh file to put on the tray; up to five")
    arguments.add_argument("--json", type=pathlib.Path)
    options = arguments.parse_args()
    jobs = options.jobs.split(",")
    if unknown := set(jobs) - set(ENCODINGS):
        arguments.error(f"--jobs: {', '.join(unknown)}: there are {', '.join(ENCODINGS)}")
    figures = []
    with tempfile.TemporaryDirectory() as name:
        bench = Bench(options, pathlib.Path(name))
        for job in jobs:
            folder = bench.folder / job
            folder.mkdir()
            server_options = (SERVER_APART if job == "apart" else options.server).split()
            bar = {} if job == "apart" else {"at_most": 1024}
            with Server(bench.server_program, folder, *server_options) as server:
                figures += measure(bench, job, bench.upload(server.address()), server)
                figures.append(Figure(f"{job}: server's memory", peak_mb(server.pid()), "MiB", **bar))
            for figure in figures[-7:]:
                show(figure)
    if options.json:
        options.json.write_text(json.dumps([{**dataclasses.asdict(f), "kept": f.kept()} for f in figures], indent=1))
    return 0 if all(figure.kept() for figure in figures) else 1


if __name__ == "__main__":
    sys.exit(main())
