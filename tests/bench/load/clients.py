# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""64 clients with 32 places: half of them ask for single layers of the ring, 512 x 512, with pauses, the others for
whole jobs of different sizes. What they get, and what the server keeps of memory meanwhile and afterwards.

A voxel of a single layer costs many times as much as one of a whole job. So throughput is counted in seconds: how long
the server takes for the same ranges and voxels where it serves one client with nothing but single layers, as many at a
time as there are threads, or with nothing but a whole job. Each of these two takes a minute at most, as rates are
compared.
"""

import random
import statistics
import threading
import time

import grpc

from ccsliced_process import Server
from load.part import Figure, resident_mb
from served_clients import Jobs, Stub, percentile, python_client, sample

_THREADS = 2
_CLIENTS = 64
_ADDRESSES = 8
_COLUMNS = (700, 1000, 1400, 2000)  # Of whole jobs.
_LONGEST_ALONE_S = 60
_LONGEST_REST_S = 60


class _Clients:
    """What they do for some seconds, and what they saw."""

    def __init__(self, address, jobs, seconds):
        self.small_range_s, self.failures, self.voxels = [], [], 0
        self._address, self._jobs = address, jobs
        self.seconds = seconds
        self._lock = threading.Lock()
        self._open = set()  # Streams.
        self._over = threading.Event()

    def run(self, kinds, rest=True):
        """One client for each of `kinds`; `rest`: they pause between small ranges."""
        self._rest = rest
        stubs = [Stub(self._address, 40 + k) for k in range(min(_ADDRESSES, len(kinds)))]
        threads = [threading.Thread(target=self._call, args=(stubs[k % len(stubs)], kind, random.Random(k)))
                   for k, kind in enumerate(kinds)]
        for thread in threads:
            thread.start()
        time.sleep(self.seconds)
        self._stop()
        for thread in threads:
            thread.join()
        for stub in stubs:
            stub.close()

    def _stop(self):
        """Ends what is open, whatever it waits for."""
        with self._lock:
            self._over.set()
            for stream in self._open:
                stream.cancel()

    def _call(self, stub, kind, chance):
        while not self._over.is_set():
            try:
                getattr(self, "_" + kind)(stub.calls, chance)
            except grpc.RpcError as error:
                if error.code() != grpc.StatusCode.CANCELLED or not self._over.is_set():
                    self.failures.append(f"{error.code()}: {error.details()}")

    def _layers(self, stream):
        """As they come, until all is over."""
        with self._lock:
            if self._over.is_set():
                return stream.cancel()
            self._open.add(stream)
        try:
            for message in stream:
                if message.HasField("layer_end") and not self._over.is_set():
                    yield message
        finally:
            with self._lock:
                self._open.discard(stream)

    def _small_range(self, calls, chance):
        begin = time.perf_counter()
        if list(self._layers(calls.SliceRange(self._jobs.request(512, chance.randrange(self._jobs.layers), 1)))):
            self.small_range_s.append(time.perf_counter() - begin)
        if self._rest:
            self._over.wait(chance.uniform(0.5, 1.5))

    def alone_s(self, small_ranges, whole_job):
        """Seconds that the work done takes where each kind of it is done alone."""
        return (small_ranges.seconds * len(self.small_range_s) / len(small_ranges.small_range_s) +
                whole_job.seconds * self.voxels / whole_job.voxels)

    def _whole_job(self, calls, chance):
        columns = chance.choice(_COLUMNS)
        for _ in self._layers(calls.SliceRange(self._jobs.request(columns))):
            with self._lock:
                self.voxels += columns * columns


class _Memory(threading.Thread):
    """Of a process, ten times a second."""

    def __init__(self, pid):
        super().__init__()
        self._pid, self._seen_mb, self._over = pid, [], threading.Event()
        self.start()

    def run(self):
        while not self._over.wait(0.1):
            self._seen_mb.append(resident_mb(self._pid))

    def fifths_mb(self):
        """The medians of fifths of the time."""
        self._over.set()
        self.join()
        length = max(1, len(self._seen_mb) // 5)
        return [statistics.median(self._seen_mb[k * length:(k + 1) * length]) for k in range(5)]


def measure(job):
    ccslice = python_client(job.folder)
    options = ["--threads", str(_THREADS), "--max-concurrent-calls", str(_CLIENTS // 2),
               "--max-waiting-calls", str(_CLIENTS), "--admission-wait", "60s",
               "--stream-window-bytes", "32MiB", "--stream-budget-bytes", "2GiB"]
    with Server(job.ccsliced(), job.folder, *options) as server:
        address = server.address()
        with ccslice.Client(address) as client:
            summary = client.upload(sample(job.build, job.folder, "ring"))
        jobs = Jobs(summary)
        small_ranges, whole_job = (_Clients(address, jobs, min(_LONGEST_ALONE_S, job.seconds)) for _ in range(2))
        small_ranges.run(["small_range"] * _THREADS, rest=False)
        whole_job.run(["whole_job"])
        start_mb = resident_mb(server.pid())
        memory = _Memory(server.pid())
        many = _Clients(address, jobs, job.seconds)
        many.run([("small_range", "whole_job")[k // _ADDRESSES % 2] for k in range(_CLIENTS)])
        fifths_mb = memory.fifths_mb()
        time.sleep(min(_LONGEST_REST_S, job.seconds))
        rest_mb = resident_mb(server.pid())
    failures = small_ranges.failures + whole_job.failures + many.failures
    for failure in sorted(set(failures)):
        print("  " + failure)
    median_s = statistics.median(many.small_range_s)
    p99_s = percentile(many.small_range_s, 0.99)
    return [Figure("failed calls of all clients", len(failures), "", at_most=0),
            Figure("small ranges, median", median_s, "s"),
            Figure("small ranges, 99th percentile", p99_s / median_s, "medians", at_most=6),
            Figure("small ranges done", len(many.small_range_s), ""),
            Figure("voxels of whole jobs a second, of those of one client",
                   many.voxels / many.seconds / (whole_job.voxels / whole_job.seconds), "times"),
            Figure("throughput, of that of one client", many.alone_s(small_ranges, whole_job) / job.seconds, "times",
                   at_least=0.85),
            Figure("memory at the start", start_mb, "MB"),
            Figure("memory in the last fifth, of the second's", fifths_mb[4] / fifths_mb[1], "times", at_most=1.05),
            Figure("memory after a rest, of that at the start", rest_mb / start_mb, "times", at_most=1.1)]
