#!/usr/bin/env python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Puts the package with the stubs of the contract into a folder, from where it can be imported.

    client/python/make_stubs.py FOLDER        and then PYTHONPATH=FOLDER

Takes protoc and gRPC's plugin for Python (Debian: protobuf-compiler, protobuf-compiler-grpc).
"""

import pathlib
import shutil
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
PROTO = HERE.parents[1] / "proto"


def version_of_sources():
    """That of the programs, too."""
    return subprocess.run([HERE.parents[1] / "cmake/version.sh"], check=True, capture_output=True, text=True).stdout.strip()


def make_stubs(folder):
    """Writes the version, ccslice/v1 and the descriptions of error details below a folder."""
    plugin = shutil.which("grpc_python_plugin")
    if plugin is None or shutil.which("protoc") is None:
        sys.exit("make_stubs.py: protoc or grpc_python_plugin is missing; "
                 "apt-get install protobuf-compiler protobuf-compiler-grpc")
    package = folder / "ccslice"
    (package / "v1").mkdir(parents=True, exist_ok=True)
    contract = [str(path) for path in sorted((PROTO / "ccslice/v1").glob("*.proto"))]
    subprocess.run(
        ["protoc", "-I", PROTO, f"--python_out={folder}", f"--grpc_python_out={folder}",
         f"--plugin=protoc-gen-grpc_python={plugin}", *contract], check=True)
    # Messages of google.rpc, for a pool of their own: other packages bring modules of that name.
    details = [str(path) for path in sorted((PROTO / "google/rpc").glob("*.proto"))]
    subprocess.run(
        ["protoc", "-I", PROTO, "--include_imports", f"--descriptor_set_out={package / 'error_details.binpb'}", *details],
        check=True)
    (package / "v1/__init__.py").touch()
    (package / "_version.py").write_text(f'__version__ = "{version_of_sources()}"\n', encoding="utf-8")


def main(folder):
    shutil.copytree(HERE / "ccslice", folder / "ccslice", dirs_exist_ok=True)
    make_stubs(folder)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(pathlib.Path(sys.argv[1]))
