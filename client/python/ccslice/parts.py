# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Parts of a job: meshes in their places."""

import dataclasses
from typing import Any, Mapping, Optional, Sequence, Union

from .mesh import Mesh
from .v1 import material_pb2


@dataclasses.dataclass(frozen=True)
class Part:
    """A mesh in one place or several, for jobs of several parts. Where parts overlap, the highest priority wins, and of
    equal ones the first part.

    mesh: a Mesh, or the id of an uploaded one.
    placements: a (3, 4) or (4, 4) matrix, row by row, for each copy; default: one copy, where the mesh is.
    name: what messages call it; default: "part 1", "part 2", ... in their order.
    map: blend(), direct(), calibration(), where(), or the name of one material, in place of that of the job's Printing.
    region_maps: {cell region: the same}, in place of those of the job's Printing.
    seed: in place of that of the job's Printing.
    """

    mesh: Union[Mesh, str]
    placements: Optional[Sequence[Any]] = None
    name: Optional[str] = None
    priority: int = 0
    map: Union[material_pb2.MaterialMap, str, None] = None
    seed: Optional[int] = None
    region_maps: Optional[Mapping[str, Union[material_pb2.MaterialMap, str]]] = None
