# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Volumes: samples on a regular grid, made of arrays."""

import hashlib
import struct
from typing import Any, Callable, Optional, Tuple

import numpy as np

from .arguments import floats, pair, refuse_masked, triple
from .v1 import job_pb2, volume_pb2

_TYPES = {
    np.dtype(np.uint8): volume_pb2.VOLUME_SAMPLE_TYPE_UINT8,
    np.dtype(np.int16): volume_pb2.VOLUME_SAMPLE_TYPE_INT16,
    np.dtype(np.uint16): volume_pb2.VOLUME_SAMPLE_TYPE_UINT16,
    np.dtype(np.float32): volume_pb2.VOLUME_SAMPLE_TYPE_FLOAT32,
}
_FRAMES = {"part": job_pb2.FIELD_FRAME_PART, "world": job_pb2.FIELD_FRAME_WORLD}


class Volume:
    """Values by samples on a regular grid, such as a CT scan's. A field of its own: fields={"density": Volume(array)}.

    samples: an array (k, j, i) whose axes go along z, y and x, as layers have them, or (k, j, i, channels). Whole
        numbers and float32 are kept, others become float32. NaN where there is no value.
    index_to_mm: matrix (3, 4) or (4, 4), the place of sample (i, j, k), in mm, counted from 0 at its centre.
        Default: by spacing_mm and origin_mm, or else the samples' cells fill the box round the part.
    spacing_mm: between samples along x, y and z, one number or three. origin_mm: the centre of the first sample;
        default: the origin.
    frame: whose x, y and z these are, the "part"'s own or the "world"'s. channel: which one, from 0.
    nearest: whether values are those of the nearest sample, as labels need, instead of linear between samples.
    slope, intercept: a value is slope * sample + intercept. outside: the value where there are no samples, or NaN.
    value_range: (low, high) that values are clamped to; default: what the samples can give.
    """

    def __init__(self, samples: Any, *, index_to_mm: Any = None, spacing_mm: Any = None, origin_mm: Any = None,
                 frame: str = "part", channel: int = 0, nearest: bool = False, slope: float = 1, intercept: float = 0,
                 outside: float = 0, value_range: Optional[Tuple[float, float]] = None) -> None:
        if frame not in _FRAMES:
            raise ValueError(f"frame is one of {', '.join(_FRAMES)}, not {frame!r}")
        array = _samples(samples)
        self.shape = array.shape
        self.error: Optional[float] = None
        self.frame, self.value_range = _FRAMES[frame], value_range
        nk, nj, ni, channels = array.shape
        message = volume_pb2.Volume(samples_i=ni, samples_j=nj, samples_k=nk, channels=channels,
                                    sample_type=_TYPES[array.dtype],
                                    samples_zstd=_packed(array.astype(array.dtype.newbyteorder("<")).tobytes()))
        self.content = message.SerializeToString(deterministic=True)
        self.id = "sha256:" + hashlib.sha256(self.content).hexdigest()
        linear, nearest_one = job_pb2.VOLUME_INTERPOLATION_LINEAR, job_pb2.VOLUME_INTERPOLATION_NEAREST
        self.message = job_pb2.VolumeSamples(volume_id=self.id, channel=channel, slope=slope, intercept=intercept,
                                             outside_value=outside, interpolation=nearest_one if nearest else linear,
                                             index_to_mm=_place(index_to_mm, spacing_mm, origin_mm))

    @classmethod
    def from_function(cls, function: Callable[[np.ndarray, np.ndarray, np.ndarray], Any], box_mm: Any,
                      samples: Any = 64, **options: Any) -> "Volume":
        """Of function(x, y, z), which takes arrays of coordinates in mm and gives an array of values.

        box_mm: ((x, y, z), (x, y, z)), two corners, which samples reach to. samples: along x, y and z, one number or
        three, at least 2. Volume.error tells the largest difference from the function at the middles between samples,
        where linear values differ most; more samples make it smaller.
        """
        low, high = (triple("box_mm", corner) for corner in pair("box_mm", box_mm, "two corners"))
        counts = [int(count) for count in triple("samples", samples, or_one=True)]
        if min(counts) < 2 or not (low < high).all():
            raise ValueError(f"box_mm and samples make no grid: {low.tolist()} to {high.tolist()}, {counts}")
        step = (high - low) / (np.array(counts) - 1)

        def values_at(shift: float, less: int) -> np.ndarray:
            k, j, i = np.mgrid[tuple(slice(0, count - less) for count in reversed(counts))]
            places = (low[axis] + step[axis] * (index + shift) for axis, index in enumerate((i, j, k)))
            values = floats("function", function(*places), "an array of numbers")
            if values.shape != i.shape:
                raise ValueError(f"function gives an array of shape {i.shape}, as its coordinates have, not "
                                 f"{values.shape}")
            return values

        array = values_at(0, 0)
        volume = cls(array.astype(np.float32), spacing_mm=step, origin_mm=low, **options)
        corners = [array[a:array.shape[0] - 1 + a, b:array.shape[1] - 1 + b, c:array.shape[2] - 1 + c]
                   for a in (0, 1) for b in (0, 1) for c in (0, 1)]
        volume.error = float(np.abs(values_at(0.5, 1) - np.mean(corners, axis=0)).max())
        return volume

    @classmethod
    def from_xarray(cls, array: Any, **options: Any) -> "Volume":
        """Of an xarray.DataArray, or what looks like one, with the dimensions x, y and z, whose coordinates are evenly
        spaced, in mm."""
        dims = list(array.dims)
        if sorted(dims) != ["x", "y", "z"]:
            raise ValueError(f"an array with the dimensions x, y and z makes a volume, not one with {', '.join(dims)}")
        spacing, origin = [], []
        for dim in ("x", "y", "z"):
            places = floats(f"coordinates {dim}", np.asarray(array[dim]), "numbers")
            steps = np.diff(places) if places.size > 1 else np.ones(1)
            if not steps[0] or np.ptp(steps) > 1e-6 * abs(steps[0]):
                raise ValueError(f"coordinates {dim} aren't evenly spaced; interpolate the array first")
            spacing.append(float(np.mean(steps)))
            origin.append(float(places[0]))
        return cls(array.transpose("z", "y", "x").values, spacing_mm=spacing, origin_mm=origin, **options)

    def __repr__(self) -> str:
        error = "" if self.error is None else f", within {self.error:.3g} of its function"
        return f"<ccslice.Volume: {' x '.join(str(count) for count in reversed(self.shape[:3]))} samples{error}>"


