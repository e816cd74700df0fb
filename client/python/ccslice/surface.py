# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""The boundary of a solid, as triangles."""

import dataclasses
from typing import Dict

import numpy as np


@dataclasses.dataclass
class Surface:
    """Triangles within the tolerance of the limit's boundary, closed and oriented outwards."""

    points_mm: np.ndarray  # (n, 3) float64
    triangles: np.ndarray  # (m, 3) uint32
    channels: Dict[str, np.ndarray]  # (n,) float32 by name.
