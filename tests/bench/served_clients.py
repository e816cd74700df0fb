# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Clients with addresses of their own and jobs for them, for the parts of load_bench.py."""

import multiprocessing
import pathlib
import socket
import subprocess
import sys
import threading

_ROOT = pathlib.Path(__file__).resolve().parents[2]
_BLOCK = 1 << 18


def python_client(folder):
    """The Python client's package, with the contract's stubs in a folder."""
    if "ccslice" not in sys.modules:
        subprocess.run([_ROOT / "client/python/make_stubs.py", folder / "python"], check=True)
        sys.path.insert(0, str(folder / "python"))
    import ccslice
    return ccslice


def sample(build, folder, name):
    """A sample mesh."""
    path = folder / f"{name}.ccmesh"
    if not path.exists():
        subprocess.run([build / "client/ccslice", "models", name, "-o", path, "--quiet"], check=True,
                       stdout=subprocess.DEVNULL)
    return python_client(folder).Mesh.from_file(path)


def _copy(source, sink):
    try:
        while block := source.recv(_BLOCK):
            sink.sendall(block)
    except OSError:
        pass
    for end in (source, sink):
        try:
            end.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass


def _relay(listener, server, source_address):
    while True:
        client, _ = listener.accept()
        upstream = socket.create_connection(server, source_address=(source_address, 0))
        for end in (client, upstream):
            end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        for pair in ((client, upstream), (upstream, client)):
            threading.Thread(target=_copy, args=pair, daemon=True).start()


class Relay:
    """Makes whoever connects here a client of an address of its own: one of this machine's other loopback addresses."""

    def __init__(self, server_address, number):
        host, port = server_address.rsplit(":", 1)
        listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{listener.getsockname()[1]}"
        self._process = multiprocessing.Process(
            target=_relay, args=(listener, (host, int(port)), f"127.0.1.{number}"), daemon=True)
        self._process.start()
        listener.close()

    def close(self):
        self._process.terminate()
        self._process.join()


class Stub:
    """A connection of its own, through a relay if it is to have an address of its own."""

    def __init__(self, server_address, number=None):
        import grpc
        from ccslice.v1 import service_pb2_grpc
        self.relay = Relay(server_address, number) if number is not None else None
        self._channel = grpc.insecure_channel(self.relay.address if self.relay else server_address, options=[
            ("grpc.max_receive_message_length", -1), ("grpc.use_local_subchannel_pool", 1)])
        self.calls = service_pb2_grpc.SlicerServiceStub(self._channel)

    def close(self):
        self._channel.close()
        if self.relay:
            self.relay.close()


class Jobs:
    """Ranges of layers of an uploaded mesh with one channel, as bytes and compressed."""

    LAYER_MM = 0.03

    def __init__(self, summary):
        box = summary.bounding_box
        self._mesh_id, self._channel = summary.mesh_id, summary.channels[0].name
        self._size_mm = box.max_mm.x - box.min_mm.x, box.max_mm.y - box.min_mm.y
        self.layers = int((box.max_mm.z - box.min_mm.z) / self.LAYER_MM) - 1

    def request(self, columns, first=0, count=None):
        """Layers of columns x columns; by default all of them."""
        from ccslice.v1 import job_pb2, slice_pb2
        request = slice_pb2.SliceRangeRequest(first_layer=first, layer_count=self.layers if count is None else count)
        request.job.parts.add(mesh_id=self._mesh_id)
        pitch = request.job.grid.pitch
        pitch.x_mm, pitch.y_mm = (size / columns for size in self._size_mm)
        pitch.z_mm = self.LAYER_MM
        plane = request.job.planes.add(sample_type=job_pb2.SAMPLE_TYPE_UINT8,
                                       encoding=job_pb2.PLANE_ENCODING_RAW_ZSTD)
        plane.channel.name = self._channel
        return request


def percentile(values, share):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))]
