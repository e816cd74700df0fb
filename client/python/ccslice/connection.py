# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""The connection to a server: TLS, and the metadata of calls."""

import ipaddress
import os
import re
from typing import Any, Iterator, List, Optional, Tuple

import grpc

from .errors import require_answer
from .v1 import mesh_pb2, service_pb2_grpc

_MESH_ID = re.compile(r"sha256:[0-9a-f]{64}")
_MOST_TOKEN_BYTES = 4096
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


def _mesh_id_of(request: Any) -> str:
    """The mesh that a request is about, if any: its own, or that of its job."""
    job = getattr(request, "job", None)
    return getattr(request, "mesh_id", "") if job is None else job.parts[0].mesh_id if job.parts else ""


def _hosts(target: str) -> List[str]:
    """Those that a target of gRPC's names, in lower case: of dns://AUTHORITY/HOST:PORT, and of lists of numbers."""
    if target.startswith(_GRPC_SCHEMES):
        target = target.split(":", 1)[1]
    hosts = []
    for place in target.rpartition("/")[2].split(","):
        if place.startswith("["):
            host = place[1:].partition("]")[0]
        else:
            host = place.rpartition(":")[0] if place.count(":") == 1 else place
        hosts.append(host.lower().rstrip("."))
    return hosts


def is_loopback(target: str) -> bool:
    """Whether a target leads to this machine and no other. Proxies are never asked for the way there."""

    def is_own(host: str) -> bool:
        try:
            number = ipaddress.ip_address(host)
        except ValueError:
            return host == "localhost"
        return (getattr(number, "ipv4_mapped", None) or number).is_loopback

    if target.startswith(("unix:", "unix-abstract:")):
        return True
    return not target.startswith("xds:") and all(map(is_own, _hosts(target)))


def proxy_hint(address: str) -> str:
    """What is to be said of a proxy on the way to a server that doesn't answer."""
    target = address.split(",")[0]
    target = target[len(_TLS_SCHEME):] if target.startswith(_TLS_SCHEME) else target
    name = next((name for name in ("grpc_proxy", "https_proxy", "http_proxy") if name in os.environ), "")
    if not os.environ.get(name) or is_loopback(target):
        return ""
    exceptions = os.environ.get("no_grpc_proxy", os.environ.get("no_proxy", ""))
    if any(part and _hosts(target)[0].endswith(part.strip().lower()) for part in exceptions.split(",")):
        return ""
    return (f"; the way to {target} leads through the proxy that the environment's {name} names: unset it, or add the "
            "host to no_proxy, if that is wrong")


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
            if self.token_file and not is_loopback(address):
                raise ValueError(f"the token would travel unencrypted to {address}: give ca, or https:// before it")
            return grpc.insecure_channel(address, options=_options(address))
        credentials = grpc.ssl_channel_credentials(*map(_content, (self.ca, self.key, self.cert)))
        return grpc.secure_channel(address, credentials, options=_options(address))

    def metadata(self) -> List[Tuple[str, str]]:
        return [("authorization", "Bearer " + _token(self.token_file))] if self.token_file else []


def _options(target: str) -> List[Tuple[str, int]]:
    return _OPTIONS + [("grpc.enable_http_proxy", 0)] if is_loopback(target) else _OPTIONS


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
            answer = send(request, metadata=self._about(mesh_id or _mesh_id_of(request)))
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
