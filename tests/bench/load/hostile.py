# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Clients that mean harm: requests that never arrive in whole, small ones that grow when parsed, streams that are reset
at once (CVE-2023-44487), the last also through HAProxy (deploy/proxies/haproxy.cfg) where it is installed, and what
small_bytes.py has. And several at the same time, to a server in 2 GiB: uploads of a byte now and then, requests that
never arrive in whole, those that grow, and layers of hundreds of boxes that overlap, in tens of thousands of rows."""

import collections
import multiprocessing
import os
import pathlib
import re
import shutil
import subprocess
import threading
import time

import grpc

from ccsliced_process import Server
from free_port import free_port
from load import small_bytes
from load.http2 import Connection, headers_frame, request_headers, reset_frame
from load.fair import MOST_SLOWDOWN, overlapping_boxes, small_range_s
from load.part import Figure, MemoryLimit, Peak, resident_mb, seconds_until
from served_clients import Jobs, Stub, python_client, sample

_MB4 = 4 << 20
_LIMIT_BYTES = 2 << 30
_IDLE_S = 5
_WARM_UP_S = 4
_ROOT = pathlib.Path(__file__).resolve().parents[3]


def _message(size):
    return b"\0" + size.to_bytes(4, "big")


def _half_sent(job, beside_previews=False):
    """400 requests of 4 MB on 40 connections, all but their last byte. gRPC's quota is a goal: some MB more get in.
    `beside_previews`: on each connection a silent call is open, so that it isn't dropped for its requests' time."""
    name = "half-sent requests" + (" beside previews" if beside_previews else "")
    with Server(job.ccsliced(), job.folder, "--idle-timeout", f"{_IDLE_S}s", "--connection-budget-bytes",
                "64MiB") as server:
        address = server.address()
        before_mb = resident_mb(server.pid())
        connections = [Connection(address) for _ in range(40)]
        if beside_previews:
            for connection in connections:
                connection.open_stream("Preview")
        body = _message(_MB4 - 64) + bytes(_MB4 - 65)

        sent = []

        def send(connection):
            streams = [connection.open_stream("GetMesh") for _ in range(10)]
            for stream in streams:
                sent.append(connection.send_data(stream, body, 0.5))

        with Peak(lambda: resident_mb(server.pid())) as peak:
            threads = [threading.Thread(target=send, args=[each]) for each in connections]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()

            def all_dropped():
                for connection in connections:
                    connection.receive(0.01)
                return all(connection.closed for connection in connections)

            dropped_s = None if beside_previews else seconds_until(all_dropped, 60)
        served = Connection(address).is_answered("GetServerInfo", 5)
    figures = [Figure(f"{name}: sent", sum(sent) / 1e6, "MB"),
               Figure(f"{name}: memory, at its peak", peak.value - before_mb, "MB", at_most=256),
               Figure(f"{name}: others are served", int(served), "", at_least=1)]
    if not beside_previews:
        figures.append(Figure(f"{name}: dropped, after the last byte that was taken", dropped_s, "s",
                              at_most=_IDLE_S + 5))
    return figures


# A SliceRangeRequest whose job is of empty planes, just below what a request may have (kMaxJobRequestBytes). The length
# of the job takes 3 bytes, 7 bits each.
_PLANES = b"\x2a\x00" * (((2 << 20) - 4096) // 2)
_GROWING = b"\x0a" + bytes([len(_PLANES) & 127 | 128, len(_PLANES) >> 7 & 127 | 128, len(_PLANES) >> 14]) + _PLANES


def _amplified(job):
    """32 requests of 2 MB of empty sub-messages, at the same time."""
    with Server(job.ccsliced(), job.folder) as server:
        before_mb = resident_mb(server.pid())
        channels = [grpc.insecure_channel(server.address(), options=[("grpc.use_local_subchannel_pool", 1)])
                    for _ in range(4)]
        refused = []

        def call(channel):
            try:
                list(channel.unary_stream("/ccslice.v1.SlicerService/SliceRange")(_GROWING))
            except grpc.RpcError as error:
                refused.append("unpacked" in error.details())

        with Peak(lambda: resident_mb(server.pid())) as peak:
            threads = [threading.Thread(target=call, args=[channels[i % 4]]) for i in range(32)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
        for channel in channels:
            channel.close()
    return [Figure("requests that grow: refused for that", sum(refused), "of 32", at_least=32),
            Figure("requests that grow: memory, at its peak", peak.value - before_mb, "MB", at_most=256)]


def _reset_streams(address, end, count):
    block = request_headers("GetServerInfo")
    connection = None
    while time.monotonic() < end:
        try:
            connection = connection if connection and not connection.closed else Connection(address)
        except OSError:  # Refused for now.
            time.sleep(0.01)
            continue
        streams = [connection.next_stream() for _ in range(500)]
        connection.send(b"".join(headers_frame(stream, block) + reset_frame(stream) for stream in streams))
        count.append(len(streams))
        while connection.receive(0.0001):
            pass


def _call_meanwhile(address, end):
    """Calls of a client at another address, one after the other: the longest one's seconds, and how many failed."""
    longest_s, failed = 0, 0
    while time.monotonic() < end:
        begin = time.monotonic()
        try:
            failed += not Connection(address, "127.0.0.2").is_answered("GetServerInfo", 30)
        except OSError:
            failed += 1
        longest_s = max(longest_s, time.monotonic() - begin)
        time.sleep(0.05)
    return longest_s, failed


