# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Few bytes that cost a server much: compressed messages, calls that are begun and ask for nothing, messages of ten
bytes each."""

import threading
import time
import zlib

from ccsliced_process import Server
from load.http2 import Connection, data_frame, headers_frame, request_headers
from load.part import Figure, Peak, resident_mb
from served_clients import python_client

_INFLATED_MB = 1024
_MEMORY_MIB = 512
_CONNECTIONS, _STREAMS = 500, 100
_UPLOADS = 20


def _message(payload, compressed=False):
    return bytes([compressed]) + len(payload).to_bytes(4, "big") + payload


def _gzip_of_zeros():
    """As many MB as it says; made piece by piece."""
    packer = zlib.compressobj(9, zlib.DEFLATED, 31)
    return b"".join(packer.compress(bytes(1 << 20)) for _ in range(_INFLATED_MB)) + packer.flush()


def _compressed(job):
    packed = _gzip_of_zeros()
    with Server(job.ccsliced(), job.folder) as server:
        Connection(server.address()).is_answered("GetServerInfo", 10)  # It has begun when it answers.
        before_mb = resident_mb(server.pid())
        with Peak(lambda: resident_mb(server.pid())) as peak:
            connection = Connection(server.address())
            stream = connection.open_stream("GetServerInfo", [("grpc-encoding", "gzip")])
            connection.send_data(stream, _message(packed, compressed=True), 1)
            connection.send(data_frame(stream, b"", last=True))
            connection.receive(5)
            served = Connection(server.address(), "127.0.0.2").is_answered("GetServerInfo", 5)
    return [Figure(f"compressed, {_INFLATED_MB} MB in {len(packed) / 1e6:.1f}: memory, at its peak",
                   peak.value - before_mb, "MB", at_most=64),
            Figure("compressed: others are served", int(served), "", at_least=1)]


def _headers_alone(job):
    """Calls that are begun by the ten thousand, and send no request."""
    with Server(job.ccsliced(), job.folder, "--memory", f"{_MEMORY_MIB}MiB") as server:
        block = request_headers("GetMesh")
        with Peak(lambda: resident_mb(server.pid())) as peak:
            connections = []
            for _ in range(_CONNECTIONS):
                connection = Connection(server.address())
                connection.receive(0.01)
                connection.send(b"".join(headers_frame(connection.next_stream(), block) for _ in range(_STREAMS)))
                connections.append(connection)
            served = Connection(server.address(), "127.0.0.2").is_answered("GetServerInfo", 15)
            for connection in connections:
                connection.close()
    return [Figure(f"{_CONNECTIONS * _STREAMS} calls of headers alone: memory, at its peak", peak.value, "MB",
                   at_most=_MEMORY_MIB * 1.048576),
            Figure("calls of headers alone: others are served", int(served), "", at_least=1)]


def _upload_in_tiny_chunks(address, over):
    from ccslice.v1 import mesh_pb2
    start = mesh_pb2.UploadMeshRequest()
    start.start.mesh_id, start.start.size_bytes = "sha256:" + 64 * "a", 8 << 20
    tiny = _message(mesh_pb2.UploadMeshRequest(chunk=b"x").SerializeToString()) * 4000
    while not over.is_set():
        try:
            connection = Connection(address)
            stream = connection.open_stream("UploadMesh")
            connection.send_data(stream, _message(start.SerializeToString()), 1)
            while not over.is_set() and connection.send_data(stream, tiny, 0.5) > 0:
                pass
            connection.close()
        except OSError:
            over.wait(0.1)


def _tiny_messages(job):
    python_client(job.folder)
    with Server(job.ccsliced(), job.folder, "--threads", "2") as server:
        over, longest_s, failed = threading.Event(), 0, 0
        threads = [threading.Thread(target=_upload_in_tiny_chunks, args=(server.address(), over))
                   for _ in range(_UPLOADS)]
        for thread in threads:
            thread.start()
        end = time.monotonic() + job.seconds
        while time.monotonic() < end:
            begin = time.monotonic()
            connection = Connection(server.address(), "127.0.0.2")
            failed += not connection.is_answered("GetServerInfo", 20)
            connection.close()
            longest_s = max(longest_s, time.monotonic() - begin)
        over.set()
        for thread in threads:
            thread.join()
    return [Figure(f"{_UPLOADS} uploads of ten-byte messages: the longest call of another client", longest_s, "s",
                   at_most=1),
            Figure("uploads of ten-byte messages: its calls that failed", failed, "", at_most=0)]


def measure(job):
    return _compressed(job) + _headers_alone(job) + _tiny_messages(job)
