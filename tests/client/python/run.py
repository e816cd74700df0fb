#!/usr/bin/python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Runs the tests of the Python client, with the package as make_stubs.py makes it.

    run.py CCSLICED CCSLICE
"""

import os
import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
REPOSITORY = HERE.parents[2]


def main(ccsliced, ccslice):
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "CCSLICED": ccsliced, "CCSLICE": ccslice, "PYTHONPATH": folder,
                       "PYTHONDONTWRITEBYTECODE": "1"}
        environment.pop("CCSLICE_SERVER", None)
        subprocess.run(["/usr/bin/python3", REPOSITORY / "client/python/make_stubs.py", folder], check=True, env=environment)
        sys.exit(subprocess.run(["/usr/bin/python3", HERE / "test_client.py"], env=environment, cwd=folder).returncode)


main(*sys.argv[1:])
