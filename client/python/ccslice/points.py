# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""What points of a solid are made of."""

import dataclasses
from typing import Dict

import numpy as np


@dataclasses.dataclass
class Probe:
    """What is at n points of space."""

    inside: np.ndarray  # (n,) bool: inside the solid, or within the tolerance of its boundary.
    near: np.ndarray  # (n,) bool: not inside, but within the tolerance.
    control_cells: np.ndarray  # (n,) uint32, of the mesh; without meaning outside.
    limit_cells: np.ndarray  # (n,) uint32; without meaning outside.
    uvw: np.ndarray  # (n, 3) in the limit cell, each from 0 to 1; NaN outside.
    channels: Dict[str, np.ndarray]  # (n,) float64 by name; NaN outside.
    residuals_mm: np.ndarray  # (n,) from the point to what was evaluated; NaN outside.


@dataclasses.dataclass
class Evaluation:
    """The limit at n parameters."""

    positions_mm: np.ndarray  # (n, 3)
    channels: Dict[str, np.ndarray]  # (n,) float64 by name.
    jacobians_mm: np.ndarray  # (n, 3, 3): [point, xyz, uvw].
