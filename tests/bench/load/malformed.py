# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Messages that protobuf can't parse, on every method, alone and after good ones: REQUEST_MALFORMED, and never OK."""

import random
import time

import grpc

from ccsliced_process import Server
from load.part import Figure

_UNARY = ["GetServerInfo", "FindMissingMeshes", "GetMesh", "ListMeshes", "DeleteMesh", "PlanSlices"]
_FROM_ONE = ["SliceRange", "TessellateBoundary"]
_FROM_MANY = ["ProbePoints", "EvaluatePoints"]
# A field that ends too early, a wire type that isn't one, a group that isn't closed, a number that never ends.
_BAD = [b"\x0a\x7f", b"\x0f", b"\x0b", b"\x08" + b"\xff" * 11]


def _error(call):
    try:
        call()
    except grpc.RpcError as error:
        return error
    return None


def _is_named(error):
    if error is None or error.code() != grpc.StatusCode.INVALID_ARGUMENT:
        return False
    return any(b"REQUEST_MALFORMED" in value for key, value in error.trailing_metadata() if key.endswith("-bin"))


def _calls(channel):
    for method in _UNARY:
        yield lambda messages, name="/ccslice.v1.SlicerService/" + method: channel.unary_unary(name)(messages[-1])
    for method in _FROM_ONE:
        yield lambda messages, name="/ccslice.v1.SlicerService/" + method: list(channel.unary_stream(name)(messages[-1]))
    yield lambda messages: channel.stream_unary("/ccslice.v1.SlicerService/UploadMesh")(iter(messages))
    for method in _FROM_MANY:
        yield lambda messages, name="/ccslice.v1.SlicerService/" + method: list(channel.stream_stream(name)(
            iter(messages)))


def measure(job):
    made = wrong = 0
    numbers = random.Random(1)
    with Server(job.ccsliced(), job.folder) as server, grpc.insecure_channel(server.address()) as channel:
        end = time.monotonic() + job.seconds
        while made == 0 or time.monotonic() < end:
            for call in _calls(channel):
                for bad in _BAD:
                    wrong += not _is_named(_error(lambda: call([bad])))
                    made += 1
            junk = bytes(numbers.randrange(256) for _ in range(numbers.randrange(1, 300)))
            for call in _calls(channel):  # Whatever it parses as: an error of ours, or an answer.
                error = _error(lambda: call([junk]))
                wrong += error is not None and error.code() in (grpc.StatusCode.INTERNAL, grpc.StatusCode.UNKNOWN,
                                                                grpc.StatusCode.UNAVAILABLE)
                made += 1
        alive = _error(lambda: channel.unary_unary("/ccslice.v1.SlicerService/GetServerInfo")(b"")) is None
    return [Figure("malformed calls made", made, ""),
            Figure("of them with another end than they should have", wrong, "", at_most=0),
            Figure("the server serves on", int(alive), "", at_least=1)]