def _samples(samples: Any) -> np.ndarray:
    refuse_masked("samples", samples)
    array = np.asarray(samples)
    if array.ndim not in (3, 4) or 0 in array.shape:
        raise ValueError(f"samples must have shape (k, j, i) or (k, j, i, channels), not {array.shape}")
    if array.dtype == np.bool_:
        array = array.astype(np.uint8)
    if array.dtype.newbyteorder("=") not in _TYPES:
        array = floats("samples", samples).astype(np.float32)
    if np.issubdtype(array.dtype, np.floating) and np.isinf(array).any():
        raise ValueError(f"samples holds an infinite number, at {np.argwhere(np.isinf(array))[0].tolist()}; "
                         "give NaN where there is no value")
    return array.astype(array.dtype.newbyteorder("=")).reshape(array.shape[:3] + (-1,))


def _place(index_to_mm: Any, spacing_mm: Any, origin_mm: Any) -> Any:
    if index_to_mm is not None:
        if spacing_mm is not None or origin_mm is not None:
            raise ValueError("index_to_mm says the place: leave out spacing_mm and origin_mm")
        matrix = floats("index_to_mm", index_to_mm, "a matrix (3, 4) or (4, 4)")
        if matrix.shape not in ((3, 4), (4, 4)):
            raise ValueError(f"index_to_mm must have shape (3, 4) or (4, 4), not {matrix.shape}")
        return matrix[:3].ravel().tolist()
    if spacing_mm is None:
        if origin_mm is not None:
            raise ValueError("origin_mm goes with spacing_mm")
        return []
    matrix = np.zeros((3, 4))
    matrix[:, :3] = np.diag(triple("spacing_mm", spacing_mm, or_one=True))
    if origin_mm is not None:
        matrix[:, 3] = triple("origin_mm", origin_mm)
    return matrix.ravel().tolist()


def _packed(content: bytes) -> bytes:
    """A zstd frame of the bytes; one that packs nothing, where zstandard isn't installed."""
    try:
        import zstandard  # pylint: disable=import-outside-toplevel
    except ImportError:
        return _stored(content)
    return zstandard.ZstdCompressor(level=1).compress(content)


def _stored(content: bytes) -> bytes:
    """RFC 8878: a window of 128 KiB, and blocks that are kept as they are."""
    most = 128 << 10
    frame = [struct.pack("<IBB", 0xFD2FB528, 0, 7 << 3)]
    for at in range(0, max(len(content), 1), most):
        block = content[at:at + most]
        last = at + most >= len(content)
        frame.append(struct.pack("<I", len(block) << 3 | int(last))[:3] + block)
    return b"".join(frame)
