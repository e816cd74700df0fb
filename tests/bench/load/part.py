# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""What the parts of load_bench.py share: figures with their bars, and looks at a process from outside.

A part is a module beside this one with a function `measure(job)`, which gives its figures. `job` is a Job.
"""

import contextlib
import dataclasses
import os
import pathlib
import threading
import time


@dataclasses.dataclass
class Job:
    build: pathlib.Path
    folder: pathlib.Path  # For files, empty.
    seconds: float  # For what goes on for a while.

    def ccsliced(self):
        return self.build / "server/ccsliced"


@dataclasses.dataclass
class Figure:
    name: str
    value: float
    unit: str
    at_most: float | None = None  # A bar; or
    at_least: float | None = None  # this one; or none.

    def kept(self):
        return not (self.at_most is not None and self.value > self.at_most or
                    self.at_least is not None and self.value < self.at_least)


def resident_mb(pid):
    pages = int(pathlib.Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * 4096 / 1e6


class MemoryLimit(contextlib.AbstractContextManager):
    """A control group in which whatever takes more is killed. Where none can be made, a limit of address space."""

    _FOLDERS = [("/sys/fs/cgroup/memory", "memory.limit_in_bytes"), ("/sys/fs/cgroup", "memory.max")]

    def __init__(self, size_bytes):
        self._group = None
        self.within = ["prlimit", f"--as={size_bytes}:{size_bytes}"]
        for parent, name in self._FOLDERS:
            group = pathlib.Path(parent) / f"ccslice-load-{os.getpid()}"
            try:
                group.mkdir()
                self._group = group
                (group / name).write_text(str(size_bytes))
            except OSError:
                self.close()
                continue
            self.within = ["sh", "-c", f'echo $$ >{group}/cgroup.procs && exec "$@"', "sh"]
            return

    def close(self):
        if self._group:
            self._group.rmdir()
            self._group = None

    def __exit__(self, *_):
        self.close()


class Peak:
    """The largest value of a function, asked a hundred times a second."""

    def __init__(self, function):
        self._function = function
        self.value = function()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._watch)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._over.set()
        self._thread.join()

    def _watch(self):
        while not self._over.wait(0.01):
            self.value = max(self.value, self._function())


def seconds_until(condition, limit_s):
    """How long it takes to come true, or the limit."""
    begin = time.monotonic()
    while not condition():
        if time.monotonic() - begin > limit_s:
            return limit_s
        time.sleep(0.01)
    return time.monotonic() - begin
