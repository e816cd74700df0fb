# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Values besides those of the meshes' channels."""

from dataclasses import dataclass
from typing import Any, Mapping, Optional, Tuple, Union

from .arguments import number_pair
from .v1 import job_pb2

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


Fields = Mapping[str, Union[Field, str]]  # By name; a string is a formula.


def add_fields(message: Any, fields: Fields) -> None:
    """message: a SliceJob, a PreviewRequest or a ProbePointsRequest."""
    for name, given in fields.items():
        field = Field(given) if isinstance(given, str) else given
        if not isinstance(field, Field):
            raise ValueError(f"fields[{name!r}] is a formula or a ccslice.Field, not {type(given).__name__}")
        if field.frame not in _FRAMES:
            raise ValueError(f"fields[{name!r}].frame is one of {', '.join(_FRAMES)}, not {field.frame!r}")
        added = message.fields.add(name=name, frame=_FRAMES[field.frame], formula=field.formula)
        if field.value_range is not None:
            added.range.min, added.range.max = number_pair(f"fields[{name!r}].value_range", field.value_range,
                                                           "two numbers, (low, high)")
