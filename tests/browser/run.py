#!/usr/bin/python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Opens the page of `ccslice view` in Chromium, and does with it what somebody would (view.mjs).

    run.py CCSLICED CCSLICE [FOLDER for screenshots]
"""

import pathlib
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.dont_write_bytecode = True
sys.path.insert(0, str(HERE.parent / "support"))
from ccsliced_process import Server  # noqa: E402


def install_packages():
    """Where they are missing."""
    installed, wanted = HERE / "node_modules/.package-lock.json", HERE / "package-lock.json"
    if not installed.exists() or installed.stat().st_mtime < wanted.stat().st_mtime:
        subprocess.run(["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund", "--loglevel=error"], check=True,
                       cwd=HERE, stdout=sys.stderr)


def main(ccsliced, ccslice, pictures=None):
    install_packages()
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        pictures = pathlib.Path(pictures or folder)
        pictures.mkdir(parents=True, exist_ok=True)
        subprocess.run([ccslice, "models", "engine", "-o", folder / "engine.ccmesh", "--quiet"], check=True)
        with Server(ccsliced, folder) as server:
            view = subprocess.Popen([ccslice, "view", folder / "engine.ccmesh", "--no-open", "--server", server.address()],
                                    stdout=subprocess.PIPE, text=True)
            try:
                address = view.stdout.readline().strip()
                page = subprocess.Popen(["node", HERE / "view.mjs", address, pictures], stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, text=True)
                for line in page.stdout:
                    if line == "kill\n":
                        listen = server.address()
                        server.kill()
                    elif line == "restart\n":
                        time.sleep(1)
                        server.start_at(listen)
                    else:
                        print(line, end="")
                        continue
                    page.stdin.write("\n")
                    page.stdin.flush()
                return page.wait()
            finally:
                view.terminate()
                view.wait()


sys.exit(main(*sys.argv[1:]))
