# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Few bytes of headers that become many, and calls that are begun faster than they end, to a server of 1 GiB, without
and with TLS: what it takes, and how a client of another address gets on meanwhile and a second after."""

import contextlib
import multiprocessing
import os
import pathlib
import subprocess
import time

from ccsliced_process import Server
from load.fair import MOST_SLOWDOWN, small_range_s
from load.http2 import (Connection, continuation_frame, headers_frame, literal, request_headers, reset_frame)
from load.part import Figure
from served_clients import Jobs, python_client, sample

_MEMORY_MIB = 1024
MOST_MB = 1.1 * _MEMORY_MIB * 1.048576
_ATTACKERS = 4
_LONG = 3900
_FRAME = 16000
_HELD_CONNECTIONS, _HELD_STREAMS = 500, 128


def peak_mb(pid):
    status = pathlib.Path(f"/proc/{pid}/status").read_text()
    return int(status.split("VmHWM:")[1].split()[0]) * 1024 / 1e6


def _newest(count):
    """So many headers: the one that the dynamic table got last."""
    return b"\xbe" * count


def _endless(connection, kept):
    """One list of headers that never ends, each a byte."""
    connection.send(headers_frame(1, request_headers("GetServerInfo") + literal(*kept, kept=True), ends=False))
    count = _FRAME // (len(kept[0]) + len(kept[1]) + 32) if connection.acknowledges else _FRAME // 4
    for _ in range(3000):
        connection.send(continuation_frame(1, _newest(max(1, count))))


def _names(connection):
    _endless(connection, ("x" * _LONG, ""))


def _values(connection):
    _endless(connection, ("x", "y" * _LONG))


def _small(connection):
    _endless(connection, ("x", ""))


def _many_lists(connection):
    """A list in each of many streams, which stay open."""
    connection.send(headers_frame(1, request_headers("GetServerInfo") + literal("x" * _LONG, "", kept=True)))
    block = request_headers("GetServerInfo") + _newest(_FRAME // 4)
    for stream in range(3, 2001, 2):
        connection.send(headers_frame(stream, block))


def _text_without_end(connection):
    """Of a header's text, whose length says 256 MB."""
    connection.send(headers_frame(1, b"\0\x01x\x7f\x81\xff\xff\x7f", ends=False))
    for _ in range(6000):
        connection.send(continuation_frame(1, b"y" * _FRAME))


def _short(connection, more, frames):
    """Calls without end, each of which is over as soon as it has begun."""
    block = request_headers("GetServerInfo", more=more)
    for first in range(1, 100_001, 1000):
        connection.send(b"".join(headers_frame(stream, block) + frames(stream)
                                 for stream in range(first, first + 1000, 2)))
        while connection.receive(0.0001):
            pass


def _resets(connection):
    _short(connection, (), reset_frame)


def _timeouts(connection):
    _short(connection, [("grpc-timeout", "1n")], lambda stream: b"")


ATTACKS = [_names, _values, _small, _many_lists, _text_without_end, _resets, _timeouts]


def _attack(attack, address, tls, over):
    """Again and again, in a process of its own, which leaves the processors to the others."""
    os.nice(19)
    while not over.is_set():
        for acknowledges in (False, True):
            with contextlib.suppress(OSError), contextlib.closing(
                    Connection(address, "127.0.0.9", tls=tls, acknowledges=acknowledges)) as connection:
                if acknowledges:
                    connection.receive(0.1)
                attack(connection)
        over.wait(0.01)


class Attackers(contextlib.AbstractContextManager):
    def __init__(self, attack, address, tls=False):
        processes = multiprocessing.get_context("fork")
        self._over = processes.Event()
        self._all = [processes.Process(target=_attack, args=(attack, address, tls, self._over), daemon=True)
                     for _ in range(_ATTACKERS)]
        for process in self._all:
            process.start()

    def __exit__(self, *_):
        self._over.set()
        for process in self._all:
            process.join(1)
            process.terminate()
            process.join()


