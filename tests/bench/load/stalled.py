# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""200 calls that read one message of a job of the ring, 512 x 512, and no more, of a server with memory for a few of
them: what the server keeps meanwhile, how long another client's job and its single layers take, and whether all get
the right bytes when they read on. The same of a server with 512 MiB in all."""

import hashlib
import threading
import time

import grpc

from ccsliced_process import Server
from load.part import Figure, Peak, resident_mb, seconds_until
from served_clients import Jobs, Stub, python_client, sample

_CALLS = 200
_CONNECTIONS = 8
_COLUMNS = 512
_LAYERS = 64
_ACTIVE_COLUMNS = 1000
_MB_OF_MIB = 1.048576


def _raw(request):
    from ccslice.v1 import job_pb2
    request.job.planes[0].encoding = job_pb2.PLANE_ENCODING_RAW
    return request


class _Reader:
    """Of a stream: its first message, and all of it later."""

    def __init__(self, stream):
        self._stream, self._digest = stream, hashlib.sha256()
        self.failure = None
        self.has_begun = False

    def _take(self, message):
        if not message.HasField("summary"):  # It says how long the call took.
            self._digest.update(message.SerializeToString(deterministic=True))

    def read_one(self):
        try:
            self._take(next(self._stream))
            self.has_begun = True
        except grpc.RpcError as error:
            self.failure = f"{error.code()}: {error.details()}"

    def read_all(self):
        try:
            for message in self._stream:
                self._take(message)
        except grpc.RpcError as error:
            self.failure = f"{error.code()}: {error.details()}"

    def digest(self):
        return self._digest.hexdigest()


def _at_once(functions):
    threads = [threading.Thread(target=function) for function in functions]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def _seconds(stream):
    begin = time.perf_counter()
    for _ in stream:
        pass
    return time.perf_counter() - begin


def _measure(job, name, memory):
    ccslice = python_client(job.folder)
    options = ["--threads", "2", "--max-concurrent-calls", str(_CALLS + 56), "--admission-wait", "10m",
               "--idle-timeout", "30m", *memory]
    with Server(job.ccsliced(), job.folder, *options) as server:
        address = server.address()
        with ccslice.Client(address) as client:
            jobs = Jobs(client.upload(sample(job.build, job.folder, "ring")))
        active = Stub(address, 40)
        stubs = [Stub(address) for _ in range(_CONNECTIONS)]

        def active_s():
            return min(_seconds(active.calls.SliceRange(jobs.request(_ACTIVE_COLUMNS))) for _ in range(3))

        alone_s = active_s()
        right = _Reader(stubs[0].calls.SliceRange(_raw(jobs.request(_COLUMNS, 100, _LAYERS))))
        right.read_all()
        time.sleep(3)  # Until memory has left the process.
        before_mb = resident_mb(server.pid())
        with Peak(lambda: resident_mb(server.pid())) as peak:
            readers = [_Reader(stubs[k % _CONNECTIONS].calls.SliceRange(_raw(jobs.request(_COLUMNS, 100, _LAYERS))))
                       for k in range(_CALLS)]
            begin = time.perf_counter()
            threads = [threading.Thread(target=reader.read_one) for reader in readers]
            for thread in threads:
                thread.start()
            time.sleep(2)
            small_s = [_seconds(active.calls.SliceRange(jobs.request(_COLUMNS, 7 * k, 1))) for k in range(10)]
            for thread in threads:
                thread.join()
            begun_s = time.perf_counter() - begin
            time.sleep(4)  # Until the last of them have shed.
            held_mb = resident_mb(server.pid())
        beside_s = active_s()
        begin = time.perf_counter()
        _at_once([reader.read_all for reader in readers])
        read_s = time.perf_counter() - begin
        rest_s = seconds_until(lambda: resident_mb(server.pid()) < before_mb + 100, 10)
        for stub in [active, *stubs]:
            stub.close()
    for failure in sorted({reader.failure for reader in readers if reader.failure}):
        print("  " + failure)
    wrong = sum(reader.digest() != right.digest() for reader in readers)
    failed = sum(bool(reader.failure) for reader in readers)
    bar_mb = 300 * _MB_OF_MIB
    return [Figure(f"{name}calls that read one message: until all have it", begun_s, "s"),
            Figure(f"{name}small ranges of another client meanwhile: the longest", max(small_s), "s", at_most=1),
            Figure(f"{name}memory above that before them, at its peak", peak.value - before_mb, "MB", at_most=bar_mb),
            Figure(f"{name}memory above that before them, while they stall", held_mb - before_mb, "MB", at_most=bar_mb),
            Figure(f"{name}another client's job, of its time alone", beside_s / alone_s, "times", at_most=1.2),
            Figure(f"{name}calls that were refused, or failed", failed, "", at_most=0),
            Figure(f"{name}when they read on: calls with other bytes", wrong, "", at_most=0),
            Figure(f"{name}when they read on: until all have ended", read_s, "s"),
            Figure(f"{name}until the memory is back within 100 MB of that before them", rest_s, "s", at_most=10)]


def measure(job):
    return (_measure(job, "", ["--stream-window-bytes", "4MiB", "--stream-budget-bytes", "1GiB",
                               "--scratch-budget-bytes", "512MiB"]) +
            _measure(job, "512 MiB: ", ["--memory", "512MiB"]))
