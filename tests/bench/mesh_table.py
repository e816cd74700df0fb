#!/usr/bin/env python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Every sample and every mesh of a folder through the command line and a server: uploaded, planned, sliced at eight
heights, and compared point by point with the service's own probe. Prints a table in Markdown: cells by class, memory,
preparation, and what the comparison found; then the refusals.

    mesh_table.py [--build build/release] [--meshes FOLDER]     # FOLDER defaults to CCSLICE_SHARED_MESHES_DIR
    mesh_table.py --full-pitch                                  # voxels inside of the samples at the paper's pitch

--full-pitch slices the five samples of [Luu19, Table 2] whole, as occupancy, and compares the voxel counts.
Exits with 1 if a mesh was neither sliced as it should be nor refused with its cells named.
"""

import argparse
import json
import os
import pathlib
import random
import re
import struct
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]

sys.dont_write_bytecode = True
sys.path.insert(0, str(ROOT / "tests/support"))
from ccsliced_process import Server  # noqa: E402

PAPER_PITCH = "0.0423,0.0846,0.03"
# [Luu19, Table 2]: voxels inside, in millions.
PAPER_VOXELS = {"coyote": 219, "engine": 138, "ring": 507, "bracket": 57, "grid": 156}
LAYERS = 8
VOXELS_ALONG = 200  # The longer side of a layer.
CHECKED_VOXELS = 400  # A layer.
REFUSED = 3  # ccslice's exit code for meshes at fault.
MESH_FILES = (".mesh", ".vtk", ".ovm", ".ccmesh", ".json")
# Materials of voxels and of probes are both found by iteration and interpolation: 1/65536 of the range, and some room.
MATERIAL_TOLERANCE = 2e-5
CONTOUR_TOLERANCE_MM = 0.001  # ccslice's default.


class Programs(Server):
    """A server, and ccslice with it."""

    def __init__(self, build, folder):
        super().__init__(build / "server/ccsliced", folder)
        self._client = build / "client/ccslice"
        self._environment = {**os.environ, "CCSLICE_SERVER": self.address()}

    def run(self, *arguments):
        """Exit code and what was answered."""
        command = [self._client, *map(str, arguments), "--json"]
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=self._environment, check=False)
        if not done.stdout:
            raise RuntimeError(f"{' '.join(map(str, command))}: {done.stderr.decode()}")
        return done.returncode, json.loads(done.stdout)

    def answer(self, *arguments):
        code, answer = self.run(*arguments)
        if code != 0:
            raise RuntimeError(answer["error"]["message"])
        return answer

    def cpu_seconds(self):
        times = pathlib.Path(f"/proc/{self.pid()}/stat").read_text().rpartition(")")[2].split()
        return (int(times[11]) + int(times[12])) / os.sysconf("SC_CLK_TCK")


def sample_checks(manifest, folder):
    """Voxels of every layer by chance: where they are and what the layer says of them."""
    grid = manifest["grid"]
    columns, rows, stride = grid["columns"], grid["rows"], (grid["columns"] + 7) // 8
    chosen = random.Random(1)
    for layer in manifest["layers"]:
        bits = (folder / layer["planes"][0]["file"]).read_bytes()
        values = (folder / layer["planes"][1]["file"]).read_bytes()
        for _ in range(CHECKED_VOXELS):
            i, j = chosen.randrange(columns), chosen.randrange(rows)
            inside = bits[j * stride + i // 8] >> (7 - i % 8) & 1 == 1
            (value,) = struct.unpack_from("<f", values, 4 * (j * columns + i))
            x, y = (grid["origin_mm"][d] + (v + 0.5) * grid["pitch_mm"][d] for d, v in ((0, i), (1, j)))
            yield (x, y, layer["z_mm"]), inside, value


def probe(server, mesh_id, points, folder):
    path = folder / "points.txt"
    path.write_text("".join(f"{x!r} {y!r} {z!r}\n" for x, y, z in points))
    return server.answer("probe", mesh_id, "--points", path) if points else []


def far_from_surface(server, mesh_id, points, folder):
    """How many of the points are alike with all places around them, farther than contours may be off, and points
    outside count as inside, together."""
    step = 4 * CONTOUR_TOLERANCE_MM
    steps = [(0, 0, 0)] + [tuple(sign * step * (d == axis) for d in range(3)) for axis in range(3) for sign in (-1, 1)]
    around = [tuple(p + s for p, s in zip(point, move)) for point in points for move in steps]
    answers = [answer["location"] for answer in probe(server, mesh_id, around, folder)]
    return sum(len(set(answers[at:at + len(steps)])) == 1 for at in range(0, len(answers), len(steps)))


def differences(server, mesh_id, manifest, folder, channel):
    """Voxels whose occupancy the probe contradicts, and the largest difference of the others' materials, as a share of
    the channel's range."""
    checks = list(sample_checks(manifest, folder))
    span = (channel["max_value"] - channel["min_value"]) or 1
    contradicted, worst = [], 0.0
    answers = probe(server, mesh_id, [point for point, _, _ in checks], folder)
    for (point, inside, value), answer in zip(checks, answers):
        if inside != (answer["location"] == "inside"):
            contradicted.append(point)
        elif inside:
            worst = max(worst, abs(value - answer["channel_values"][channel["name"]]) / span)
    return len(checks), far_from_surface(server, mesh_id, contradicted, folder), worst


