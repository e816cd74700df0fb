# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Slices Catmull-Clark solids into voxel layers, through a ccsliced server.

    import ccslice

    mesh = ccslice.Mesh(points, cells, channels={"hardness": hardness})
    with ccslice.Client() as client:
        for layer in client.slice(mesh, pitch=0.2, channels=["hardness"]):
            print(layer.z_mm, layer.channels["hardness"].max())

Lengths are millimetres, indices begin at 0. Pictures are arrays [row, column]: row 0 has the lowest y, column 0 the
lowest x.
"""

try:
    import grpc as _grpc  # noqa: F401
except ImportError:
    raise ImportError(
        "ccslice needs grpcio: apt-get install python3-grpcio, or pip install grpcio") from None

from ._version import __version__
from .client import Client
from .errors import AnswerError, CallError, Error, LocalServerError, PlanWarning
from .fields import Field
from .layers import Layer
from .mesh import Mesh
from .parts import Part
from .points import Evaluation, Probe
from .preview import Plane, Preview
from .printing import MaterialAmount, Printing, blend, calibration, direct, where
from .surface import Surface
from .volume import Volume

__all__ = [
    "AnswerError", "CallError", "Client", "Error", "Evaluation", "Field", "Layer", "LocalServerError",
    "MaterialAmount", "Mesh", "Part", "Plane", "PlanWarning", "Preview", "Printing", "Probe", "Surface", "Volume",
    "__version__", "blend", "calibration", "direct", "where"
]
