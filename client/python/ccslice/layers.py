# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Layers: from the messages of a stream to arrays."""

import dataclasses
import zlib
from typing import Dict, List, Optional

import numpy as np

from .errors import AnswerError, require_answer
from .v1 import job_pb2, slice_pb2

_TYPES = {
    job_pb2.SAMPLE_TYPE_UINT8: np.dtype("<u1"),
    job_pb2.SAMPLE_TYPE_UINT16: np.dtype("<u2"),
    job_pb2.SAMPLE_TYPE_FLOAT32: np.dtype("<f4"),
}
_MOST_CONTOUR_POINTS = 1 << 26  # Of a layer. They take some gigabytes.
_POINTS_OF_A_LOOP = 5  # As many as take its memory without points.
_HEAD_BYTES = 256 << 10  # Of a plane, beside twice its samples.


@dataclasses.dataclass
class Layer:
    """One layer. Pictures are arrays (rows, columns), read-only: row 0 has the lowest y, column 0 the lowest x."""

    index: int  # In the grid.
    z_mm: float  # Of its voxels' centres.
    voxel_count: int  # Inside, without those that are cut out or left empty.
    occupancy: Optional[np.ndarray]  # bool, of these; None if it wasn't asked for.
    channels: Dict[str, np.ndarray]  # float32, uint8 or uint16 by name, as asked for; `outside`, or 0, outside.
    materials: Optional[np.ndarray]  # uint8: 1 for the first material, 0 outside; None without printing.
    cell_regions: Optional[np.ndarray]  # uint8: 1 for the first region, 0 outside; None if it wasn't asked for.
    contours: List[np.ndarray]  # (k, 2) float64 x, y in mm, a closed loop each; empty if they weren't asked for.
    material_voxels: List[int]  # Of each material.
    contour_regions: List[int]  # Of contours by region: each loop's, from 1; 0 otherwise.
    voxels_off_map: int = 0  # Whose values the printing's map doesn't cover.
    voxels_scaled_up: int = 0  # Whose fractions of a direct map add up to less than 1.
    least_fraction_sum: float = 0.0  # Of these.
    voxels_covered: int = 0  # In several parts.
    voxels_cut: int = 0  # Of parts, that the job cuts out.
    part_voxels: List[int] = dataclasses.field(default_factory=list)  # What each of several parts has, with its copies,
    part_material_voxels: List[List[int]] = dataclasses.field(default_factory=list)  # and of each material.
    voxel_mm3: float = 0.0  # The volume of a voxel.


