# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Layers: from the messages of a stream to arrays."""

import dataclasses
import zlib
from typing import Dict, List, Optional

import numpy as np

from .errors import AnswerError
from .v1 import slice_pb2

_TYPES = {
    slice_pb2.SAMPLE_TYPE_UINT8: np.dtype("<u1"),
    slice_pb2.SAMPLE_TYPE_UINT16: np.dtype("<u2"),
    slice_pb2.SAMPLE_TYPE_FLOAT32: np.dtype("<f4"),
}


@dataclasses.dataclass
class Layer:
    """One layer. Pictures are arrays (rows, columns), read-only: row 0 has the lowest y, column 0 the lowest x."""

    index: int  # In the grid.
    z_mm: float  # Of its voxels' centres.
    voxel_count: int  # Inside.
    occupancy: Optional[np.ndarray]  # bool; None if it wasn't asked for.
    channels: Dict[str, np.ndarray]  # float32, uint8 or uint16 by name, as asked for; `outside`, or 0, outside.
    materials: Optional[np.ndarray]  # uint8: 1 for the first material, 0 outside; None without printing.
    cell_regions: Optional[np.ndarray]  # uint8: 1 for the first region, 0 outside; None if it wasn't asked for.
    contours: List[np.ndarray]  # (k, 2) float64 x, y in mm, a closed loop each; empty if they weren't asked for.
    material_voxels: List[int]  # Of each material.
    contour_regions: List[int]  # Of contours by region: each loop's, from 1; 0 otherwise.


def _require(holds: bool, otherwise: str) -> None:
    if not holds:
        raise AnswerError("the server's answer is wrong: " + otherwise)


def _samples(spec: slice_pb2.PlaneSpec, encoded: bytes, columns: int, rows: int) -> bytes:
    """As many as the grid has."""
    if spec.sample_type in _TYPES:
        size = rows * columns * _TYPES[spec.sample_type].itemsize
    else:
        size = rows * ((columns + 7) // 8)
    samples = encoded if spec.encoding == slice_pb2.PLANE_ENCODING_RAW else _inflated(encoded, size)
    _require(len(samples) == size, "a plane of another size than the grid's")
    return samples


def _inflated(frame: bytes, size: int) -> bytes:
    import zstandard  # Only asked for where it is installed.

    try:
        announced = zstandard.frame_content_size(frame)  # What is announced is allocated.
        _require(announced in (-1, size), "a plane of another size than the grid's")
        return zstandard.ZstdDecompressor().decompress(frame, max_output_size=size)
    except zstandard.ZstdError as wrong:
        raise AnswerError(f"the server's answer is wrong: a plane can't be decoded: {wrong}") from wrong


def _picture(spec: slice_pb2.PlaneSpec, samples: bytes, columns: int, rows: int) -> np.ndarray:
    if spec.sample_type in _TYPES:
        return np.frombuffer(samples, _TYPES[spec.sample_type]).reshape(rows, columns)
    packed = np.frombuffer(samples, np.uint8).reshape(rows, -1)
    inside = np.unpackbits(packed, axis=1, count=columns).view(bool)
    inside.flags.writeable = False
    return inside


class Assembler:
    """Puts the layers of one stream together and checks that they are what was asked for."""

    def __init__(self, header: slice_pb2.SliceHeader):
        self._header = header
        extent = header.region.extent if header.HasField("region") else header.grid.extent
        self._columns, self._rows = extent.columns, extent.rows
        self._next = header.first_layer
        self._begin: Optional[slice_pb2.LayerBegin] = None
        self._chunks: List[List[bytes]] = []
        self._loops: List[List[float]] = []
        self._loop_regions: List[int] = []
        self._loops_done = 0
        self.complete = False

    def add(self, message: slice_pb2.SliceRangeResponse) -> Optional[Layer]:
        """The layer that the message completes, or None."""
        event = message.WhichOneof("event")
        _require(not self.complete, "messages after the summary")
        if event == "layer_begin":
            self._start(message.layer_begin)
        elif event == "summary":
            self._finish(message.summary)
        else:
            _require(event in ("plane_chunk", "contour_chunk", "layer_end"), f"a message of {event}")
            _require(self._begin is not None, "a chunk outside of a layer")
            if event == "layer_end":
                return self._end(message.layer_end)
            if event == "plane_chunk":
                self._add_chunk(message.plane_chunk)
            else:
                self._add_contours(message.contour_chunk)
        return None

    def _start(self, begin: slice_pb2.LayerBegin) -> None:
        _require(self._begin is None, "a layer begins inside another one")
        _require(begin.layer == self._next, f"layer {begin.layer} where {self._next} is due")
        _require(len(begin.encoded_bytes) == len(self._header.planes), "a layer with other planes than asked for")
        self._begin = begin
        self._chunks = [[] for _ in self._header.planes]
        self._loops, self._loop_regions, self._loops_done = [], [], 0

    def _add_chunk(self, chunk: slice_pb2.PlaneChunk) -> None:
        _require(chunk.plane < len(self._chunks), "a chunk of a plane that wasn't asked for")
        chunks = self._chunks[chunk.plane]
        _require(chunk.offset == sum(map(len, chunks)), "chunks of a plane with a gap")
        chunks.append(chunk.data)

    def _add_contours(self, chunk: slice_pb2.ContourChunk) -> None:
        for piece in chunk.pieces:
            _require(piece.loop == self._loops_done, "contour loops out of order")
            if len(self._loops) == self._loops_done:
                self._loops.append([])
                self._loop_regions.append(piece.cell_region)
            loop = self._loops[-1]
            _require(piece.first_point == len(loop) // 2, "contour points with a gap")
            loop.extend(piece.points_mm)
            self._loops_done += piece.last

    def _end(self, end: slice_pb2.LayerEnd) -> Layer:
        begin = self._begin
        _require(end.layer == begin.layer, "the end of another layer")
        _require(len(end.planes) == len(self._chunks), "a layer without a result for each plane")
        _require(self._loops_done == begin.contour_loops == len(self._loops), "fewer or more contours than announced")
        layer = Layer(end.layer, begin.z_mm, end.voxel_count, None, {}, None, None,
                      [np.array(loop).reshape(-1, 2) for loop in self._loops], list(end.statistics.material_voxels),
                      self._loop_regions)
        for spec, chunks, size, result in zip(self._header.planes, self._chunks, begin.encoded_bytes, end.planes):
            encoded = chunks[0] if len(chunks) == 1 else b"".join(chunks)
            _require(len(encoded) == size, "a plane shorter or longer than announced")
            samples = _samples(spec, encoded, self._columns, self._rows)
            _require(len(samples) == result.raw_bytes and zlib.crc32(samples) == result.crc32,
                     f"the checksum of a plane of layer {end.layer} differs")
            self._place(layer, spec, _picture(spec, samples, self._columns, self._rows))
        self._begin = None
        self._next += 1
        return layer

    @staticmethod
    def _place(layer: Layer, spec: slice_pb2.PlaneSpec, picture: np.ndarray) -> None:
        content = spec.WhichOneof("content")
        if content == "channel":
            layer.channels[spec.channel.name] = picture
        else:
            setattr(layer, content, picture)

    def _finish(self, summary: slice_pb2.SliceSummary) -> None:
        _require(self._begin is None, "the summary came inside a layer")
        last = self._header.first_layer + self._header.layer_count
        _require(self._next == last and summary.layers == self._header.layer_count, "the summary came before all layers")
        self.complete = True
