# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Messages that protobuf can't parse, on every method, alone and after good ones: REQUEST_MALFORMED, and never OK. And
good requests of every method with some bytes changed, thousands of them: an answer, or a status that says why not. What
the server keeps of memory afterwards."""

import random
import time

import grpc

from ccsliced_process import Server
from load.part import Figure, resident_mb
from served_clients import Jobs, python_client, sample

_SERVICE = "/ccslice.v1.SlicerService/"
_UNARY = ["GetServerInfo", "FindMissingMeshes", "GetPreparation", "GetMesh", "ListMeshes", "DeleteMesh", "PlanSlices"]
_FROM_ONE = ["SliceRange", "TessellateBoundary"]
_FROM_MANY = ["ProbePoints", "EvaluatePoints", "Preview"]
# A field that ends too early, a wire type that isn't one, a group that isn't closed, a number that never ends.
_BAD = [b"\x0a\x7f", b"\x0f", b"\x0b", b"\x08" + b"\xff" * 11]
_FEWEST_MUTATED = 10_000
_LONGEST_CALL_S = 2  # A changed byte may ask for billions of voxels: then the deadline ends it.
_REST_S = 5


def _error(call):
    try:
        call()
    except grpc.RpcError as error:
        return error
    return None


def _says_why(error, reason=b"google.rpc.ErrorInfo"):
    return any(reason in value for key, value in error.trailing_metadata() if key.endswith("-bin"))


def _is_named(error):
    return (error is not None and error.code() == grpc.StatusCode.INVALID_ARGUMENT and
            _says_why(error, b"REQUEST_MALFORMED"))


def _is_an_end(error):
    """Whether a call with changed bytes may end so."""
    return error is None or error.code() == grpc.StatusCode.DEADLINE_EXCEEDED or (
        error.code() not in (grpc.StatusCode.INTERNAL, grpc.StatusCode.UNKNOWN, grpc.StatusCode.UNAVAILABLE) and
        _says_why(error))


def _call(channel, method, messages):
    if method in _UNARY:
        return channel.unary_unary(_SERVICE + method)(messages[-1], timeout=_LONGEST_CALL_S)
    if method in _FROM_ONE:
        return list(channel.unary_stream(_SERVICE + method)(messages[-1], timeout=_LONGEST_CALL_S))
    if method == "UploadMesh":
        return channel.stream_unary(_SERVICE + method)(iter(messages), timeout=_LONGEST_CALL_S)
    return list(channel.stream_stream(_SERVICE + method)(iter(messages), timeout=_LONGEST_CALL_S))


def _good(mesh_id, jobs):
    """A good request of each method, serialized."""
    from ccslice.v1 import info_pb2, mesh_pb2, plan_pb2, points_pb2, preview_pb2, surface_pb2
    messages = {
        "GetServerInfo": info_pb2.GetServerInfoRequest(),
        "FindMissingMeshes": mesh_pb2.FindMissingMeshesRequest(mesh_ids=[mesh_id]),
        "GetPreparation": mesh_pb2.GetPreparationRequest(mesh_id=mesh_id),
        "GetMesh": mesh_pb2.GetMeshRequest(mesh_id=mesh_id),
        "ListMeshes": mesh_pb2.ListMeshesRequest(page_size=3),
        "DeleteMesh": mesh_pb2.DeleteMeshRequest(mesh_id="sha256:" + 64 * "0"),
        "PlanSlices": plan_pb2.PlanSlicesRequest(job=jobs.request(64).job),
        "SliceRange": jobs.request(64, 3, 1),
        "TessellateBoundary": surface_pb2.TessellateBoundaryRequest(mesh_id=mesh_id, chord_tolerance_mm=1),
        "UploadMesh": mesh_pb2.UploadMeshRequest(start={"mesh_id": mesh_id, "size_bytes": 100}),
        "ProbePoints": points_pb2.ProbePointsRequest(mesh_id=mesh_id, points_mm=[1, 2, 3]),
        "EvaluatePoints": points_pb2.EvaluatePointsRequest(mesh_id=mesh_id, limit_cells=[0], uvw=[0.5, 0.5, 0.5]),
        "Preview": preview_pb2.PreviewRequest(mesh_id=mesh_id)}
    return {method: message.SerializeToString() for method, message in messages.items()}


def _mutated(good, numbers):
    """Some bytes changed, taken out or put in."""
    changed = bytearray(good)
    for _ in range(numbers.randrange(1, 4)):
        at = numbers.randrange(len(changed) + 1)
        changed[at:at + numbers.randrange(3)] = numbers.randbytes(numbers.randrange(3))
    return bytes(changed)


def _unparsable(channel):
    """How many calls were made, and how many ended as they shouldn't."""
    ends = [_is_named(_error(lambda: _call(channel, method, [bad])))
            for method in [*_UNARY, *_FROM_ONE, "UploadMesh", *_FROM_MANY] for bad in _BAD]
    return len(ends), ends.count(False)


def measure(job):
    ccslice = python_client(job.folder)
    numbers = random.Random(1)
    with Server(job.ccsliced(), job.folder) as server, grpc.insecure_channel(server.address()) as channel:
        with ccslice.Client(server.address()) as client:
            summary = client.upload(sample(job.build, job.folder, "ring"))
        good = _good(summary.mesh_id, Jobs(summary))
        failing = [method for method, request in good.items() if method not in ("UploadMesh", "Preview") and
                   _error(lambda: _call(channel, method, [request]))]
        unparsable, unnamed = _unparsable(channel)
        made = wrong = 0
        before_mb, end = resident_mb(server.pid()), time.monotonic() + job.seconds
        while made < _FEWEST_MUTATED or time.monotonic() < end:
            method = numbers.choice(list(good))
            request = _mutated(good[method], numbers)
            error = _error(lambda: _call(channel, method, [request]))
            if not _is_an_end(error):
                print(f"  {method} of {request.hex()}: {error.code()} {error.details()}")
                wrong += 1
            made += 1
        alive = _error(lambda: _call(channel, "GetServerInfo", [b""])) is None
        time.sleep(_REST_S)
        after_mb = resident_mb(server.pid())
    return [Figure("good requests that fail", len(failing), "", at_most=0),
            Figure("unparsable messages sent", unparsable, ""),
            Figure("of those, otherwise than REQUEST_MALFORMED", unnamed, "", at_most=0),
            Figure("mutated requests made", made, "", at_least=_FEWEST_MUTATED),
            Figure("of those, ended without a reason", wrong, "", at_most=0),
            Figure("the server serves on", int(alive), "", at_least=1),
            Figure("memory afterwards, of that before", after_mb / before_mb, "times", at_most=1.05)]
