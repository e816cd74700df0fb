# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""What Node.js needs to drive Chromium."""

import pathlib
import subprocess
import sys

_HERE = pathlib.Path(__file__).resolve().parent


def install():
    """Where it is missing."""
    installed, wanted = _HERE / "node_modules/.package-lock.json", _HERE / "package-lock.json"
    if not installed.exists() or installed.stat().st_mtime < wanted.stat().st_mtime:
        subprocess.run(["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund", "--loglevel=error"], check=True,
                       cwd=_HERE, stdout=sys.stderr)
