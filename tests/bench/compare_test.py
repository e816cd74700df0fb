#!/usr/bin/env python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Tests what compare.py makes of figures and of errors, with scripts in place of benches: nothing is built."""

import contextlib
import io
import json
import math
import pathlib
import subprocess
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import compare  # noqa: E402

# As tests/bench/bars.h prints them.
TABLE = f"""\
{'figure':<66} {'measured':>12} {'unit':<10} {'bar':>12}  verdict
{'ring of 262,144 cells: contours, raster, materials':<66} {6.8:>12.4g} {'ns/voxel':<10}
{'slicing, 262,144 cells against 512':<66} {4.9:>12.4g} {'times':<10} {'<= ':>3}{1.5:>9.4g}  MISSED
{'two threads against one, somewhere':<66} {1.9:>12.4g} {'times':<10} {'>= ':>3}{1.8:>9.4g}  kept
{'points probed, two threads: ring':<66} {1.2e6:>12.4g} {'a second':<10}
{'rod.vtk: two threads against one':<66} {1.7:>12.4g} {'times':<10}
{'of 500 points probed alone, answers that differ: a sample of a long name':<66} {0:>12.4g} {'points':<10} {'<= ':>3}{0:>9.4g}  kept
1 bars missed
"""


def row(base, tree, more_is_better=False):
    return compare.Comparison("suite", "figure", "ms", more_is_better, base, tree)


class ReadsTables(unittest.TestCase):
    def test_names_values_and_units_are_read(self):
        figures = compare.read_figures(TABLE)
        self.assertEqual(len(figures), 6)
        figure = figures["ring of 262,144 cells: contours, raster, materials"]
        self.assertEqual((figure.value, figure.unit, figure.more_is_better), (6.8, "ns/voxel", False))
        self.assertEqual(figures["points probed, two threads: ring"].value, 1.2e6)

    def test_bars_and_units_tell_what_is_better(self):
        better = {name for name, figure in compare.read_figures(TABLE).items() if figure.more_is_better}
        self.assertEqual(better, {"two threads against one, somewhere", "points probed, two threads: ring",
                                  "rod.vtk: two threads against one"})

    def test_other_lines_are_no_figures(self):
        self.assertEqual(compare.read_figures("mesh.vtk isn't there: not measured\n0 bars missed\n\n"), {})


class Judges(unittest.TestCase):
    def test_ratios_are_those_of_medians(self):
        self.assertAlmostEqual(row([10, 30, 20], [22, 90, 1]).ratio, 1.1)

    def test_spread_is_the_slower_half_against_the_faster_half(self):
        self.assertAlmostEqual(row([100, 103, 101], []).spread, 0.03)
        self.assertAlmostEqual(row([12, 10, 11, 14, 10], []).spread, 0.3)
        self.assertAlmostEqual(row([1, 3, 1, 3], []).spread, 2)

    def test_the_larger_spread_of_both_sides_counts(self):
        self.assertAlmostEqual(row([100, 103, 101], [100, 107, 101]).spread, 0.07)
        self.assertAlmostEqual(row([100, 109, 101], [100, 107, 101]).spread, 0.09)
        self.assertEqual(row([100, 100, 100], [101, 105, 109]).verdict, "within the spread")

    def test_worse_is_beyond_three_percent_and_the_spread(self):
        quiet, noisy = [100, 100, 100], [100, 110, 95]
        self.assertEqual(row(quiet, [102.9, 102.9, 102.9]).verdict, "same")
        self.assertEqual(row(quiet, [104, 104, 104]).verdict, "worse")
        self.assertEqual(row(noisy, [110, 110, 110]).verdict, "within the spread")
        self.assertEqual(row(noisy, [117, 117, 117]).verdict, "worse")
        self.assertEqual(row(quiet, [96, 96, 96]).verdict, "better")
        self.assertEqual(row(noisy, [90, 90, 90]).verdict, "within the spread")

    def test_less_is_worse_where_more_is_better(self):
        self.assertEqual(row([100, 100, 100], [96, 96, 96], True).verdict, "worse")
        self.assertEqual(row([100, 100, 100], [104, 104, 104], True).verdict, "better")

    def test_zero_stays_the_same_and_more_than_zero_is_worse(self):
        self.assertEqual(row([0, 0, 0], [0, 0, 0]).verdict, "same")
        self.assertEqual(row([0, 0, 0], [1, 1, 1]).verdict, "worse")
        self.assertEqual(row([1, 1, 1], [0, 0, 0]).verdict, "better")
        self.assertEqual(row([1, 1, 1], [0, 0, 0], True).verdict, "worse")

    def test_figures_of_one_side_are_named(self):
        self.assertEqual(row([], [1, 1, 1]).verdict, "not in the base")
        self.assertEqual(row([1, 1, 1], []).verdict, "not in the tree")
        for alone in (row([], [1, 1, 1]), row([1, 1, 1], [])):
            self.assertIsNone(alone.ratio)
            self.assertIn(alone.verdict, compare.table_row(alone))