def pitch_of(box):
    size = [high - low for low, high in zip(box["min_mm"], box["max_mm"])]
    fine = max(size[0], size[1]) / VOXELS_ALONG
    return f"{fine!r},{fine!r},{size[2] / LAYERS!r}"


def table_row(server, name, path, options, folder):
    """A mesh that is taken: its row, and whether the comparison was as it should be."""
    begin = server.cpu_seconds()
    mesh = server.answer("upload", path, *options)["mesh"]
    preparation_ms = 1000 * (server.cpu_seconds() - begin)
    channel = mesh["channels"][0]
    job = [mesh["mesh_id"], "--pitch", pitch_of(mesh["bounding_box"])]
    layers = server.answer("plan", *job)["layer_count"]
    out = folder / name
    job += ["--occupancy", "--channel", channel["name"] + ":f32", "--encoding", "raw", "--no-contact-sheet"]
    sliced = server.answer("slice", *job, "--output", out)
    manifest = json.loads((out / "manifest.json").read_text())
    checked, wrong, worst = differences(server, mesh["mesh_id"], manifest, out, channel)
    folds = mesh["folding_cells"]
    good = layers == LAYERS and wrong == 0 and sliced["voxels_unresolved"] == 0 and (worst <= MATERIAL_TOLERANCE or folds > 0)
    row = [name, mesh["control_cells"], mesh["regular_cells"], mesh["line_cells"], mesh["vertex_cells"], folds,
           f"{mesh['memory_bytes'] / 1e6:.1f}", f"{preparation_ms:.0f}", sliced["voxel_count"],
           sliced["voxels_unresolved"], f"{wrong} of {checked}", f"{worst:.1e}"]
    return row, good


def markdown(heads, rows):
    line = lambda cells: "| " + " | ".join(f"{cell:,}" if isinstance(cell, int) else str(cell) for cell in cells) + " |"
    return "\n".join([line(heads), line(["---"] * len(heads)), *map(line, rows)])


def subjects(server, meshes, folder):
    """Name, file and options of every mesh. Those without channels get one along z."""
    for sample in (*PAPER_VOXELS, "box"):
        path = folder / f"{sample}.ccmesh"
        server.answer("models", sample, "--output", path)
        yield sample, path, []
    if not (meshes and meshes.is_dir()):
        print(f"NOT CHECKED: real meshes, there is no folder {meshes}")
        return
    for path in sorted(meshes.iterdir()):
        if path.suffix in MESH_FILES:
            code, facts = server.run("info", path)
            yield path.name, path, [] if code == 0 and facts["channels"] else ["--grade", "height=z"]


def print_mesh_table(server, meshes, folder):
    rows, refusals, bad = [], [], []
    for name, path, options in subjects(server, meshes, folder):
        print(name, file=sys.stderr)
        code, error = server.run("convert", path, *options, "--output", folder / "converted.ccmesh", "--force")
        if code == REFUSED:
            message = error["error"]["message"].removeprefix(f"{path}: ")
            refusals.append([name, error["error"]["reason"], message])
            good = re.search(r"cells? \d", message)
        else:
            row, good = table_row(server, name, path, options, folder)
            rows.append(row)
        if not good:
            bad.append(name)
    print(markdown(["mesh", "control cells", "regular", "line", "vertex", "folding", "MB", "preparation, ms of CPU",
                    "voxels inside", "unresolved", "probed otherwise", "worst material"], rows))
    if refusals:
        print("\n" + markdown(["refused", "reason", "message"], refusals))
    print(f"\n{len(rows)} sliced, {len(refusals)} refused, not as it should be: {', '.join(bad) or 'none'}")
    return not bad


def print_full_pitch(server, folder):
    rows = []
    for sample, paper in PAPER_VOXELS.items():
        print(sample, file=sys.stderr)
        path, out = folder / f"{sample}.ccmesh", folder / sample
        server.answer("models", sample, "--output", path)
        done = server.answer("slice", path, "--pitch", PAPER_PITCH, "--occupancy", "--encoding", "zstd",
                             "--no-contact-sheet", "--output", out)
        grid = json.loads((out / "manifest.json").read_text())["grid"]
        voxels = done["voxel_count"]
        rows.append([sample, f"{grid['columns']} x {grid['rows']}", done["layers"], voxels, f"{paper} M",
                     f"{voxels / (1e6 * paper):.2f}"])
    print(markdown(["model", "bitmap", "layers", "voxels inside", "[Luu19, Table 2]", "ratio"], rows))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    parser.add_argument("--meshes", type=pathlib.Path, default=os.environ.get("CCSLICE_SHARED_MESHES_DIR"))
    parser.add_argument("--full-pitch", action="store_true")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        with Programs(options.build, folder) as server:
            if options.full_pitch:
                print_full_pitch(server, folder)
                return 0
            return 0 if print_mesh_table(server, options.meshes, folder) else 1


if __name__ == "__main__":
    sys.exit(main())