def _resets(job, address, pid, name, longest_s=None, failed=None, memory_mb=None):
    """The figures, with these bars."""
    before_mb, count, end = resident_mb(pid), [], time.monotonic() + job.seconds
    with Peak(lambda: resident_mb(pid)) as peak:
        threads = [threading.Thread(target=_reset_streams, args=[address, end, count]) for _ in range(2)]
        for thread in threads:
            thread.start()
        measured_s, measured_failed = _call_meanwhile(address, end)
        for thread in threads:
            thread.join()
    return [Figure(f"{name}: streams reset on two connections", sum(count), ""),
            Figure(f"{name}: the longest call of another client", measured_s, "s", at_most=longest_s),
            Figure(f"{name}: its calls that failed", measured_failed, "", at_most=failed),
            Figure(f"{name}: memory, at its peak", peak.value - before_mb, "MB", at_most=memory_mb)]


def _is_served(address):
    try:
        return Connection(address).is_answered("GetServerInfo", 1)
    except OSError:
        return False


def _resets_through_haproxy(job):
    program = shutil.which("haproxy", path="/usr/sbin:/usr/bin")
    if not program:
        print("no haproxy here: resets aren't tried through it")
        return []
    with Server(job.ccsliced(), job.folder) as server:
        port = free_port()
        text = (_ROOT / "deploy/proxies/haproxy.cfg").read_text()
        text = re.sub(r"bind \S+", f"bind 127.0.0.1:{port}", text)
        text = re.sub("server one .*", f"server one {server.address()} no-check", text)
        (job.folder / "haproxy.cfg").write_text(text)
        proxy = subprocess.Popen([program, "-q", "-f", job.folder / "haproxy.cfg"])
        try:
            address = f"127.0.0.1:{port}"
            if seconds_until(lambda: _is_served(address), 10) >= 10:
                raise RuntimeError("HAProxy doesn't serve")
            return _resets(job, address, server.pid(), "resets through HAProxy", longest_s=1, failed=0, memory_mb=64)
        finally:
            proxy.terminate()
            proxy.wait()


