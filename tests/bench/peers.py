#!/usr/bin/python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""What a user would pick today beside ours: PrusaSlicer (outlines only) and VTK's vtkProbeFilter (graded values) from
Debian's packages (deploy/install.sh peers), and a job of ours from client to server, in turn, on samples at the same pitch.

    peers.py BUILD_FOLDER [--models ring,grid] [--runs 3] [--threads N]
"""

import argparse
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time
import zipfile

HERE = pathlib.Path(__file__).resolve().parent

sys.dont_write_bytecode = True
sys.path.insert(0, str(HERE.parent / "support"))
from ccsliced_process import Server  # noqa: E402

PITCH_MM = (0.0423, 0.0846, 0.03)  # The printer of [Luu19, 4].
CHORD_MM = 0.01  # Of the triangles that PrusaSlicer gets: a quarter of the finer pitch.
REFINEMENT = {"ring": 8, "grid": 4}  # Linear hexahedra along each edge of a limit cell, for VTK.
PROBED_LAYERS = 16
MARGIN_VOXELS = 50  # Between the part and the rim of PrusaSlicer's display.


def seconds_of(*command, **options):
    begin = time.monotonic()
    subprocess.run([str(part) for part in command], check=True, stdout=subprocess.DEVNULL, **options)
    return time.monotonic() - begin


def json_of(*command):
    return json.loads(subprocess.run([str(part) for part in command], check=True, stdout=subprocess.PIPE).stdout)


class Part:
    """A sample and what each program needs of it."""

    def __init__(self, name, build, folder):
        self.name = name
        self.folder = folder
        self.build = build
        self.ccslice = build / "client/ccslice"
        self.mesh = folder / f"{name}.ccmesh"
        self.stl = folder / f"{name}.stl"
        self.vtk = folder / f"{name}.vtk"
        seconds_of(self.ccslice, "models", name, "-o", self.mesh, "--quiet")
        with Server(build / "server/ccsliced", folder) as server:
            address = server.address()
            self.grid = json_of(self.ccslice, "plan", self.mesh, "--server", address, "--pitch", self.pitch(), "--json")["grid"]
            self.export = json_of(self.ccslice, "export", self.mesh, "--server", address, "--chord-tolerance", CHORD_MM, "-o",
                                  self.stl, "--json")
            self.channel = json_of(self.ccslice, "info", self.mesh, "--server", address, "--json")["channels"][0]["name"]
        self.refined = json_of(build / "tests/bench/export_refined", name, REFINEMENT.get(name, 4), self.vtk)
        self.voxels = None  # Inside: known after the first slicing.

    @staticmethod
    def pitch():
        return ",".join(map(str, PITCH_MM))


def prusa_settings(part):
    """A display with the job's pitch, larger than the part."""
    columns, rows = (part.grid[axis] + 2 * MARGIN_VOXELS for axis in ("columns", "rows"))
    width, height = columns * PITCH_MM[0], rows * PITCH_MM[1]
    settings = {
        "printer_technology": "SLA", "display_orientation": "landscape", "display_mirror_x": 0, "display_mirror_y": 0,
        "display_pixels_x": columns, "display_pixels_y": rows, "display_width": width, "display_height": height,
        "bed_shape": f"0x0,{width}x0,{width}x{height},0x{height}", "max_print_height": 1000, "layer_height": PITCH_MM[2],
        "initial_layer_height": PITCH_MM[2], "supports_enable": 0, "pad_enable": 0, "hollowing_enable": 0,
        "elefant_foot_compensation": 0, "gamma_correction": 0, "faded_layers": 0,
    }
    path = part.folder / f"{part.name}.ini"
    path.write_text("".join(f"{key} = {value}\n" for key, value in settings.items()))
    return path, (width / 2, height / 2)


