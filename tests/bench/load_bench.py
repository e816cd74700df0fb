#!/usr/bin/python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""What the server stands: clients by the thousand, and clients that mean harm.

    load_bench.py [--build build/release] [--parts connections,fair] [--seconds 10] [--json FILE]

Each part is a module in tests/bench/load and starts servers of its own, on this machine. Prints every figure beside its
bar; --json writes an object with a list of them for each part. Exits with 1 if a bar is missed.
"""

import argparse
import dataclasses
import importlib
import json
import pathlib
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
NOT_PARTS = {"__init__", "http2", "part", "slicing"}

sys.dont_write_bytecode = True
sys.path[:0] = [str(ROOT / "tests/bench"), str(ROOT / "tests/support")]
from load.part import Job  # noqa: E402


def all_parts():
    return sorted(path.stem for path in (ROOT / "tests/bench/load").glob("*.py") if path.stem not in NOT_PARTS)


def show(figure):
    bar, verdict = "", ""
    if figure.at_most is not None or figure.at_least is not None:
        bar = f"<= {figure.at_most:g}" if figure.at_most is not None else f">= {figure.at_least:g}"
        verdict = "kept" if figure.kept() else "MISSED"
    print(f"{figure.name:<70} {figure.value:>10.4g} {figure.unit:<8} {bar:>10}  {verdict}", flush=True)


def run(part, options):
    print(part)
    with tempfile.TemporaryDirectory() as name:
        job = Job(build=options.build.resolve(), folder=pathlib.Path(name), seconds=options.seconds)
        figures = importlib.import_module("load." + part).measure(job)
    for figure in figures:
        show(figure)
    return [{**dataclasses.asdict(figure), "kept": figure.kept()} for figure in figures]


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release")
    arguments.add_argument("--parts", default=",".join(all_parts()), help="by default all: %(default)s")
    arguments.add_argument("--without", default="", help="parts to leave out of them")
    arguments.add_argument("--seconds", type=float, default=10, help="for what goes on for a while")
    arguments.add_argument("--json", type=pathlib.Path)
    options = arguments.parse_args()
    left_out = set(filter(None, options.without.split(",")))
    parts = [part for part in options.parts.split(",") if part not in left_out]
    unknown = (set(parts) | left_out) - set(all_parts())
    if unknown:
        arguments.error(f"parts are {', '.join(all_parts())}, not {', '.join(sorted(unknown))}")
    results = {part: run(part, options) for part in parts}
    if options.json:
        options.json.write_text(json.dumps(results, indent=2) + "\n")
    return 0 if all(figure["kept"] for figures in results.values() for figure in figures) else 1


if __name__ == "__main__":
    sys.exit(main())
