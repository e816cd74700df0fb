# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Values besides those of the meshes' channels."""

from dataclasses import dataclass
from typing import Any, Dict, Mapping, Optional, Tuple, Union

import numpy as np

from .arguments import number_pair
from .v1 import job_pb2
from .volume import Volume

_FRAMES = {"part": job_pb2.FIELD_FRAME_PART, "world": job_pb2.FIELD_FRAME_WORLD}


@dataclass(frozen=True)
class Field:
    """Values by a formula of the place, in mm, and of channels, such as "gyroid(x/4, y/4, z/4) * density".

    formula: in the language of docs/fields.md. frame: whose x, y and z it reads, the "part"'s own or the "world"'s.
    value_range: (low, high) that the values are clamped to; default: bounds of what they can be.
    """

    formula: str
    frame: str = "part"
    value_range: Optional[Tuple[float, float]] = None


# By name; a string is a formula, and an array the samples of a volume that fills the part's box.
Fields = Mapping[str, Union[Field, Volume, str, np.ndarray]]
TakenFields = Dict[str, Union[Field, Volume]]


def taken(fields: Optional[Fields]) -> TakenFields:
    """The same as Fields and Volumes. Raises ValueError."""
    kinds: TakenFields = {}
    for name, given in (fields or {}).items():
        if isinstance(given, str):
            kinds[name] = Field(given)
        elif isinstance(given, (Field, Volume)):
            kinds[name] = given
        elif isinstance(given, np.ndarray):
            kinds[name] = Volume(given)
        elif hasattr(given, "dims") and hasattr(given, "transpose"):
            kinds[name] = Volume.from_xarray(given)
        else:
            raise ValueError(f"fields[{name!r}] is a formula, an array, a ccslice.Field or a ccslice.Volume, not "
                             f"{type(given).__name__}")
    return kinds


def add_fields(message: Any, fields: TakenFields) -> None:
    """message: a SliceJob, a PreviewRequest or a ProbePointsRequest."""
    for name, field in fields.items():
        if isinstance(field, Volume):
            added = message.fields.add(name=name, frame=field.frame, volume=field.message)
        elif field.frame not in _FRAMES:
            raise ValueError(f"fields[{name!r}].frame is one of {', '.join(_FRAMES)}, not {field.frame!r}")
        else:
            added = message.fields.add(name=name, frame=_FRAMES[field.frame], formula=field.formula)
        if field.value_range is not None:
            added.range.min, added.range.max = number_pair(f"fields[{name!r}].value_range", field.value_range,
                                                           "two numbers, (low, high)")
