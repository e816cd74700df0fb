#!/usr/bin/env python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Compares the speed of the working tree with that of an older revision.

    compare.py                                                     # all suites, against the last release
    compare.py --base HEAD~1 --suites materials,jobs --turns 3     # what a change costs
    compare.py --base v1.0 --json FILE                             # every value of every turn

Builds the benches of both, each in a folder of its own under build/compare that is kept, and runs them in turns: base,
tree, base, tree. Prints the medians of each figure, their ratio (tree / base) and the spread: how far the slower half of
a side's turns is from its faster half, the larger one of both sides. Exits with 1 if a figure is worse by more than 3 %
and by more than that spread, and with 2 if something can't be built, run or found.

In the base's folder the working tree's source of a bench is built with the base's code, so that both sides measure the
same; where it doesn't compile there, the base's own is. A figure that the base can't print is listed as "not in the
base". Wall times need a quiet machine; "CPU" and "ns/voxel" are CPU times and stand some company.
"""

import argparse
import collections
import dataclasses
import itertools
import json
import math
import os
import pathlib
import re
import resource
import shutil
import statistics
import subprocess
import sys
import tarfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
BENCH = "tests/bench"
COMPARE = ROOT / "build/compare"
BASELINE = ROOT / BENCH / "baseline"
TETRAHEDRA = COMPARE / "tetrahedra.vtk"
MODELS = ("ring", "coyote", "engine", "bracket", "grid")
TOLERATED = 0.03
FEWEST_TURNS = 3

# What benches share and what needs nothing of the rest: bases get these of the working tree, too.
HEADERS = ("bars.h", "clocks.h", "median.h")
ADDED_BENCH = """
if(CCSLICE_BUILD_CLIENT AND CCSLICE_BUILD_SERVER)
  add_executable(slicing_bench slicing_bench.cpp)
  target_link_libraries(slicing_bench PRIVATE CLI11::CLI11 ccslice_bench_jobs)
endif()
"""


class Failure(Exception):
    """Something can't be built, run or found."""


@dataclasses.dataclass(frozen=True)
class Suite:
    about: str
    commands: list  # A bench's name and its arguments.
    total_cpu: bool = False  # Each command always does the same work: the CPU time of bench and servers is a figure.


SUITES = {
    "materials": Suite("CPU time a voxel of contours and of materials", [("slicing_bench", "--parts", "materials")]),
    "jobs": Suite("whole jobs through a server: wall time, the server's CPU time and memory",
                  [("slicing_bench", "--parts", "jobs")]),
    "first-layers": Suite("from the call to the first layer of a cached mesh",
                          [("scaling_bench", "--parts", "latency", "--runs", "5")]),
    "growth": Suite("the same ring of 512 to 262,144 cells, and below others",
                    [("scaling_bench", "--parts", "cells,untouched")]),
    "previews": Suite("pictures of planes, coarse and full",
                      [("preview_bench", "--parts", "pictures", "--models", model) for model in MODELS], True),
    "probes": Suite("points probed a second",
                    [("preview_bench", "--parts", "probes", "--models", model) for model in MODELS], True),
    "encoders": Suite("planes as PNG and zstd", [("encode_bench",)]),
    "prepare": Suite("preparing the samples and 2,058 tetrahedra", [("prepare_bench", "--runs", "3", str(TETRAHEDRA))]),
}


Figure = collections.namedtuple("Figure", ("unit", "more_is_better", "value"))


