# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""A ccsliced of our own, for as long as a client lives."""

import os
import pathlib
import select
import shutil
import subprocess
import time
from typing import Optional

from .errors import LocalServerError

_LONGEST_START_S = 20


def find_ccsliced() -> Optional[str]:
    """The program that the environment variable CCSLICED names, or the first ccsliced in PATH, or the one of a build in
    whose checkout this package is. None if there is none."""
    named = os.environ.get("CCSLICED")
    if named:
        return named
    found = shutil.which("ccsliced")
    if found:
        return found
    built = pathlib.Path(__file__).resolve().parents[3] / "build/release/server/ccsliced"
    return str(built) if built.is_file() else None


class LocalServer:
    """Runs `ccsliced --private`: on a Unix socket that no other user can reach. It ends with close(), and by itself if
    this program is killed. Raises LocalServerError."""

    def __init__(self, program: Optional[str] = None):
        program = program or find_ccsliced()
        if program is None:
            raise LocalServerError("there is no ccsliced in PATH; install it, name it with the environment variable "
                                   "CCSLICED, or give the address of a running server")
        try:
            # A session of its own: Ctrl-C is for this program, which then ends the server.
            self._process = subprocess.Popen([program, "--private", "--log-level", "error"], stdin=subprocess.PIPE,
                                             stdout=subprocess.PIPE, start_new_session=True)
        except OSError as wrong:
            raise LocalServerError(f"{program} can't be started: {wrong.strerror}") from wrong
        try:
            self.address = self._first_line(program)
        except BaseException:
            self.close()
            raise

    def _first_line(self, program: str) -> str:
        output, line = self._process.stdout.fileno(), b""
        end = time.monotonic() + _LONGEST_START_S
        while not line.endswith(b"\n"):
            ready, _, _ = select.select([output], [], [], max(0, end - time.monotonic()))
            if not ready:
                raise LocalServerError(f"{program} doesn't serve after {_LONGEST_START_S} s")
            piece = os.read(output, 4096)
            if not piece:
                raise LocalServerError(f"{program} --private ended before it served: it is another version, or says why "
                                       "above")
            line += piece
        address = line.decode(errors="replace").strip()
        if not address.startswith("unix:"):
            raise LocalServerError(f"{program} --private doesn't say where it serves: it is another version")
        return address

    def close(self) -> None:
        """Ends the server."""
        self._process.stdin.close()
        try:
            self._process.wait(timeout=5)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._process.stdout.close()
