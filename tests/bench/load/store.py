# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Two servers with one mesh store that fails them: Redis that is killed, stopped and started again, files that are cut
short and flipped. Calls get the right bytes or a clear error, and hardly later; the next upload repairs."""

import os
import shutil
import signal
import socket
import subprocess
import time

from ccsliced_process import Server
from free_port import free_port
from load.part import Figure
from load.slicing import sample

_LATER_S = 1.5


class _Redis:
    def __init__(self, folder):
        self._port, self._folder = free_port(), folder
        self.start()

    def start(self):
        self._process = subprocess.Popen(["redis-server", "--port", str(self._port), "--bind", "127.0.0.1", "--save", "",
                                          "--dir", self._folder], stdout=subprocess.DEVNULL)
        while True:
            with socket.socket() as tried:
                if tried.connect_ex(("127.0.0.1", self._port)) == 0:
                    return
            time.sleep(0.02)

    def place(self):
        return f"redis://127.0.0.1:{self._port}"

    def stop_answering(self):
        os.kill(self._process.pid, signal.SIGSTOP)

    def answer_again(self):
        os.kill(self._process.pid, signal.SIGCONT)

    def kill(self):
        self._process.kill()
        self._process.wait()


class _Trial:
    """Slices with fresh servers, which have to read the store, and with those that hold the mesh already."""

    def __init__(self, job, name, place):
        self._job, self._name, self._place, self._mesh, self._count = job, name, place, sample(job), 0
        self.wrong, self.slowest_s, self.usual_s = 0, 0.0, None
        self._wanted = self._slice_fresh()[0]

    def fresh(self):
        """A server that holds nothing slices; the client may have to upload."""
        bytes_, seconds = self._slice_fresh()
        self.wrong += bytes_ != self._wanted
        if self.usual_s is None:
            self.usual_s = seconds
        self.slowest_s = max(self.slowest_s, seconds)

    def _slice_fresh(self):
        self._count += 1
        folder = self._job.folder / f"{self._name}{self._count}"
        folder.mkdir()
        with Server(self._job.ccsliced(), folder, "--mesh-store", self._place) as server:
            address = server.address()
            begin = time.monotonic()
            done = subprocess.run([self._job.build / "client/ccslice", "slice", self._mesh, "--server", address, "--pitch",
                                   "0.5", "--encoding", "raw", "--no-contact-sheet", "--quiet", "-o", folder / "layers"],
                                  capture_output=True)
            seconds = time.monotonic() - begin
        files = sorted((folder / "layers").glob("layer_*"))
        bytes_ = b"".join(path.read_bytes() for path in files) if done.returncode == 0 else done.stderr
        shutil.rmtree(folder / "layers", ignore_errors=True)
        return bytes_, seconds

    def figures(self, what):
        return [Figure(f"{what}: slices with wrong bytes, or failed", self.wrong, "", at_most=0),
                Figure(f"{what}: the slowest, beyond the first", self.slowest_s - self.usual_s, "s", at_most=_LATER_S)]


def _redis(job):
    folder = job.folder / "redis"
    folder.mkdir()
    redis = _Redis(folder)
    try:
        trial = _Trial(job, "in-redis", redis.place())
        trial.fresh()
        redis.kill()
        trial.fresh()
        redis.start()
        trial.fresh()
        redis.stop_answering()
        trial.fresh()
        redis.answer_again()
        trial.fresh()
        return trial.figures("Redis killed, stopped, back")
    finally:
        redis.kill()


def _folder(job):
    store = job.folder / "store"
    trial = _Trial(job, "in-folder", f"dir:{store}")
    trial.fresh()
    file = next(path for path in store.rglob("*") if path.is_file())
    whole = file.read_bytes()
    repaired = 0
    damages = [whole[:len(whole) // 2], b"", whole[:-1] + bytes([whole[-1] ^ 1]), whole + b"x", os.urandom(len(whole))]
    for damage in damages:
        file.write_bytes(damage)
        trial.fresh()
        repaired += file.read_bytes() == whole
    return [*trial.figures("files cut short, emptied, flipped, longer"),
            Figure("of damaged files, repaired by the next upload", repaired, "", at_least=len(damages))]


def measure(job):
    return [*_redis(job), *_folder(job)]