@dataclasses.dataclass
class Comparison:
    """A figure's values, turn by turn. One side is empty if that side can't print it."""
    suite: str
    figure: str
    unit: str
    more_is_better: bool
    base: list
    tree: list

    @property
    def ratio(self):
        if not self.base or not self.tree:
            return None
        return _ratio(statistics.median(self.tree), statistics.median(self.base))

    @property
    def spread(self):
        """Of a side against itself: the slower half of its turns against the faster half. The larger one of both."""
        halves = [(sorted(values), len(values) // 2) for values in (self.base, self.tree) if values]
        return max(_ratio(statistics.median(sorted_[-half:]), statistics.median(sorted_[:half])) - 1
                   for sorted_, half in halves)

    @property
    def verdict(self):
        if not self.base:
            return "not in the base"
        if not self.tree:
            return "not in the tree"
        cost = _ratio(1, self.ratio) if self.more_is_better else self.ratio
        change = max(cost, _ratio(1, cost)) - 1
        if change <= TOLERATED:
            return "same"
        return ("worse" if cost > 1 else "better") if change > self.spread else "within the spread"


def _ratio(value, other):
    if other == 0:
        return 1.0 if value == 0 else math.inf
    return value / other


# A line of tests/bench/bars.h. The benches of old revisions print these, but write no file of figures.
_ROW = re.compile(r"(?P<name>\S.*?)\s{2,}(?P<value>[-+\d.e]+|-?nan|-?inf) (?P<unit>\S.*?)\s*"
                  r"((?P<bound>[<>]=)\s*\S+\s+(kept|MISSED))?")


def read_figures(text):
    """The figures that a bench printed, by name."""
    figures = {}
    for line in text.splitlines():
        if row := _ROW.fullmatch(line.rstrip()):
            more = row["bound"] == ">=" or row["unit"] == "a second" or row["name"].endswith("threads against one")
            figures[row["name"]] = Figure(row["unit"], more, float(row["value"]))
    return figures


def run_bench(program, arguments, total_cpu):
    """Its exit code, the figures and what it said on standard error."""
    before = _cpu_of_children()
    result = subprocess.run([program, *arguments], capture_output=True, text=True, errors="replace")
    figures = read_figures(result.stdout)
    if figures and total_cpu:
        name = " ".join(["bench and server:", program.name, *arguments])
        figures[name] = Figure("s CPU", False, _cpu_of_children() - before)
    return result.returncode, figures, result.stderr


def _cpu_of_children():
    return sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])  # Of user and system.


def run_suite(suite, programs, is_base):
    """The figures of one turn. `programs` has the path of each bench, or None where there is none."""
    figures = {}
    for bench, *arguments in suite.commands:
        program = programs[bench]
        if program is None:
            continue
        code, printed, errors = run_bench(program, arguments, suite.total_cpu)
        # An old bench may not know a part or an option: 100 and more are CLI11's exit codes.
        if is_base and not printed and (code in (0, 1) or 100 <= code < 128):
            continue
        if code not in (0, 1) or not printed:  # 1: a bar is missed.
            what = f"ended with {code}" if code not in (0, 1) else "printed no figures"
            raise Failure(f"{' '.join([str(program), *arguments])} {what}:\n{_tail(errors)}")
        bad = [name for name, figure in printed.items() if not math.isfinite(figure.value)]
        if bad:
            raise Failure(f"{bench} printed no number for: {', '.join(bad)}")
        figures |= printed
    return figures


def compare_suite(name, turns, base_programs, tree_programs):
    """Runs the suite in turns; a comparison for each figure."""
    rows = {}
    for turn in range(turns):
        print(f"{name}: turn {turn + 1} of {turns}", file=sys.stderr, flush=True)
        for side, programs in (("base", base_programs), ("tree", tree_programs)):
            for figure, measured in run_suite(SUITES[name], programs, side == "base").items():
                row = rows.setdefault(figure, Comparison(name, figure, measured.unit, measured.more_is_better, [], []))
                getattr(row, side).append(measured.value)
    return list(rows.values())


def table_row(row):
    base, tree = (f"{statistics.median(values):.4g}" if values else "-" for values in (row.base, row.tree))
    ratio = "-" if row.ratio is None else f"{row.ratio:.3f}"
    spread = f"{100 * row.spread:.1f} %"
    unit = row.unit + (" (more is better)" if row.more_is_better else "")
    verdict = row.verdict.upper() if row.verdict == "worse" else row.verdict
    return f"{row.figure:<72} {base:>9} {tree:>9} {ratio:>7} {spread:>8}  {verdict:<17} {unit}"


def print_table(name, rows):
    print(f"\n{name}: {SUITES[name].about}")
    print(f"{'figure':<72} {'base':>9} {'tree':>9} {'ratio':>7} {'spread':>8}  {'verdict':<17} unit")
    for row in rows:
        print(table_row(row))
    sys.stdout.flush()


def print_summary(rows):
    count = collections.Counter(row.verdict for row in rows)
    print(f"\n{len(rows)} figures: " + ", ".join(f"{count[verdict]} {verdict}" for verdict in sorted(count)))
    for row in rows:
        if row.verdict == "worse":
            print(f"worse: {row.suite}: {row.figure}: {row.ratio:.3f}, spread {100 * row.spread:.1f} %")


