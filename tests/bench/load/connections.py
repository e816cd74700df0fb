# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""5,000 connections from one address to a server with 1,024 file descriptors, which then all leave."""

import resource
import subprocess

from ccsliced_process import Server
from load.http2 import Connection
from load.part import Figure, seconds_until

_CONNECTIONS = 5000
_OPEN_FILES = 1024


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
            Figure("the health check passes", int(healthy), "", at_least=1)]
