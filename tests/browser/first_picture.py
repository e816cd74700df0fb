#!/usr/bin/python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""How long it takes from the start of `ccslice view` to the page's first picture, in a browser that is open already, of
meshes that the server has prepared.

    first_picture.py CCSLICED CCSLICE [--samples ring,engine] [--times 5] [--most-ms MS]

Prints a line for each sample, in ms: until the address is printed, the first picture is on the screen (coarse), the
full one is, and the part in space is; the median, and in brackets the worst. Fails if a median of the first picture is
above MS.
"""

import argparse
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.dont_write_bytecode = True
sys.path.insert(0, str(HERE.parent / "support"))
from ccsliced_process import Server  # noqa: E402
import node_packages  # noqa: E402

STEPS = ["address", "first", "full", "space"]


def open_once(ccslice, mesh, server, browser):
    """Milliseconds from the start of `ccslice view` to each step."""
    begin = time.time()
    view = subprocess.Popen([ccslice, "view", mesh, "--no-open", "--quiet", "--server", server], stdout=subprocess.PIPE,
                            text=True)
    try:
        address = view.stdout.readline().strip()
        printed = time.time()
        browser.stdin.write(address + "\n")
        browser.stdin.flush()
        answer = browser.stdout.readline()
        if not answer:
            raise RuntimeError("the browser gave up")
        seen = json.loads(answer)
        return {"address": 1000 * (printed - begin), **{step: at - 1000 * begin for step, at in seen.items()}}
    finally:
        view.terminate()
        view.wait()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("ccsliced")
    parser.add_argument("ccslice")
    parser.add_argument("--samples", default="ring,coyote,engine,bracket,grid")
    parser.add_argument("--times", type=int, default=5)
    parser.add_argument("--most-ms", type=float, default=float("inf"))
    options = parser.parse_args()
    node_packages.install(HERE)
    late = []
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        with Server(options.ccsliced, folder) as server:
            browser = subprocess.Popen(["node", HERE / "first_picture.mjs"], stdin=subprocess.PIPE,
                                       stdout=subprocess.PIPE, text=True)
            for sample in options.samples.split(","):
                mesh = folder / f"{sample}.ccmesh"
                subprocess.run([options.ccslice, "models", sample, "-o", mesh, "--quiet"], check=True,
                               stdout=subprocess.DEVNULL)
                open_once(options.ccslice, mesh, server.address(), browser)  # The server has the mesh then.
                times = [open_once(options.ccslice, mesh, server.address(), browser) for _ in range(options.times)]
                columns = []
                for step in STEPS:
                    all_ms = [each[step] for each in times]
                    columns.append(f"{step} {statistics.median(all_ms):.0f} ({max(all_ms):.0f})")
                print(f"{sample}: {', '.join(columns)}", flush=True)
                if statistics.median(each["first"] for each in times) > options.most_ms:
                    late.append(sample)
            browser.stdin.close()
            browser.wait()
    if late:
        sys.exit(f"the first picture of {', '.join(late)} took more than {options.most_ms:.0f} ms")


main()