def _finite(value):
    return value if value is not None and math.isfinite(value) else None


def to_json(options, base, tree, rows):
    figures = [{**dataclasses.asdict(row), "ratio": _finite(row.ratio), "spread": _finite(row.spread),
                "verdict": row.verdict}
               for row in rows]
    return json.dumps({"base": base, "tree": tree, "turns": options.turns, "figures": figures}, indent=2) + "\n"


def write_tetrahedra(path, side=7):
    """A box of cubes, each as six tetrahedra round its diagonal, in VTK's legacy format."""
    cells = []
    for corner, order in itertools.product(itertools.product(range(side), repeat=3), itertools.permutations(range(3))):
        places = [list(corner)]
        for axis in order:
            places.append([at + (a == axis) for a, at in enumerate(places[-1])])
        if order not in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            places[1], places[2] = places[2], places[1]
        cells.append(["4", *(str(x + (side + 1) * (y + (side + 1) * z)) for x, y, z in places)])
    points = [f"{x} {y} {z}" for z, y, x in itertools.product(range(side + 1), repeat=3)]
    lines = ["# vtk DataFile Version 3.0", path.stem, "ASCII", "DATASET UNSTRUCTURED_GRID", f"POINTS {len(points)} double",
             *points, f"CELLS {len(cells)} {5 * len(cells)}", *map(" ".join, cells), f"CELL_TYPES {len(cells)}",
             *["10"] * len(cells)]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines) + "\n")


def git(*arguments):
    """What git prints, or None if it fails."""
    result = subprocess.run(["git", "-C", str(ROOT), *arguments], capture_output=True, text=True, errors="replace")
    return result.stdout if result.returncode == 0 else None


def default_base():
    tag = git("describe", "--tags", "--abbrev=0", "--match", "v[0-9]*")
    if tag:
        return tag.strip()
    lines = BASELINE.read_text().splitlines() if BASELINE.exists() else []
    revisions = [line.strip() for line in lines if line.strip() and not line.startswith("#")]
    if len(revisions) != 1:
        raise Failure(f"there is no release tag, and {BENCH}/baseline doesn't name one revision; give --base")
    return revisions[0]


def resolve(revision):
    found = git("rev-parse", "--verify", "--quiet", "--end-of-options", revision + "^{commit}")
    if not found:
        raise Failure(f"git knows no revision {revision}; a shallow clone may need git fetch --unshallow")
    return found.strip()


def _tail(text):
    return "\n".join(text.rstrip().splitlines()[-20:])


def _put(path, text):
    """Leaves the file's time alone if it has this text already."""
    if not path.exists() or path.read_text() != text:
        path.write_text(text)


class Build:
    """A build directory, which is kept."""

    def __init__(self, source, folder):
        self._source, self._folder, self._log = source, folder / "build", folder / "log"

    def configure(self):
        if (self._folder / "build.ninja").exists():
            return
        # Older revisions have names that differ only within a file.
        unity = "ON" if (self._source / "cmake/unite_folders.cmake").exists() else "OFF"
        if not self._run(["cmake", "-S", self._source, "-B", self._folder, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
                          f"-DCMAKE_UNITY_BUILD={unity}", "-DCCSLICE_BUILD_BENCHMARKS=ON"]):
            self.fail(f"can't configure {self._source}")

    def compile(self, benches):
        return self._run(["cmake", "--build", self._folder, "--parallel", str(os.cpu_count()), "--target", *benches])

    def program(self, bench):
        return self._folder / BENCH / bench

    def fail(self, what):
        raise Failure(f"{what} ({self._log.relative_to(ROOT)}):\n{_tail(self._log.read_text(errors='replace'))}")

    def _run(self, command):
        self._log.parent.mkdir(parents=True, exist_ok=True)
        with self._log.open("w") as log:
            return subprocess.run(command, stdout=log, stderr=subprocess.STDOUT).returncode == 0


def build_tree(benches):
    build = Build(ROOT, COMPARE / "tree")
    build.configure()
    if not build.compile(benches):
        build.fail("can't build the working tree")
    return {bench: build.program(bench) for bench in benches}


