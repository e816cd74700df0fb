# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Servers whose log nobody reads: the reader of their standard error has died, or it has stopped. No call fails, and
SIGTERM still ends them."""

import subprocess
import threading
import time

import grpc

from ccsliced_process import address_in
from load.part import Figure

_CALLERS = 4
_NOT_UTF8 = b"\x0a\x02\xff\xfe"  # A mesh_id of which protobuf has something to say, too.
_FEWEST_CALLS = 12_000  # A pipe holds some 700 lines, and the server's queue 8,192.
_LONGEST_S = 120
_LONGEST_STOP_S = 5


def _ends_with(code, method, request):
    try:
        method(request, timeout=10)
    except grpc.RpcError as error:
        return error.code() == code
    return code == grpc.StatusCode.OK


def _call(address, end, counts):
    """Calls of one client, one after the other: adds how many it made and how many ended otherwise than they should."""
    with grpc.insecure_channel(address, options=[("grpc.use_local_subchannel_pool", 1)]) as channel:
        good = channel.unary_unary("/ccslice.v1.SlicerService/ListMeshes")
        bad = channel.unary_unary("/ccslice.v1.SlicerService/GetMesh")
        made = failed = 0
        begin = time.monotonic()
        while (made < _FEWEST_CALLS / _CALLERS or time.monotonic() < end) and time.monotonic() < begin + _LONGEST_S:
            failed += not _ends_with(grpc.StatusCode.OK, good, b"")
            failed += not _ends_with(grpc.StatusCode.INVALID_ARGUMENT, bad, _NOT_UTF8)
            made += 2
    counts.append((made, failed))


def _without_a_reader(job, what, stop_reading):
    server = subprocess.Popen([job.ccsliced(), "--listen", "127.0.0.1:0"], stderr=subprocess.PIPE, text=True)
    try:
        line = server.stderr.readline()
        address = address_in(line)
        if not address:
            raise RuntimeError("the server doesn't serve: " + line)
        stop_reading(server.stderr)
        counts, end = [], time.monotonic() + job.seconds / 2
        threads = [threading.Thread(target=_call, args=[address, end, counts]) for _ in range(_CALLERS)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        begin = time.monotonic()
        server.terminate()
        try:
            clean = server.wait(2 * _LONGEST_STOP_S) == 0
        except subprocess.TimeoutExpired:
            clean = False
        stopped_s = time.monotonic() - begin
    finally:
        server.kill()
        server.wait()
        server.stderr.close()
    return [Figure(f"{what}: calls made", sum(made for made, _ in counts), "", at_least=_FEWEST_CALLS),
            Figure(f"{what}: calls that failed", sum(failed for _, failed in counts), "", at_most=0),
            Figure(f"{what}: SIGTERM ends it with exit code 0", int(clean), "", at_least=1),
            Figure(f"{what}: after", stopped_s, "s", at_most=_LONGEST_STOP_S)]


def measure(job):
    return (_without_a_reader(job, "reader dead", lambda pipe: pipe.close()) +
            _without_a_reader(job, "reader stopped", lambda _: None))
