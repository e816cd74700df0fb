# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of cuts."""

from dataclasses import dataclass, field
from typing import Any, List, Optional, Sequence, Tuple

import numpy as np

from .arguments import floats, number_pair, triple
from .errors import require_answer
from .v1 import preview_pb2

_COLOURS = {
    "viridis": preview_pb2.COLOUR_MAP_NAME_VIRIDIS,
    "cividis": preview_pb2.COLOUR_MAP_NAME_CIVIDIS,
    "grey": preview_pb2.COLOUR_MAP_NAME_GREY,
}

_MOST_PIXELS = 2048  # Each way.
_MOST_OUTLINE_POINTS = 1 << 24  # Of a picture: four for each pixel of the largest.
_POINTS_OF_AN_OUTLINE = 5  # As many as take its memory without points.


def _unit(name: str, value: Any) -> np.ndarray:
    vector = floats(name, value, "three numbers")
    length = np.linalg.norm(vector) if vector.shape == (3,) else 0.0
    if not (np.isfinite(length) and length > 0):
        raise ValueError(f"{name} takes three numbers that aren't all 0, not {value!r}")
    return vector / length


@dataclass(frozen=True)
class Plane:
    """A plane through a placed part, in mm.

    middle: (3,), the middle of the picture. normal: (3,), towards the viewer, of any length.
    up: (3,), which way is up in the picture, as far as the plane lets it be; default: z, or y for a level plane.
    """
    middle: Sequence[float]
    normal: Sequence[float] = (0, 0, 1)
    up: Optional[Sequence[float]] = None

    def axes(self) -> Tuple[np.ndarray, np.ndarray]:
        """Unit vectors (3,), across and up."""
        normal = _unit("normal", self.normal)
        wanted = np.array([0.0, 0.0, 1.0]) if self.up is None else _unit("up", self.up)
        up = wanted - normal.dot(wanted) * normal
        if np.linalg.norm(up) < 1e-9:
            if self.up is not None:
                raise ValueError("up lies along the normal: take another one")
            up = np.array([0.0, 1.0, 0.0])
        up /= np.linalg.norm(up)
        return np.cross(up, normal), up


@dataclass
class Preview:
    """A picture of a cut.

    rgba: uint8 (height, width, 4), rows from the top; alpha is 0 outside the part, lines aside.
    number: which of the planes, from 1. coarse: whether a picture in full may follow.
    value_range: values of the first and the last colour, of channels. material_pixels: of halftones, by material.
    value_pixels: of channels, by value, in even steps of value_range.
    outlines: float64 (n, 2) each, closed, in mm from the picture's lower left corner.
    """
    number: int
    coarse: bool
    rgba: np.ndarray
    mm_per_pixel: Tuple[float, float]
    value_range: Optional[Tuple[float, float]] = None
    material_pixels: List[int] = field(default_factory=list)
    value_pixels: List[int] = field(default_factory=list)
    outlines: List[np.ndarray] = field(default_factory=list)


def plane_message(plane: Plane, mm_per_pixel: float) -> preview_pb2.PreviewPlane:
    message = preview_pb2.PreviewPlane()
    middle = triple("middle", plane.middle)
    for vector, target in zip((middle, *plane.axes()), (message.free.middle_mm, message.free.across, message.free.up)):
        target.x, target.y, target.z = map(float, vector)
    message.free.across_mm_per_pixel = mm_per_pixel
    return message


def content_message(channel: Optional[str], colours: str, value_range: Optional[Tuple[float, float]],
                    mixes: bool, lines: Optional[float] = None) -> preview_pb2.PreviewContent:
    content = preview_pb2.PreviewContent()
    if lines is not None:
        content.lines.width_pixels = lines
    if channel is not None:
        if colours not in _COLOURS:
            raise ValueError(f"colours is one of {', '.join(_COLOURS)}, not {colours!r}")
        content.channel.channel = channel
        content.channel.colours = _COLOURS[colours]
        if value_range is not None:
            content.channel.range.min, content.channel.range.max = number_pair("value_range", value_range,
                                                                               "two numbers, (low, high)")
    elif mixes:
        content.mix.SetInParent()
    else:
        content.occupancy.SetInParent()
    return content


class PreviewAssembler:
    """Puts the messages of a call together to pictures. Each ends, and takes no more memory than there can be of it."""

    def __init__(self) -> None:
        self._header: Optional[preview_pb2.PreviewHeader] = None
        self._of: Tuple[int, int] = (0, 0)  # Number and stage.
        self._bytes: List[bytes] = []
        self._size = 0
        self._outlines: List[np.ndarray] = []
        self._outline_room = 0  # For so many points more.
        self._brought_nothing = False  # The part before.

    def _begin(self, message: preview_pb2.PreviewResponse) -> None:
        header = message.header
        require_answer(self._header is None, "a picture begins inside another one")
        require_answer(0 < header.width <= _MOST_PIXELS and 0 < header.height <= _MOST_PIXELS and
                       header.picture_bytes == 4 * header.width * header.height, "a picture of impossible size")
        self._header, self._of = header, (message.number, message.stage)
        self._bytes, self._size = [], 0
        self._outlines, self._outline_room = [], _MOST_OUTLINE_POINTS
        self._brought_nothing = False

    def _add_outlines(self, message: preview_pb2.PreviewResponse) -> None:
        for outline in message.outlines:
            self._outline_room -= len(outline.points_mm) // 2 + _POINTS_OF_AN_OUTLINE
            require_answer(self._outline_room >= 0, "a picture of more outlines than there can be")
            require_answer(len(outline.points_mm) % 2 == 0, "half a point of an outline")
            self._outlines.append(np.array(outline.points_mm).reshape(-1, 2))

    def add(self, message: preview_pb2.PreviewResponse) -> Optional[Preview]:
        """A picture, if the message ends one."""
        if message.HasField("header"):
            self._begin(message)
        require_answer(self._header is not None, "a part of no picture")
        require_answer((message.number, message.stage) == self._of, "a part of another picture")
        self._size += len(message.picture)
        require_answer(self._size <= self._header.picture_bytes, "a picture longer than announced")
        brings_nothing = not message.picture and not message.outlines
        require_answer(not (brings_nothing and self._brought_nothing), "parts of a picture with nothing in them")
        self._brought_nothing = brings_nothing
        self._bytes.append(message.picture)
        self._add_outlines(message)
        if not message.last:
            return None
        header, self._header = self._header, None
        content = b"".join(self._bytes)
        require_answer(len(content) == header.picture_bytes, "a picture shorter than announced")
        rgba = np.frombuffer(content, dtype=np.uint8).reshape(header.height, header.width, 4)
        return Preview(message.number, message.stage == preview_pb2.PREVIEW_STAGE_COARSE, rgba,
                       (header.across_mm_per_pixel, header.up_mm_per_pixel),
                       (header.range.min, header.range.max) if header.HasField("range") else None,
                       list(header.material_pixels), list(header.value_pixels), self._outlines)