def extract(revision, source):
    if source.exists():
        return
    part = source.with_name("source.part")
    shutil.rmtree(part, ignore_errors=True)
    part.mkdir(parents=True)
    archive = subprocess.Popen(["git", "-C", ROOT, "archive", "--format=tar", revision], stdout=subprocess.PIPE)
    with tarfile.open(fileobj=archive.stdout, mode="r|") as files:
        files.extractall(part)
    if archive.wait() != 0:
        raise Failure(f"git can't archive {revision}")
    part.rename(source)


def build_base(revision, benches):
    """The working tree's benches with the revision's code, or its own, or None where it has none."""
    folder = COMPARE / revision
    source = folder / "source"
    extract(revision, source)
    for name in (*HEADERS, *(f"{bench}.cpp" for bench in benches)):
        _put(source / BENCH / name, (ROOT / BENCH / name).read_text())
    lists = git("show", f"{revision}:{BENCH}/CMakeLists.txt")
    if lists is None:
        raise Failure(f"{revision} has no benches")
    if "slicing_bench" in benches and "slicing_bench" not in lists:
        _put(source / BENCH / "CMakeLists.txt", lists + ADDED_BENCH)
    build = Build(source, folder)
    build.configure()
    programs = {bench: build.program(bench) for bench in benches}
    if not build.compile(["ccslice_core"]):
        build.fail(f"can't build {revision}")
    for bench in benches if not build.compile(benches) else []:
        if build.compile([bench]):
            continue
        own = git("show", f"{revision}:{BENCH}/{bench}.cpp")
        print(f"{bench}: the base {'has its own' if own else 'has none'}", file=sys.stderr, flush=True)
        if own is None:
            programs[bench] = None
            continue
        _put(source / BENCH / f"{bench}.cpp", own)
        if not build.compile([bench]):
            build.fail(f"can't build {bench} of {revision}")
    return programs


def parse(arguments):
    suites = "\n".join(f"  {name:<13} {suite.about}" for name, suite in SUITES.items())
    parser = argparse.ArgumentParser(description=f"{__doc__}\nsuites:\n{suites}",
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--base", metavar="REV",
                        help=f"the revision to compare with (default: the last tag v*, or what {BENCH}/baseline names)")
    parser.add_argument("--suites", default=",".join(SUITES), help="some of them (default: %(default)s)")
    parser.add_argument("--turns", type=int, default=5,
                        help=f"how often each side runs, at least {FEWEST_TURNS} (default: %(default)s)")
    parser.add_argument("--json", type=pathlib.Path, metavar="FILE", help="write every value to this file, too")
    options = parser.parse_args(arguments)
    options.suites = list(dict.fromkeys(options.suites.split(",")))
    unknown = [name for name in options.suites if name not in SUITES]
    if unknown:
        parser.error(f"there is no suite {', '.join(map(repr, unknown))}; suites are {', '.join(SUITES)}")
    if options.turns < FEWEST_TURNS:
        parser.error(f"--turns {options.turns} tells no spread; give at least {FEWEST_TURNS}")
    if options.json and not options.json.resolve().parent.is_dir():
        parser.error(f"--json {options.json}: there is no such folder")
    return options


def compare(options, base, base_programs, tree_programs):
    """Prints the tables; the exit code."""
    tree = (git("rev-parse", "HEAD") or "unknown").strip() + (" and changes" if git("status", "--porcelain") else "")
    print(f"base: {base}\ntree: {tree}\nturns: {options.turns}")
    rows = []
    for name in options.suites:
        rows += (suite_rows := compare_suite(name, options.turns, base_programs, tree_programs))
        print_table(name, suite_rows)
        if options.json:
            options.json.write_text(to_json(options, base, tree, rows))
    print_summary(rows)
    return 1 if any(row.verdict == "worse" for row in rows) else 0


def main(arguments=None):
    options = parse(arguments)
    try:
        base = resolve(options.base or default_base())
        benches = sorted({command[0] for name in options.suites for command in SUITES[name].commands})
        write_tetrahedra(TETRAHEDRA)
        print(f"building {', '.join(benches)} of {base[:12]}: {COMPARE / base / 'log'}", file=sys.stderr, flush=True)
        base_programs = build_base(base, benches)
        print(f"building the working tree's: {COMPARE / 'tree/log'}", file=sys.stderr, flush=True)
        return compare(options, base, base_programs, build_tree(benches))
    except (Failure, OSError) as error:
        print(f"compare.py: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
