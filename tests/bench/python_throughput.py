#!/usr/bin/python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""How fast the Python client takes layers, beside the command line, which is the C++ client.

    python_throughput.py [--build build/release] [--rounds 5] [--json FILE]

The same job on one server, in turn: the ring at 0.1 mm with a channel of floats, which travel as zstd frames. Both
decode them and compare checksums. Python gets arrays; the command line writes the frames to memory (/dev/shm), which are
small beside the samples. Prints the medians of seconds and of their ratio. Bar: Python has at least half of the command
line's throughput. Exits with 1 if it hasn't.

Wants python3-zstandard: without it, the Python client asks for samples that aren't compressed.
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

ROOT = pathlib.Path(__file__).resolve().parents[2]

sys.dont_write_bytecode = True
sys.path.insert(0, str(ROOT / "tests/support"))
import zstandard  # noqa: E402, F401
from ccsliced_process import Server  # noqa: E402

PITCH_MM = 0.1
BAR = 0.5


def seconds_of(job):
    begin = time.perf_counter()
    job()
    return time.perf_counter() - begin


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    arguments.add_argument("--rounds", type=int, default=5)
    arguments.add_argument("--json", type=pathlib.Path)
    options = arguments.parse_args()
    ccslice_program = options.build / "client/ccslice"
    with tempfile.TemporaryDirectory(dir="/dev/shm") as name:
        folder = pathlib.Path(name)
        subprocess.run([ROOT / "client/python/make_stubs.py", folder / "python"], check=True)
        sys.path.insert(0, str(folder / "python"))
        import ccslice

        subprocess.run([ccslice_program, "models", "ring", "-o", folder / "ring.ccmesh", "--quiet"], check=True,
                       stdout=subprocess.DEVNULL)
        mesh = ccslice.Mesh.from_file(folder / "ring.ccmesh")
        with Server(options.build / "server/ccsliced", folder) as server, ccslice.Client(server.address()) as client:
            samples = []

            def python():
                samples.append(sum(layer.channels["hardness"].nbytes
                                   for layer in client.slice(mesh, PITCH_MM, channels=["hardness"])))

            def command_line():
                subprocess.run([ccslice_program, "slice", folder / "ring.ccmesh", "--pitch", str(PITCH_MM), "--channel",
                                "hardness:f32", "--encoding", "zstd", "--no-contact-sheet", "--force", "-o",
                                folder / "layers", "--quiet"],
                               check=True, stdout=subprocess.DEVNULL,
                               env={**os.environ, "CCSLICE_SERVER": server.address()})

            python(), command_line()  # The mesh is there, and the programs are in memory.
            grid = json.loads((folder / "layers/manifest.json").read_text())["grid"]
            assert samples[0] == 4 * grid["columns"] * grid["rows"] * grid["layers"] > 0, (samples, grid)
            times = [(seconds_of(python), seconds_of(command_line)) for _ in range(options.rounds)]
    ours, theirs = (statistics.median(column) for column in zip(*times))
    ratio = statistics.median(theirs / ours for ours, theirs in times)
    passed = ratio >= BAR
    print(f"{samples[0] / 1e6:.0f} MB of samples: Python {ours:.2f} s, command line {theirs:.2f} s")
    print(f"throughput of Python over the command line's: {ratio:.2f} (bar: {BAR}) {'ok' if passed else 'MISSED'}")
    if options.json:
        result = {"bytes": samples[0], "python_s": ours, "command_line_s": theirs, "ratio": ratio, "bar": BAR,
                  "passed": passed}
        options.json.write_text(json.dumps(result, indent=2) + "\n")
    return 0 if passed else 1


sys.exit(main())