class _Attacks:
    """All of them, again and again, until `over` is set."""

    def __init__(self, address, mesh_id, over):
        self._address, self._mesh_id, self._over = address, mesh_id, over
        self.ends = collections.Counter()

    def run(self):
        attacks = [(self._upload_slowly, 40), (self._send_half, 8), (self._send_growing, 8), (self._cross_rows, 8)]
        stubs = [Stub(self._address, 50 + k) for k in range(len(attacks))]
        threads = [threading.Thread(target=self._repeat, args=[attack, stub.calls])
                   for (attack, count), stub in zip(attacks, stubs) for _ in range(count)]
        for thread in threads:
            thread.start()
        self._over.wait()
        for stub in stubs:
            stub.close()
        for thread in threads:
            thread.join()

    def _repeat(self, attack, calls):
        while not self._over.is_set():
            try:
                attack(calls)
            except (grpc.RpcError, ValueError) as error:  # ValueError: the channel is closed.
                if not self._over.is_set():
                    words = error.details() if isinstance(error, grpc.RpcError) else str(error)
                    self.ends[f"{attack.__name__[1:]}: {re.sub('[0-9]+', 'N', words)}"] += 1
                    self._over.wait(0.1)

    def _upload_slowly(self, calls):
        from ccslice.v1 import mesh_pb2

        def messages():
            message = mesh_pb2.UploadMeshRequest()
            message.start.mesh_id = "sha256:" + 64 * "a"
            message.start.size_bytes = 1 << 20
            yield message
            while not self._over.wait(3):
                yield mesh_pb2.UploadMeshRequest(chunk=b"x")

        calls.UploadMesh(messages())

    def _send_half(self, _):
        try:
            connection = Connection(self._address, "127.0.0.3")
        except OSError:
            self._over.wait(0.1)
            return
        body = _message(_MB4 - 64) + bytes(_MB4 - 65)
        for _ in range(10):
            connection.send_data(connection.open_stream("GetMesh"), body, 0.1)
        end = time.monotonic() + _IDLE_S
        while not connection.closed and not self._over.is_set() and time.monotonic() < end:
            connection.receive(0.1)
        connection.close()

    def _send_growing(self, _):
        with grpc.insecure_channel(self._address, options=[("grpc.use_local_subchannel_pool", 1)]) as channel:
            list(channel.unary_stream("/ccslice.v1.SlicerService/SliceRange")(_GROWING))

    def _cross_rows(self, calls):
        from ccslice.v1 import job_pb2, slice_pb2
        request = slice_pb2.SliceRangeRequest(first_layer=0, layer_count=8)
        request.job.parts.add(mesh_id=self._mesh_id)
        request.job.tolerances.contour_mm = 0.2
        pitch = request.job.grid.pitch
        pitch.x_mm, pitch.y_mm, pitch.z_mm = 13 / 8, 13 / 65536, 13 / 10
        request.job.planes.add(encoding=job_pb2.PLANE_ENCODING_RAW_ZSTD).occupancy.SetInParent()
        for _ in calls.SliceRange(request):
            self.ends["cross_rows: messages"] += 1


def _attack(folder, address, mesh_id, over, ends):
    """In a process of its own, which leaves the processors to the others."""
    os.nice(19)
    python_client(folder)
    attacks = _Attacks(address, mesh_id, over)
    attacks.run()
    ends.put(attacks.ends)


def _all_in_2gib(job):
    ccslice = python_client(job.folder)
    with MemoryLimit(_LIMIT_BYTES) as limit, Server(job.ccsliced(), job.folder, "--threads", "2",
                                                    within=limit.within) as server:
        address = server.address()
        with ccslice.Client(address) as client:
            jobs = Jobs(client.upload(sample(job.build, job.folder, "ring")))
            boxes_id = client.upload(overlapping_boxes(ccslice, 200)).mesh_id
        idle_s = small_range_s(address, jobs, job.seconds)
        processes = multiprocessing.get_context("spawn")
        over, ends, refused = processes.Event(), processes.Queue(), []
        attacker = processes.Process(target=_attack, args=(job.folder, address, boxes_id, over, ends))
        with Peak(lambda: resident_mb(server.pid())) as peak:
            attacker.start()
            time.sleep(_WARM_UP_S)
            beside_s = small_range_s(address, jobs, job.seconds, refused)
            over.set()
            counts = ends.get()
            attacker.join()
        alive = server.runs()
    for what, count in sorted(counts.items()):
        print(f"  {count} times {what}")
    for words in sorted(set(refused)):
        print("  others: " + words)
    return [Figure("all in 2 GiB: small ranges meanwhile, of the idle server's", beside_s / idle_s, "times",
                   at_most=MOST_SLOWDOWN),
            Figure("all in 2 GiB: calls of others that failed meanwhile", len(refused), "", at_most=0),
            Figure("all in 2 GiB: memory, at its peak", peak.value, "MB", at_most=_LIMIT_BYTES / 1e6),
            Figure("all in 2 GiB: the server lives", int(alive), "", at_least=1)]


def measure(job):
    figures = _all_in_2gib(job) + _half_sent(job) + _half_sent(job, True) + _amplified(job)
    with Server(job.ccsliced(), job.folder) as server:
        figures += _resets(job, server.address(), server.pid(), "resets")
    return figures + _resets_through_haproxy(job) + small_bytes.measure(job)