def run_prusa(part, threads):
    settings, centre = prusa_settings(part)
    output = part.folder / f"{part.name}.sl1"
    output.unlink(missing_ok=True)
    only = {"preexec_fn": lambda: os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:threads])}
    seconds = seconds_of("prusa-slicer", "--export-sla", "--load", settings, "--center", f"{centre[0]},{centre[1]}", "--loglevel",
                         "0", "-o", output, part.stl, stderr=subprocess.DEVNULL, **only)
    with zipfile.ZipFile(output) as archive:
        layers = sum(name.endswith(".png") for name in archive.namelist())
    if abs(layers - part.grid["layers"]) > 1:
        raise RuntimeError(f"PrusaSlicer made {layers} layers of {part.name}, not {part.grid['layers']}")
    return seconds, part.voxels


def run_vtk(part, threads):
    first = (part.grid["layers"] - PROBED_LAYERS) // 2
    result = json_of(HERE / "vtk_probe.py", part.vtk, threads, json.dumps(part.grid), first, PROBED_LAYERS)
    return result["seconds"], result["voxels"]


def run_ours(part, threads):
    """Upload and preparation included, and the writing of files: `ccslice slice` as a user calls it."""
    with Server(part.build / "server/ccsliced", part.folder, "--threads", str(threads)) as server:
        address = server.address()
        begin = time.monotonic()
        outcome = json_of(part.ccslice, "slice", part.mesh, "--server", address, "--pitch", part.pitch(), "--occupancy", "--channel",
                          part.channel, "--encoding", "zstd", "-o", part.folder / "layers", "--force", "--json")
        seconds = time.monotonic() - begin
    part.voxels = outcome["voxel_count"]
    return seconds, part.voxels


def measure(part, threads, runs):
    """[(program, what it delivers, median seconds, voxels inside that it took them for)]"""
    programs = [
        ("ccslice", f"occupancy and {part.channel} of 8 bits, zstd, files, all layers", run_ours),
        ("PrusaSlicer --export-sla", f"outlines only, PNG, of {part.export['triangles']:,} triangles, all layers", run_prusa),
        ("vtkProbeFilter", f"{part.channel}, floats in memory, of {part.refined['hexahedra']:,} linear hexahedra (their middles "
                           f"{part.refined['position_error_mm']:.1e} mm off), {PROBED_LAYERS} layers", run_vtk),
    ]
    results = {program: [] for program, _, _ in programs}
    for _ in range(runs):
        for program, _, run in programs:  # In turn: what disturbs one disturbs all.
            results[program].append(run(part, threads))
    return [(program, delivers, statistics.median(seconds for seconds, _ in results[program]), results[program][-1][1])
            for program, delivers, _ in programs]


def print_rows(part, rows):
    ours_s, ours_voxels = rows[0][2:]
    for program, delivers, seconds, voxels in rows:
        ns = 1e9 * seconds / voxels
        print(f"{part.name:8} {program:26} {seconds:10.3f} {voxels / 1e6:10.2f} {ns:12.3f} {ns / (1e9 * ours_s / ours_voxels):10.2f}"
              f"  {delivers}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=pathlib.Path, help="as in build/release, with CCSLICE_BUILD_BENCHMARKS")
    parser.add_argument("--models", default="ring,grid")
    parser.add_argument("--runs", type=int, default=3, help="of each program; the median counts")
    parser.add_argument("--threads", type=int, default=len(os.sched_getaffinity(0)))
    options = parser.parse_args()
    print(f"{options.threads} threads, {options.runs} runs in turn, medians; {Part.pitch()} mm; ns per voxel inside")
    print(f"{'model':8} {'program':26} {'seconds':>10} {'Mvoxel':>10} {'ns a voxel':>12} {'of ours':>10}  delivers")
    with tempfile.TemporaryDirectory() as name:
        for model in options.models.split(","):
            part = Part(model, options.build.resolve(), pathlib.Path(name))
            print_rows(part, measure(part, options.threads, options.runs))


main()
