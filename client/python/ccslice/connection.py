# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""The connection to a server: TLS, and the metadata of calls."""

import os
import re
from typing import Any, Iterator, List, Optional, Tuple

import grpc

from .errors import require_answer
from .v1 import mesh_pb2, service_pb2_grpc

_MESH_ID = re.compile(r"sha256:[0-9a-f]{64}")
_MOST_TOKEN_BYTES = 4096
_THIS_MACHINE = ("unix:", "localhost:", "127.", "[::1]:")
_TLS_SCHEME = "https://"
_GRPC_SCHEMES = ("unix:", "unix-abstract:", "dns:", "ipv4:", "ipv6:", "xds:")
_HOST = r"(?:[^:/@?#\[\]\s]+|\[[^\[\]\s]+\])"
_ADDRESS = re.compile(rf"https://{_HOST}|(?:https://)?{_HOST}:\d+")
_OPTIONS = [
    # A compressed message may take a thousand times its bytes before anybody asks for its size. Servers are told that
    # we take none. Whoever sends one all the same is refused, but maybe only once it is inflated, so it never is.
    ("grpc.compression_enabled_algorithms_bitset", 1),
    ("grpc.per_message_decompression", 0),
    # A server that is back is looked for every fifth of a second. What is called the least pause is how long an attempt
    # to connect may take.
    ("grpc.initial_reconnect_backoff_ms", 100),
    ("grpc.min_reconnect_backoff_ms", 5000),
    ("grpc.max_reconnect_backoff_ms", 200),
    # Finds out about servers that vanished without a word; more often than every five minutes counts as abuse.
    ("grpc.keepalive_time_ms", 6 * 60 * 1000),
    ("grpc.keepalive_timeout_ms", 20 * 1000),
]


def is_mesh_id(text: str) -> bool:
    return _MESH_ID.fullmatch(text) is not None


class Identity:
    """Whom a client trusts, and who it is: paths of files, else those of the environment's variables."""

    def __init__(self, ca: Optional[str], cert: Optional[str], key: Optional[str], token_file: Optional[str]):
        self.ca = ca or os.environ.get("CCSLICE_CA")
        self.cert = cert or os.environ.get("CCSLICE_CERT")
        self.key = key or os.environ.get("CCSLICE_KEY")
        self.token_file = token_file or os.environ.get("CCSLICE_TOKEN_FILE")
        if bool(self.cert) != bool(self.key):
            raise ValueError("cert and key go together")

    def channel(self, address: str) -> grpc.Channel:
        """Of several addresses with commas between them, as the command line takes them, to the first."""
        address = address.split(",")[0]
        if address == "unix:":
            raise ValueError("unix: takes the path of a socket, as in unix:/run/ccsliced.sock")
        port = re.fullmatch(r"(?:(?:dns|ipv4|ipv6):)?(?:.*/)?(?:[^:/]*|\[.*\]):(\d+)", address)
        if port and not address.startswith("unix") and not 0 < int(port[1]) < 1 << 16:
            raise ValueError(f"there is no port {port[1]}, as in {address!r}")
        # gRPC takes a name without a port, too, and looks for it at port 443.
        if not address.startswith(_GRPC_SCHEMES) and not _ADDRESS.fullmatch(address):
            raise ValueError("an address is HOST:PORT, such as localhost:50051, https://HOST:PORT, or unix:PATH, not "
                             f"{address!r}")
        scheme, host = address[:len(_TLS_SCHEME)], address[len(_TLS_SCHEME):]
        if scheme == _TLS_SCHEME:
            address = host if ":" in host else host + ":443"
        elif address.startswith("unix:") or not (self.ca or self.cert):
            if self.token_file and not address.startswith(_THIS_MACHINE):
                raise ValueError(f"the token would travel unencrypted to {address}: give ca, or https:// before it")
            return grpc.insecure_channel(address, options=_OPTIONS)
        credentials = grpc.ssl_channel_credentials(*map(_content, (self.ca, self.key, self.cert)))
        return grpc.secure_channel(address, credentials, options=_OPTIONS)

    def metadata(self) -> List[Tuple[str, str]]:
        return [("authorization", "Bearer " + _token(self.token_file))] if self.token_file else []


def _content(path: Optional[str]) -> Optional[bytes]:
    if not path:
        return None
    with open(path, "rb") as file:
        return file.read()


def _token(path: str) -> str:
    with open(path, "rb") as file:
        line = file.read(_MOST_TOKEN_BYTES + 2).split(b"\n", 1)[0].rstrip(b"\r")
    if not 0 < len(line) <= _MOST_TOKEN_BYTES or any(not 0x21 <= byte <= 0x7e for byte in line):
        raise ValueError(f"{path} has no token: its first line is to be 1 to {_MOST_TOKEN_BYTES} printable ASCII "
                         "characters without spaces")
    return line.decode("ascii")


class Calls:
    """The service's methods. Each call of a mesh names it in its metadata, for proxies that choose a server by it."""

    def __init__(self, channel: grpc.Channel, metadata: List[Tuple[str, str]]):
        self._stub = service_pb2_grpc.SlicerServiceStub(channel)
        self._metadata = metadata

    def __getattr__(self, method: str) -> Any:
        send = getattr(self._stub, method)

        def call(request: Any, mesh_id: str = "") -> Any:
            """mesh_id: of streams of requests."""
            answer = send(request, metadata=self._about(mesh_id or getattr(request, "mesh_id", "")))
            require_answer(answer is not None, "there is none")
            return answer

        return call

    def begin_upload(self, messages: Iterator[Any], mesh_id: str) -> Any:
        """The upload as a future."""
        return self._stub.UploadMesh.future(messages, metadata=self._about(mesh_id))

    def begin_question(self, request: mesh_pb2.GetPreparationRequest, timeout: float) -> Any:
        """How far a mesh is, as a future."""
        return self._stub.GetPreparation.future(request, metadata=self._about(request.mesh_id), timeout=timeout)

    def _about(self, mesh_id: str) -> List[Tuple[str, str]]:
        return self._metadata + ([("ccslice-mesh-id", mesh_id)] if is_mesh_id(mesh_id) else [])
