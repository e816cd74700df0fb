# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Clients that mean harm: requests that never arrive in whole, small ones that grow when parsed, streams that are reset
at once (CVE-2023-44487), the last also through HAProxy (deploy/proxies/haproxy.cfg) where it is installed."""

import pathlib
import re
import shutil
import subprocess
import threading
import time

import grpc

from ccsliced_process import Server
from free_port import free_port
from load.http2 import Connection, headers_frame, request_headers, reset_frame
from load.part import Figure, Peak, resident_mb, seconds_until

_MB4 = 4 << 20
_IDLE_S = 5
_ROOT = pathlib.Path(__file__).resolve().parents[3]


def _message(size):
    return b"\0" + size.to_bytes(4, "big")


def _half_sent(job):
    """400 requests of 4 MB on 40 connections, all but their last byte. gRPC's quota is a goal: some MB more get in."""
    with Server(job.ccsliced(), job.folder, "--idle-timeout", f"{_IDLE_S}s", "--connection-budget-bytes",
                "64MiB") as server:
        address = server.address()
        before_mb = resident_mb(server.pid())
        connections = [Connection(address) for _ in range(40)]
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

            dropped_s = seconds_until(all_dropped, 60)
        served = Connection(address).is_answered("GetServerInfo", 5)
    return [Figure("half-sent requests: sent", sum(sent) / 1e6, "MB"),
            Figure("half-sent requests: memory, at its peak", peak.value - before_mb, "MB", at_most=256),
            Figure("half-sent requests: dropped, after the last byte that was taken", dropped_s, "s",
                   at_most=_IDLE_S + 5),
            Figure("half-sent requests: others are served", int(served), "", at_least=1)]


def _amplified(job):
    """32 requests of 4 MB of empty sub-messages, at the same time."""
    with Server(job.ccsliced(), job.folder) as server:
        before_mb = resident_mb(server.pid())
        request = b"\x32\x00" * ((_MB4 - 4096) // 2)  # SliceRangeRequest.planes
        channels = [grpc.insecure_channel(server.address(), options=[("grpc.use_local_subchannel_pool", 1)])
                    for _ in range(4)]
        refused = []

        def call(channel):
            try:
                list(channel.unary_stream("/ccslice.v1.SlicerService/SliceRange")(request))
            except grpc.RpcError as error:
                refused.append(error.code())

        with Peak(lambda: resident_mb(server.pid())) as peak:
            threads = [threading.Thread(target=call, args=[channels[i % 4]]) for i in range(32)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
        for channel in channels:
            channel.close()
    return [Figure("requests that grow: refused", len(refused), "of 32", at_least=32),
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


def measure(job):
    figures = _half_sent(job) + _amplified(job)
    with Server(job.ccsliced(), job.folder) as server:
        figures += _resets(job, server.address(), server.pid(), "resets")
    return figures + _resets_through_haproxy(job)