class Runs(unittest.TestCase):
    """Scripts print figures."""

    def setUp(self):
        self._folder = tempfile.TemporaryDirectory()
        self.addCleanup(self._folder.cleanup)
        self.folder = pathlib.Path(self._folder.name)

    def script(self, name, text):
        path = self.folder / name
        path.write_text("#!/bin/sh\n" + text)
        path.chmod(0o755)
        return path

    def prints(self, name, *figures, code=0):
        lines = [f"echo '{figure:<66} {value:>12.4g} ms'" for figure, value in figures]
        return self.script(name, "\n".join([*lines, f"exit {code}"]))

    def compare(self, base, tree):
        """The exit code, what it printed and the comparisons."""
        file = self.folder / "figures.json"
        options = compare.parse(["--suites", "encoders", "--turns", "3", "--json", str(file)])
        with contextlib.redirect_stdout(io.StringIO()) as printed, contextlib.redirect_stderr(io.StringIO()):
            code = compare.compare(options, "base", {"encode_bench": base}, {"encode_bench": tree})
        return code, printed.getvalue(), json.loads(file.read_text())["figures"]

    def test_a_worse_figure_ends_with_one_and_is_named(self):
        code, printed, figures = self.compare(self.prints("base", ("a", 10), ("b", 10)),
                                              self.prints("tree", ("a", 10.1), ("b", 11)))
        self.assertEqual(code, 1)
        self.assertIn("2 figures: 1 same, 1 worse\nworse: encoders: b: 1.100, spread 0.0 %\n", printed)
        self.assertEqual([figure["base"] for figure in figures], [[10, 10, 10]] * 2)
        self.assertEqual([figure["verdict"] for figure in figures], ["same", "worse"])

    def test_a_missed_bar_is_no_failure(self):
        self.assertEqual(self.compare(self.prints("base", ("a", 10), code=1),
                                      self.prints("tree", ("a", 9), code=1))[0], 0)

    def test_sides_take_turns(self):
        log = self.folder / "turns"
        self.compare(self.script("base", f"echo base >> {log}; echo 'a   1 ms'"),
                     self.script("tree", f"echo tree >> {log}; echo 'a   1 ms'"))
        self.assertEqual(log.read_text().split(), ["base", "tree"] * 3)

    def test_what_the_base_cannot_print_is_named(self):
        tree = self.prints("tree", ("a", 10))
        unknown_option, no_part = self.script("old", "echo unknown >&2; exit 109"), self.script("older", "exit 0")
        for base in (None, unknown_option, no_part, self.prints("other", ("b", 1))):
            code, printed, figures = self.compare(base, tree)
            self.assertEqual(code, 0)
            self.assertEqual([figure["verdict"] for figure in figures if figure["figure"] == "a"], ["not in the base"])
            self.assertIn("1 not in the base", printed)

    def test_a_bench_that_fails_is_told_with_its_words(self):
        good = self.prints("good", ("a", 10))
        for bad, words in ((self.script("bad", "echo out of luck >&2; exit 2"), "ended with 2:\nout of luck"),
                           (self.script("dead", "kill -9 $$"), "ended with -9"),
                           (self.script("silent", "exit 0"), "printed no figures"),
                           (self.script("nan", "echo 'a   nan ms'"), "no number for: a")):
            with self.assertRaises(compare.Failure) as failure:
                self.compare(good, bad)
            self.assertIn(words, str(failure.exception))

    def test_cpu_time_of_the_whole_run_is_a_figure_where_the_work_is_fixed(self):
        busy = self.script("busy", "i=0; while [ $i -lt 20000 ]; do i=$((i + 1)); done; echo 'a   1 ms'")
        code, figures, _ = compare.run_bench(busy, ["--parts", "x"], True)
        total = figures["bench and server: busy --parts x"]
        self.assertEqual((code, total.unit), (0, "s CPU"))
        self.assertTrue(0 < total.value < 60 and math.isfinite(total.value))


class WritesTetrahedra(unittest.TestCase):
    def test_they_fill_the_box(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "tetrahedra.vtk"
            compare.write_tetrahedra(path, 2)
            lines = path.read_text().splitlines()
        points = [tuple(map(int, line.split())) for line in lines[5:32]]
        cells = [[points[int(v)] for v in line.split()[1:]] for line in lines[33:81]]
        self.assertEqual((lines[4], lines[32], lines[81]), ("POINTS 27 double", "CELLS 48 240", "CELL_TYPES 48"))
        self.assertEqual(lines[82:], ["10"] * 48)
        for a, *others in cells:
            (p, q, r), (s, t, u), (v, w, x) = [[c - d for c, d in zip(other, a)] for other in others]
            self.assertEqual(p * (t * x - u * w) - q * (s * x - u * v) + r * (s * w - t * v), 1)  # Six volumes.


class RefusesArguments(unittest.TestCase):
    def refused(self, *arguments):
        result = subprocess.run([sys.executable, compare.__file__, *arguments], capture_output=True, text=True)
        self.assertEqual(result.returncode, 2)
        return result.stderr

    def test_an_unknown_revision_is_named(self):
        self.assertIn("no revision no-such-revision", self.refused("--base", "no-such-revision"))

    def test_an_unknown_suite_is_named_with_those_that_there_are(self):
        self.assertIn("no suite 'speed'; suites are materials, jobs", self.refused("--suites", "materials,speed"))

    def test_turns_that_tell_no_spread_are_refused(self):
        self.assertIn("give at least 3", self.refused("--turns", "2"))

    def test_a_file_in_no_folder_is_refused_before_anything_runs(self):
        self.assertIn("no such folder", self.refused("--json", "/no/such/folder/figures.json"))

    def test_help_names_all_suites(self):
        result = subprocess.run([sys.executable, compare.__file__, "--help"], capture_output=True, text=True)
        self.assertEqual(result.returncode, 0)
        for suite in compare.SUITES:
            self.assertIn(f"\n  {suite} ", result.stdout)


if __name__ == "__main__":
    unittest.main()
