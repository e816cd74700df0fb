# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Single layers of the ring, 512 x 512, asked for one after the other: of an idle server, and beside others, each with
an address of its own: 8 that slice whole jobs, 8 with layers of 8192 x 8192, 3 that probe points where 5,000 boxes
overlap. And what one client with one job gets of the layers beside another client with 24 of the same kind."""

import contextlib
import threading
import time

import grpc
import numpy as np

from ccsliced_process import Server
from load.part import Figure
from served_clients import Jobs, Stub, percentile, python_client, sample

_THREADS = 2
_WARM_UP_S = 2
MOST_SLOWDOWN = 5
_LEAST_SHARE = 0.4


def _ends_layer(message):
    return message.DESCRIPTOR.name == "SliceRangeResponse" and message.HasField("layer_end")


class _Load(contextlib.AbstractContextManager):
    """One client for each entry of `clients`, who makes as many calls at the same time, again and again. Those that the
    server has no memory for are made again, too."""

    def __init__(self, address, first_number, clients, call):
        self.layers = [0] * len(clients)
        self.refused = 0
        self._over = False
        self._stubs = [Stub(address, first_number + k) for k in range(len(clients))]
        self._threads = [threading.Thread(target=self._run, args=(client, call))
                         for client, calls in enumerate(clients) for _ in range(calls)]
        for thread in self._threads:
            thread.start()

    def _run(self, client, call):
        while not self._over:
            stream = call(self._stubs[client].calls)
            try:
                for message in stream:
                    self.layers[client] += _ends_layer(message)
                    if self._over:
                        stream.cancel()
            except grpc.RpcError as error:
                if self._over:
                    return
                if error.code() != grpc.StatusCode.UNAVAILABLE:
                    raise
                self.refused += 1
                time.sleep(0.1)

    def __exit__(self, *_):
        self._over = True
        for stub in self._stubs:
            stub.close()
        for thread in self._threads:
            thread.join()


def overlapping_boxes(ccslice, count=5000):
    """Boxes of about 10 mm that all hold the points near the middle."""
    shifts = np.random.default_rng(1).uniform(-1, 1, (count, 1, 3))
    box = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
    return ccslice.Mesh((10.0 * box + shifts).reshape(-1, 3), np.arange(8 * count).reshape(count, 8))


def _hard_points(mesh_id):
    from ccslice.v1 import points_pb2
    points_mm = np.random.default_rng(2).uniform(2, 8, 3 * 4096).tolist()
    return lambda calls: calls.ProbePoints(iter([points_pb2.ProbePointsRequest(mesh_id=mesh_id, points_mm=points_mm)]))


def small_range_s(address, jobs, seconds, refused=None):
    """The 95th percentile of what calls take. Those that fail are added to `refused`, if that is given, and made
    again."""
    stub, times, end = Stub(address, 1), [], time.monotonic() + seconds
    while time.monotonic() < end:
        begin = time.perf_counter()
        try:
            for _ in stub.calls.SliceRange(jobs.request(512, 7 * len(times) % jobs.layers, 1)):
                pass
            times.append(time.perf_counter() - begin)
        except grpc.RpcError as error:
            if refused is None:
                raise
            refused.append(error.details())
        time.sleep(0.01)
    stub.close()
    return percentile(times, 0.95)


def measure(job):
    ccslice = python_client(job.folder)
    memory = ["--stream-window-bytes", "72MiB", "--stream-budget-bytes", "2GiB"]  # Enough for large layers of all.
    with Server(job.ccsliced(), job.folder, "--threads", str(_THREADS), *memory) as server:
        address = server.address()
        with ccslice.Client(address) as client:
            jobs = Jobs(client.upload(sample(job.build, job.folder, "ring")))
            boxes_id = client.upload(overlapping_boxes(ccslice)).mesh_id
        idle_s = small_range_s(address, jobs, job.seconds)
        figures = [Figure("small ranges of an idle server, 95th percentile", idle_s, "s")]
        for what, clients, call in [
                ("8 whole jobs", 8, lambda calls: calls.SliceRange(jobs.request(2000))),
                ("8 clients of 8192 x 8192", 8, lambda calls: calls.SliceRange(jobs.request(8192))),
                ("3 calls of hard points", 3, _hard_points(boxes_id))]:
            with _Load(address, 10, [1] * clients, call) as load:
                time.sleep(_WARM_UP_S)
                beside_s = small_range_s(address, jobs, job.seconds)
            figures.append(Figure(f"small ranges beside {what}, of the idle server's", beside_s / idle_s, "times",
                                  at_most=MOST_SLOWDOWN))
            figures.append(Figure(f"calls of {what} that waited for memory in vain", load.refused, ""))
        with _Load(address, 30, [1, 24], lambda calls: calls.SliceRange(jobs.request(2400))) as load:
            time.sleep(_WARM_UP_S)
            before = list(load.layers)
            time.sleep(job.seconds)
            one, many = (now - earlier for now, earlier in zip(load.layers, before))
        return figures + [Figure("layers of one job, of all beside another client's 24", one / max(1, one + many), "",
                                 at_least=_LEAST_SHARE)]