def _sample_bytes(spec: job_pb2.PlaneSpec, columns: int, rows: int) -> int:
    """As many as the grid has."""
    if spec.sample_type in _TYPES:
        return rows * columns * _TYPES[spec.sample_type].itemsize
    return rows * ((columns + 7) // 8)


def _samples(spec: job_pb2.PlaneSpec, encoded: bytes, columns: int, rows: int) -> bytes:
    size = _sample_bytes(spec, columns, rows)
    samples = encoded if spec.encoding == job_pb2.PLANE_ENCODING_RAW else _inflated(encoded, size)
    require_answer(len(samples) == size, "a plane of another size than the grid's")
    return samples


def _inflated(frame: bytes, size: int) -> bytes:
    import zstandard  # Only asked for where it is installed.

    try:
        announced = zstandard.frame_content_size(frame)  # What is announced is allocated.
        require_answer(announced in (-1, size), "a plane of another size than the grid's")
        return zstandard.ZstdDecompressor().decompress(frame, max_output_size=size)
    except zstandard.ZstdError as wrong:
        raise AnswerError(f"the server's answer is wrong: a plane can't be decoded: {wrong}") from wrong


def _picture(spec: job_pb2.PlaneSpec, samples: bytes, columns: int, rows: int) -> np.ndarray:
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
        pitch = header.grid.pitch
        self._voxel_mm3 = pitch.x_mm * pitch.y_mm * pitch.z_mm
        self._next = header.first_layer
        self._begin: Optional[slice_pb2.LayerBegin] = None
        self._chunks: List[List[bytes]] = []
        self._loops: List[List[float]] = []
        self._loop_regions: List[int] = []
        self._loops_done = 0
        self._contour_room = 0  # For so many points more.
        self.complete = False

    def add(self, message: slice_pb2.SliceRangeResponse) -> Optional[Layer]:
        """The layer that the message completes, or None."""
        event = message.WhichOneof("event")
        require_answer(not self.complete, "messages after the summary")
        if event == "layer_begin":
            self._start(message.layer_begin)
        elif event == "summary":
            self._finish(message.summary)
        else:
            require_answer(event in ("plane_chunk", "contour_chunk", "layer_end"), f"a message of {event}")
            require_answer(self._begin is not None, "a chunk outside of a layer")
            if event == "layer_end":
                return self._end(message.layer_end)
            if event == "plane_chunk":
                self._add_chunk(message.plane_chunk)
            else:
                self._add_contours(message.contour_chunk)
        return None

    def _start(self, begin: slice_pb2.LayerBegin) -> None:
        require_answer(self._begin is None, "a layer begins inside another one")
        require_answer(begin.layer == self._next, f"layer {begin.layer} where {self._next} is due")
        require_answer(len(begin.encoded_bytes) == len(self._header.planes), "a layer with other planes than asked for")
        for spec, size in zip(self._header.planes, begin.encoded_bytes):
            most = 2 * _sample_bytes(spec, self._columns, self._rows) + _HEAD_BYTES
            require_answer(size <= most, f"a plane of impossible size: {size} bytes")
        self._contour_room = _MOST_CONTOUR_POINTS
        require_answer(begin.contour_loops <= self._contour_room, "a layer of more contours than there can be")
        self._begin = begin
        self._chunks = [[] for _ in self._header.planes]
        self._loops, self._loop_regions, self._loops_done = [], [], 0

    def _add_chunk(self, chunk: slice_pb2.PlaneChunk) -> None:
        require_answer(chunk.plane < len(self._chunks), "a chunk of a plane that wasn't asked for")
        chunks = self._chunks[chunk.plane]
        there = sum(map(len, chunks))
        require_answer(chunk.offset == there, "chunks of a plane with a gap")
        require_answer(len(chunk.data) > 0, "an empty chunk")
        require_answer(there + len(chunk.data) <= self._begin.encoded_bytes[chunk.plane],
                       "a plane longer than announced")
        chunks.append(chunk.data)

    def _add_contours(self, chunk: slice_pb2.ContourChunk) -> None:
        require_answer(len(chunk.pieces) > 0, "an empty chunk")
        for piece in chunk.pieces:
            require_answer(piece.loop == self._loops_done, "contour loops out of order")
            require_answer(self._loops_done < self._begin.contour_loops, "more contour loops than announced")
            points = len(piece.points_mm) // 2
            require_answer(len(piece.points_mm) == 2 * points, "half a contour point")
            require_answer(points > 0, "a piece with no contour points")
            self._contour_room -= points + (_POINTS_OF_A_LOOP if len(self._loops) == self._loops_done else 0)
            require_answer(self._contour_room >= 0, "a layer of more contours than there can be")
            if len(self._loops) == self._loops_done:
                self._loops.append([])
                self._loop_regions.append(piece.cell_region)
            loop = self._loops[-1]
            require_answer(piece.first_point == len(loop) // 2, "contour points with a gap")
            loop.extend(piece.points_mm)
            self._loops_done += piece.last

    def _end(self, end: slice_pb2.LayerEnd) -> Layer:
        begin = self._begin
        require_answer(end.layer == begin.layer, "the end of another layer")
        require_answer(len(end.planes) == len(self._chunks), "a layer without a result for each plane")
        require_answer(self._loops_done == begin.contour_loops == len(self._loops),
                       "fewer or more contours than announced")
        layer = Layer(end.layer, begin.z_mm, end.voxel_count, None, {}, None, None,
                      [np.array(loop).reshape(-1, 2) for loop in self._loops], list(end.statistics.material_voxels),
                      self._loop_regions, end.statistics.voxels_off_map, end.statistics.voxels_scaled_up,
                      end.statistics.least_fraction_sum, end.statistics.voxels_covered, end.statistics.voxels_cut,
                      [part.voxel_count for part in end.statistics.parts],
                      [list(part.material_voxels) for part in end.statistics.parts], self._voxel_mm3)
        for spec, chunks, size, result in zip(self._header.planes, self._chunks, begin.encoded_bytes, end.planes):
            encoded = chunks[0] if len(chunks) == 1 else b"".join(chunks)
            require_answer(len(encoded) == size, "a plane shorter or longer than announced")
            samples = _samples(spec, encoded, self._columns, self._rows)
            require_answer(len(samples) == result.raw_bytes and zlib.crc32(samples) == result.crc32,
                     f"the checksum of a plane of layer {end.layer} differs")
            self._place(layer, spec, _picture(spec, samples, self._columns, self._rows))
        self._begin = None
        self._next += 1
        return layer

    @staticmethod
    def _place(layer: Layer, spec: job_pb2.PlaneSpec, picture: np.ndarray) -> None:
        content = spec.WhichOneof("content")
        if content == "channel":
            layer.channels[spec.channel.name] = picture
        else:
            setattr(layer, content, picture)

    def _finish(self, summary: slice_pb2.SliceSummary) -> None:
        require_answer(self._begin is None, "the summary came inside a layer")
        last = self._header.first_layer + self._header.layer_count
        require_answer(self._next == last and summary.layers == self._header.layer_count,
                       "the summary came before all layers")
        self.complete = True
