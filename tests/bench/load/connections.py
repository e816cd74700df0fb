# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""5,000 connections from one address to a server with 1,024 file descriptors, which then all leave; and 350 a second from
one address, to a server of 512 MiB, which has to take them one by one."""

import contextlib
import resource
import socket
import subprocess
import threading
import time

from ccsliced_process import Server
from load.http2 import Connection
from load.part import Figure, seconds_until

_CONNECTIONS = 5000
_OPEN_FILES = 1024
_A_SECOND, _MOST_OPEN = 350, 3000


def _is_served(address, source):
    try:
        connection = Connection(address, source)
    except OSError:
        return False
    try:
        return connection.is_answered("GetServerInfo", 5)
    finally:
        connection.close()


def _flood(address):
    connections = []
    for _ in range(_CONNECTIONS):
        try:
            connections.append(Connection(address, "127.0.0.1"))
        except OSError:  # Refused before it was open.
            continue
    return connections


def _connect(address, over):
    """At a steady pace, and says nothing."""
    host, port = address.rsplit(":", 1)
    connections, begin = [], time.monotonic()
    for count in range(1, 1_000_000):
        with contextlib.suppress(OSError):
            connections.append(socket.create_connection((host, int(port)), 5, source_address=("127.0.0.9", 0)))
        if len(connections) > _MOST_OPEN:
            connections.pop(0).close()
        if over.wait(max(0, begin + count / _A_SECOND - time.monotonic())):
            break
    for connection in connections:
        connection.close()


def _steady(job):
    with Server(job.ccsliced(), job.folder, "--memory", "512MiB") as server:
        over, longest_s, failed = threading.Event(), 0, 0
        thread = threading.Thread(target=_connect, args=(server.address(), over))
        thread.start()
        time.sleep(4)
        end = time.monotonic() + job.seconds
        while time.monotonic() < end:
            begin = time.monotonic()
            failed += not _is_served(server.address(), "127.0.0.2")
            longest_s = max(longest_s, time.monotonic() - begin)
            time.sleep(0.1)
        over.set()
        thread.join()
    return [Figure(f"{_A_SECOND} connections a second: the longest call of another address", longest_s, "s", at_most=1),
            Figure(f"{_A_SECOND} connections a second: its calls that failed", failed, "", at_most=0)]


def measure(job):
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    with Server(job.ccsliced(), job.folder, open_files=_OPEN_FILES) as server:
        address = server.address()
        connections = _flood(address)
        other_s = seconds_until(lambda: _is_served(address, "127.0.0.2"), 30)
        for connection in connections:
            connection.close()
        again_s = seconds_until(lambda: _is_served(address, "127.0.0.1"), 30)
        healthy = subprocess.run([job.ccsliced(), "--health-check", address], stdout=subprocess.DEVNULL).returncode == 0
    return [Figure("connections made", len(connections), ""),
            Figure("another address is served meanwhile, after", other_s, "s", at_most=1),
            Figure("the same address is served again, after they left", again_s, "s", at_most=1),
            Figure("the health check passes", int(healthy), "", at_least=1), *_steady(job)]
