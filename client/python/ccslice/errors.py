# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""What goes wrong, as exceptions."""

import functools
import importlib.resources
from typing import Dict, Optional

import grpc
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.message import DecodeError

_LONGEST_DELAY_S = 3600.0


class Error(Exception):
    """Any failure of this package. Wrong arguments are ValueErrors."""


class PlanWarning(UserWarning):
    """What a server warns of before it slices, in its words."""


class AnswerError(Error):
    """A server's answer is damaged, or of another engine or grid than the layers before it."""


def require_answer(holds: bool, otherwise: str) -> None:
    if not holds:
        raise AnswerError("the server's answer is wrong: " + otherwise)


class LocalServerError(Error):
    """No server of our own can be started."""


class CallError(Error):
    """A call failed.

    code: grpc.StatusCode. reason: a stable name such as "PITCH_INVALID", empty if no ccslice server has seen the call.
    metadata: "field" and "ids" where the server named them. retry_delay_s: after which the server asks to be called
    again, from 0 to an hour whatever it says, or None. missing_mesh_id: the mesh that the server doesn't hold, or
    empty.
    """

    def __init__(self, code: grpc.StatusCode, message: str, reason: str = "", metadata: Optional[Dict[str, str]] = None,
                 retry_delay_s: Optional[float] = None, missing_mesh_id: str = ""):
        super().__init__(message or code.name)
        self.code = code
        self.reason = reason
        self.metadata = metadata or {}
        self.retry_delay_s = retry_delay_s
        self.missing_mesh_id = missing_mesh_id

    @property
    def passes(self) -> bool:
        """Whether the same call may succeed later."""
        if self.code == grpc.StatusCode.UNAVAILABLE:
            return True
        if self.code == grpc.StatusCode.RESOURCE_EXHAUSTED:
            return self.retry_delay_s is not None or self.reason == "OUT_OF_MEMORY"
        # Proxies and transports report a connection that broke in the middle of a call so; servers always give a
        # reason.
        broken = (grpc.StatusCode.CANCELLED, grpc.StatusCode.INTERNAL, grpc.StatusCode.UNKNOWN)
        return self.code in broken and not self.reason


@functools.lru_cache(maxsize=None)
def _detail_classes():
    """Messages of google.rpc by their full names."""
    pool = descriptor_pool.DescriptorPool()
    content = importlib.resources.files(__package__).joinpath("error_details.binpb").read_bytes()
    files = descriptor_pb2.FileDescriptorSet.FromString(content).file
    for file in files:
        pool.Add(file)
    names = ("Status", "ErrorInfo", "RetryInfo", "ResourceInfo")
    if hasattr(message_factory, "GetMessageClass"):
        make = message_factory.GetMessageClass
    else:
        make = message_factory.MessageFactory(pool).GetPrototype
    return {name: make(pool.FindMessageTypeByName("google.rpc." + name)) for name in names}


def call_error(error: grpc.RpcError) -> CallError:
    """The failure of a call, with the details that the server gave. AnswerError for what couldn't be read."""
    code, text = error.code(), error.details() or ""
    # What gRPC itself says.
    compressed = code == grpc.StatusCode.UNIMPLEMENTED and text.startswith("Compression algorithm '")
    unreadable = code == grpc.StatusCode.INTERNAL and text == "Exception deserializing response!"
    require_answer(not compressed and not unreadable, "it is compressed, or no message of ccslice.v1")
    found = {}
    for key, value in error.trailing_metadata() or ():
        if key != "grpc-status-details-bin":
            continue
        classes = _detail_classes()
        try:
            for detail in classes["Status"].FromString(value).details:
                name = detail.type_url.rpartition(".")[2]
                if name in classes:
                    found[name] = classes[name].FromString(detail.value)
        except DecodeError:
            break  # Details of another kind say nothing.
    info, retry, resource = found.get("ErrorInfo"), found.get("RetryInfo"), found.get("ResourceInfo")
    reason = info.reason if info else ""
    return CallError(
        code, text, reason, dict(info.metadata) if info else {},
        min(max(retry.retry_delay.seconds + retry.retry_delay.nanos * 1e-9, 0.0), _LONGEST_DELAY_S) if retry else None,
        resource.resource_name if resource and reason == "MESH_MISSING" else "")
