#!/usr/bin/python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""A whole client of ccslice in Python: makes a graded bar, uploads it, plans, slices, probes, and reads an error.

    PYTHONPATH=<folder of the stubs> tests/foreign/python/slice_bar.py localhost:50051 [AUTHORITY.pem TOKEN_FILE]

The stubs come from the contract (packages python3-grpcio, python3-protobuf, python3-zstandard, python3-pil, protobuf-compiler-grpc):

    mkdir STUBS
    protoc -I proto -I tests/foreign/proto --python_out=STUBS --grpc_python_out=STUBS \\
        --plugin=protoc-gen-grpc_python=/usr/bin/grpc_python_plugin \\
        proto/ccslice/v1/*.proto proto/google/rpc/*.proto tests/foreign/proto/reflection.proto

Prints one JSON document of what it got.
"""

import hashlib
import io
import json
import pathlib
import sys
import zlib

import grpc
import zstandard
from PIL import Image

from ccslice.v1 import job_pb2, mesh_pb2, plan_pb2, points_pb2, service_pb2_grpc, slice_pb2
from google.rpc import error_details_pb2, status_pb2
import reflection_pb2
import reflection_pb2_grpc

PITCH_MM = 0.5
CHUNK_BYTES = 256 * 1024
LAYERS = range(4, 8)


def service_names(channel):
    """What the server offers, by reflection."""
    stub = reflection_pb2_grpc.ServerReflectionStub(channel)
    request = reflection_pb2.ServerReflectionRequest(list_services="*")
    answer = next(stub.ServerReflectionInfo(iter([request])))
    return sorted(service.name for service in answer.list_services_response.service)


def bar(cells, side_mm):
    """Cubes in a row along x, as one control mesh; its channel "stiffness" grows from 0 to 1."""
    mesh = mesh_pb2.ControlMesh(channel_names=["stiffness"])
    for i in range(cells + 1):  # A square of four vertices at each end of each cube.
        for y, z in ((0, 0), (1, 0), (1, 1), (0, 1)):
            mesh.positions_mm.extend((i * side_mm, y * side_mm, z * side_mm))
            mesh.channel_values.append(i / cells)
    for i in range(cells):
        mesh.cell_kinds.append(mesh_pb2.CELL_KIND_HEX)
        mesh.cell_vertices.extend(range(4 * i, 4 * i + 8))
    return mesh


def upload(slicer, mesh):
    """The mesh's id. Serializes once: the id is the digest of exactly the bytes that are sent."""
    content = mesh.SerializeToString()
    mesh_id = "sha256:" + hashlib.sha256(content).hexdigest()

    def messages():
        start = mesh_pb2.UploadStart(mesh_id=mesh_id, size_bytes=len(content))
        yield mesh_pb2.UploadMeshRequest(start=start)
        for at in range(0, len(content), CHUNK_BYTES):
            yield mesh_pb2.UploadMeshRequest(chunk=content[at:at + CHUNK_BYTES])

    return slicer.UploadMesh(messages()).mesh.mesh_id


def voxel_grid():
    return job_pb2.GridSpec(pitch=job_pb2.VoxelPitch(x_mm=PITCH_MM, y_mm=PITCH_MM, z_mm=PITCH_MM))


def job(mesh_id, grid, planes=()):
    return job_pb2.SliceJob(parts=[job_pb2.Part(mesh_id=mesh_id)], grid=grid, planes=planes)


def planes():
    """The occupancy, and the same channel as 8 bit in three encodings."""
    stiffness = job_pb2.ChannelContent(name="stiffness")
    encodings = (job_pb2.PLANE_ENCODING_RAW, job_pb2.PLANE_ENCODING_RAW_ZSTD, job_pb2.PLANE_ENCODING_PNG)
    occupancy = job_pb2.PlaneSpec(occupancy=job_pb2.OccupancyContent(), encoding=job_pb2.PLANE_ENCODING_RAW_ZSTD)
    return [occupancy] + [
        job_pb2.PlaneSpec(channel=stiffness, sample_type=job_pb2.SAMPLE_TYPE_UINT8, encoding=encoding)
        for encoding in encodings
    ]


def grey_png(file):
    """The samples of an 8-bit grey PNG."""
    picture = Image.open(io.BytesIO(file))
    assert picture.mode == "L"
    return picture.tobytes()


def decoded(encoded, encoding):
    if encoding == job_pb2.PLANE_ENCODING_RAW_ZSTD:
        return zstandard.ZstdDecompressor().decompress(encoded)
    return grey_png(encoded) if encoding == job_pb2.PLANE_ENCODING_PNG else encoded


def occupied(bits, columns):
    """Voxels inside. Rows are padded to whole bytes with zeros, so counting ones does."""
    assert len(bits) % ((columns + 7) // 8) == 0
    return sum(byte.bit_count() for byte in bits)


def slice_layers(slicer, mesh_id):
    """Layer by layer: the samples of every plane, decoded and checked."""
    request = slice_pb2.SliceRangeRequest(
        job=job(mesh_id, voxel_grid(), planes()), first_layer=LAYERS.start, layer_count=len(LAYERS))
    header, encoded = None, []
    for message in slicer.SliceRange(request):
        event = message.WhichOneof("event")
        if event == "header":
            header = message.header
        elif event == "layer_begin":
            encoded = [b""] * len(header.planes)
        elif event == "plane_chunk":
            encoded[message.plane_chunk.plane] += message.plane_chunk.data
        elif event == "layer_end":
            samples = [decoded(data, spec.encoding) for data, spec in zip(encoded, header.planes)]
            for plane, result in zip(samples, message.layer_end.planes):
                assert len(plane) == result.raw_bytes and zlib.crc32(plane) == result.crc32
            assert occupied(samples[0], header.grid.extent.columns) == message.layer_end.voxel_count
            yield message.layer_end.layer, samples


def probe(slicer, mesh_id, points_mm):
    """The stiffness at each point, None outside."""
    flat = [coordinate for point in points_mm for coordinate in point]
    answer = next(slicer.ProbePoints(iter([points_pb2.ProbePointsRequest(mesh_id=mesh_id, points_mm=flat)])))
    inside = (location == points_pb2.POINT_LOCATION_INSIDE for location in answer.locations)
    return [value if there else None for there, value in zip(inside, answer.channel_values)]


def failure(call, *arguments):
    """What a call that fails says: its status code, the stable reason, and the field at fault."""
    try:
        call(*arguments)
    except grpc.RpcError as error:
        status = status_pb2.Status.FromString(dict(error.trailing_metadata())["grpc-status-details-bin"])
        found = {"code": error.code().name, "message": status.message}
        info, bad_request = error_details_pb2.ErrorInfo(), error_details_pb2.BadRequest()
        for detail in status.details:
            if detail.Unpack(info):
                found["reason"] = info.reason
            if detail.Unpack(bad_request):
                found["field"] = bad_request.field_violations[0].field
        return found
    raise AssertionError("the call should have failed")


def open_channel(address, authority=None, token_file=None):
    """In plain text, or with TLS and a token."""
    if not authority:
        return grpc.insecure_channel(address)
    tls = grpc.ssl_channel_credentials(pathlib.Path(authority).read_bytes())
    token = grpc.access_token_call_credentials(pathlib.Path(token_file).read_text().strip())
    return grpc.secure_channel(address, grpc.composite_channel_credentials(tls, token))


def main(*where):
    with open_channel(*where) as channel:
        slicer = service_pb2_grpc.SlicerServiceStub(channel)
        mesh_id = upload(slicer, bar(cells=4, side_mm=5))
        plan = slicer.PlanSlices(plan_pb2.PlanSlicesRequest(job=job(mesh_id, voxel_grid())))
        no_pitch = job_pb2.GridSpec(pitch=job_pb2.VoxelPitch(x_mm=-1, y_mm=1, z_mm=1))
        print(json.dumps({
            "services": service_names(channel),
            "mesh_id": mesh_id,
            "pitch_mm": PITCH_MM,
            "layer_count": plan.layer_count,
            "layers": {layer: [zlib.crc32(plane) for plane in samples] for layer, samples in slice_layers(slicer, mesh_id)},
            "probed": probe(slicer, mesh_id, [(10, 2.5, 2.5), (-10, 0, 0)]),
            "failure": failure(slicer.PlanSlices, plan_pb2.PlanSlicesRequest(job=job(mesh_id, no_pitch))),
        }))


if __name__ == "__main__":
    main(*sys.argv[1:])