def _held(address):
    """As many calls as connections may have, each with as many headers as it may, which ask for nothing."""
    block = request_headers("GetMesh") + b"".join(literal(f"x{n}", "") for n in range(50))
    connections = []
    for _ in range(_HELD_CONNECTIONS):
        with contextlib.suppress(OSError):
            connection = Connection(address, "127.0.0.9")
            connection.receive(0.01)
            connection.send(b"".join(headers_frame(connection.next_stream(), block) for _ in range(_HELD_STREAMS)))
            connections.append(connection)
    return connections


def is_served_s(address, seconds, **options):
    """The longest of calls that another client makes, one after the other."""
    longest_s, end = 0, time.monotonic() + seconds
    while time.monotonic() < end:
        begin = time.monotonic()
        with contextlib.suppress(OSError), contextlib.closing(Connection(address, "127.0.0.2", **options)) as connection:
            while not connection.closed and not connection.is_answered("GetServerInfo", 30):
                pass
        longest_s = max(longest_s, time.monotonic() - begin)
        time.sleep(0.02)
    return longest_s


def beside(job, name, attack_address, server, jobs, idle_s):
    """Each attack's figures, of an honest client at the server's own address."""
    figures = []
    for attack in ATTACKS:
        what, refused = f"{name}: {attack.__name__[1:].replace('_', ' ')}", []
        with Attackers(attack, attack_address):
            time.sleep(1)
            beside_s = small_range_s(server.address(), jobs, job.seconds, refused)
        time.sleep(1)
        after_s = small_range_s(server.address(), jobs, 2, refused)
        figures += [Figure(f"{what}: memory, at its peak so far", peak_mb(server.pid()), "MB",
                           at_most=MOST_MB),
                    Figure(f"{what}: small ranges meanwhile, of the idle server's", beside_s / idle_s, "times",
                           at_most=MOST_SLOWDOWN),
                    Figure(f"{what}: small ranges a second after", after_s / idle_s, "times", at_most=MOST_SLOWDOWN),
                    Figure(f"{what}: its calls that failed", len(refused), "", at_most=0)]
        for words in sorted(set(refused)):
            print("  " + words)
    return figures


def idle(job, server):
    ccslice = python_client(job.folder)
    with ccslice.Client(server.address()) as client:
        jobs = Jobs(client.upload(sample(job.build, job.folder, "ring")))
    return jobs, small_range_s(server.address(), jobs, job.seconds)


def server_of_1gib(job, *options):
    return Server(job.ccsliced(), job.folder, "--memory", f"{_MEMORY_MIB}MiB", "--threads", "2", *options)


def _certificate(folder):
    subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=localhost",
                    "-keyout", folder / "key.pem", "-out", folder / "certificate.pem"], check=True, capture_output=True)
    return ["--tls-cert", folder / "certificate.pem", "--tls-key", folder / "key.pem"]


def _with_tls(job):
    figures = []
    with server_of_1gib(job, *_certificate(job.folder)) as server:
        for attack in ATTACKS:
            what = f"TLS: {attack.__name__[1:].replace('_', ' ')}"
            with Attackers(attack, server.address(), tls=True):
                longest_s = is_served_s(server.address(), job.seconds, tls=True)
            figures += [Figure(f"{what}: memory, at its peak so far", peak_mb(server.pid()), "MB",
                               at_most=MOST_MB),
                        Figure(f"{what}: the longest call of another client", longest_s, "s", at_most=1)]
    return figures


def _that_stay(job):
    with server_of_1gib(job) as server:
        connections = _held(server.address())
        longest_s = is_served_s(server.address(), 5)
        for connection in connections:
            connection.close()
        most_mb = peak_mb(server.pid())
    return [Figure("full lists of calls that ask for nothing: memory, at its peak", most_mb, "MB",
                   at_most=MOST_MB),
            Figure("full lists of calls that ask for nothing: the longest call of another client", longest_s, "s",
                   at_most=15)]


def measure(job):
    with server_of_1gib(job) as server:
        jobs, idle_s = idle(job, server)
        figures = beside(job, "headers", server.address(), server, jobs, idle_s)
    return figures + _that_stay(job) + _with_tls(job)
