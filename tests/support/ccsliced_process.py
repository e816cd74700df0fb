# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""A server for scripts that test or measure it."""

import re
import subprocess
import time

_START_S = 30


def address_in(log):
    """Where the server with this log serves, or None as long as it doesn't."""
    found = re.search(r"serves on (\S+): .*\n", log)
    return found and found.group(1)


class Server:
    """ccsliced on a free port of this machine, with its log in a file of `folder`. `open_files`: its limit of them.
    `within`: words of a command that runs another one in its place."""

    def __init__(self, program, folder, *options, open_files=None, within=()):
        self._log = folder / "server.log"
        limit = ["prlimit", f"--nofile={open_files}:{open_files}"] if open_files else []
        self._command = [*within, *limit, program, *options]
        self._start("127.0.0.1:0")

    def _start(self, listen):
        with open(self._log, "wb") as log:
            self._process = subprocess.Popen([*self._command, "--listen", listen], stderr=log)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.terminate()
        self._process.wait()

    def kill(self):
        """Ends it without a word, as SIGKILL does."""
        self._process.kill()
        self._process.wait()

    def stop_gracefully(self):
        """Asks it to stop, and waits; its exit code."""
        self._process.terminate()
        return self._process.wait()

    def start_at(self, address):
        """Serves again, where it did before it was killed."""
        self._start(address)
        self.address()

    def kill_for(self, seconds):
        """Kills it. After that time it serves again at the same address."""
        address = self.address()
        self.kill()
        time.sleep(seconds)
        self.start_at(address)

    def runs(self):
        return self._process.poll() is None

    def pid(self):
        return self._process.pid

    def address(self):
        """Waits until it serves."""
        end = time.monotonic() + _START_S
        while time.monotonic() < end and self._process.poll() is None:
            if address := address_in(self._log.read_text()):
                return address
            time.sleep(0.01)
        raise RuntimeError("the server doesn't serve: " + self._log.read_text())
