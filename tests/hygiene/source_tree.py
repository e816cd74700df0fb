# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""The files of the source tree, without what builds and tools leave behind."""

import os
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]

_IGNORED = {".git", ".ccache", "__pycache__", "build", "node_modules", "out"}


def files(*suffixes, under=""):
    """Paths relative to the root, sorted; those whose name ends with one of the suffixes, or all."""
    found = []
    for folder, subfolders, names in os.walk(ROOT / under):
        subfolders[:] = [name for name in subfolders if name not in _IGNORED]
        found += [pathlib.Path(folder, name).relative_to(ROOT) for name in names]
    return sorted(path for path in found if not suffixes or path.name.endswith(suffixes))


def lines(path):
    """(number, text) of each line."""
    return enumerate((ROOT / path).read_text(encoding="utf-8").splitlines(), start=1)


def finish(findings):
    """Prints the findings and ends the process: 1 if there are any."""
    for finding in findings:
        print(finding)
    print(f"{len(findings)} findings")
    sys.exit(1 if findings else 0)
