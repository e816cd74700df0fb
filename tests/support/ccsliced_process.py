# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""A server for scripts that test or measure it."""

import re
import subprocess
import time

_START_S = 30


class Server:
    """ccsliced on a free port of this machine, with its log in a file of `folder`. `open_files`: its limit of them."""

    def __init__(self, program, folder, *options, open_files=None):
        self._log = folder / "server.log"
        limit = ["prlimit", f"--nofile={open_files}:{open_files}"] if open_files else []
        with open(self._log, "wb") as log:
            self._process = subprocess.Popen([*limit, program, "--listen", "127.0.0.1:0", *options], stderr=log)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.terminate()
        self._process.wait()

    def pid(self):
        return self._process.pid

    def address(self):
        """Waits until it serves."""
        end = time.monotonic() + _START_S
        while time.monotonic() < end and self._process.poll() is None:
            found = re.search(r"serves on (\S+): .*\n", self._log.read_text())
            if found:
                return found.group(1)
            time.sleep(0.05)
        raise RuntimeError("the server doesn't serve: " + self._log.read_text())
