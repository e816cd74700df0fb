# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Control meshes, made of arrays."""

import hashlib
import warnings
from typing import Any, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from .arguments import floats, refuse_masked, whole_numbers
from .v1 import mesh_pb2

_KINDS = {8: mesh_pb2.CELL_KIND_HEX, 4: mesh_pb2.CELL_KIND_TET, 6: mesh_pb2.CELL_KIND_WEDGE}
# The names of meshio, and the numbers of VTK.
_CORNERS = {"hexahedron": 8, "tetra": 4, "wedge": 6, 12: 8, 10: 4, 13: 6}


def _floats(name: str, array: Any, shape: str, matches) -> np.ndarray:
    """The array as numbers. Raises ValueError, naming it, unless its shape is right and all are finite."""
    numbers = floats(name, array, f"numbers of shape {shape}")
    if not matches(numbers.shape):
        raise ValueError(f"{name} must have shape {shape}, not {numbers.shape}")
    if not np.isfinite(numbers).all():
        raise ValueError(f"{name} holds a number that isn't finite, at {np.argwhere(~np.isfinite(numbers))[0].tolist()}")
    return numbers


def _indices(name: str, array: Any, shape: str, matches, count: int) -> np.ndarray:
    indices = whole_numbers(name, array, shape)
    if not matches(indices.shape):
        raise ValueError(f"{name} must have shape {shape}, not {indices.shape}")
    if indices.size and (indices.min() < 0 or indices.max() >= count):
        raise ValueError(f"{name} names vertices from 0 to {count - 1}, not {indices.min()} to {indices.max()}")
    return indices.astype(np.uint32)


def _blocks(cells: Any) -> Sequence[Tuple[str, Any]]:
    """The arrays of cells, one for each kind, and their names."""
    if isinstance(cells, Mapping):
        unknown = [kind for kind in cells if kind not in _CORNERS]
        if unknown:
            raise ValueError(f"cells has the kinds hexahedron, tetra and wedge, not {unknown[0]!r}")
        for kind, block in cells.items():
            if np.ndim(block) == 2 and np.shape(block)[1] != _CORNERS[kind]:
                raise ValueError(f"cells[{kind!r}] must have shape (m, {_CORNERS[kind]}), not {np.shape(block)}")
        return [(f"cells[{kind!r}]", block) for kind, block in cells.items()]
    if isinstance(cells, (list, tuple)) and len(cells) > 0 and all(np.ndim(block) == 2 for block in cells):
        return [(f"cells[{i}]", block) for i, block in enumerate(cells)]
    return [("cells", cells)]


def _regions(regions: Any, cells: int) -> Tuple[np.ndarray, np.ndarray]:
    """Their names, sorted, and the number of each cell's."""
    refuse_masked("regions", regions)
    try:
        of_cells = np.asarray(regions)
        names, numbers = np.unique(of_cells, return_inverse=True)
    except (TypeError, ValueError) as wrong:
        raise ValueError("regions takes names, or numbers, one for each cell") from wrong
    if of_cells.shape != (cells,):
        raise ValueError(f"regions must have shape ({cells},), one for each cell, not {of_cells.shape}")
    return names, numbers


def _warn_of_own_points(points: np.ndarray, used: np.ndarray) -> None:
    """Some programs give each cell points of its own. Such cells are parts of their own."""
    own = points[used]
    # Points in one place have the same key. Few others do, so the slow comparison is rarely made for nothing.
    keys = np.sort(own[:, 0] + 0.7548776662466927 * own[:, 1] + 0.5698402909980532 * own[:, 2])
    if not (keys[1:] == keys[:-1]).any():
        return
    own = own[np.lexsort(own.T)]
    double = int((own[1:] == own[:-1]).all(axis=1).sum())
    if double:
        warnings.warn(
            f"points lie where another one does, {double} in all. Cells hang together by common points only, so the mesh may "
            "fall into parts there. To join them: points, first, new = numpy.unique(points, axis=0, return_index=True, "
            "return_inverse=True); then take new.ravel()[cells] for the cells (and sharp edges) and values[first] for a channel's values",
            stacklevel=3)


class Mesh:
    """A control mesh.

    points: (n, 3) coordinates in mm.
    cells: vertices of hexahedra (m, 8), tetrahedra (m, 4) or wedges (m, 6), in VTK's order; or several such arrays, as
        a list or by the names "hexahedron", "tetra", "wedge".
    channels: {name: (n,)}, a number for each point.
    sharp_edges: (k, 2), and sharp_vertices: (k,), which stay sharp.
    regions: (all cells,), a name or number for each cell, in the order of cells: parts with sharp interfaces. Regions
        are numbered from 1 in the order of region_names: sorted, numbers by their size.
    allow_folds: whether inverted cells are accepted. interpolating: says that the control points were fitted.
    as_meshed: the solid is the mesh itself, as finite elements have it; nothing is smoothed, and nothing can be sharp.

    Warns if points of cells lie in the same place: nothing joins them, as ccslice convert does for files.
    Raises ValueError for arrays that don't fit, and for masked values. What the server finds wrong with a mesh comes with its upload.
    """

    def __init__(self, points: Any, cells: Any, channels: Optional[Mapping[str, Any]] = None, *,
                 sharp_edges: Any = (), sharp_vertices: Any = (), regions: Optional[Sequence[Union[str, int]]] = None,
                 allow_folds: bool = False, interpolating: bool = False, as_meshed: bool = False):
        points = _floats("points", points, "(n, 3)", lambda shape: len(shape) == 2 and shape[1] == 3)
        count = len(points)
        message = mesh_pb2.ControlMesh(allow_folds=allow_folds, interpolating=interpolating, as_meshed=as_meshed)
        message.positions_mm.extend(points.ravel().tolist())
        kinds = []
        used = np.zeros(count, bool)
        for name, block in _blocks(cells):
            corners = _indices(name, block, "(m, 8), (m, 6) or (m, 4)",
                               lambda shape: len(shape) == 2 and shape[1] in _KINDS, count)
            kinds += [_KINDS[corners.shape[1]]] * len(corners)
            message.cell_vertices.extend(corners.ravel().tolist())
            used[corners] = True
        message.cell_kinds.extend(kinds)
        _warn_of_own_points(points, used)
        self.channel_names = list(channels or {})
        self.region_names = []
        if self.channel_names:
            columns = [
                _floats(f"channels[{name!r}]", values, f"({count},)", lambda shape: shape == (count,))
                for name, values in channels.items()
            ]
            message.channel_names.extend(self.channel_names)
            message.channel_values.extend(np.stack(columns, axis=1).ravel().tolist())
        edges = _indices("sharp_edges", sharp_edges, "(k, 2)",
                         lambda shape: shape == (0,) or (len(shape) == 2 and shape[1] == 2), count)
        message.sharp_edges.extend(edges.ravel().tolist())
        corners = _indices("sharp_vertices", sharp_vertices, "(k,)", lambda shape: len(shape) == 1, count)
        message.sharp_vertices.extend(corners.tolist())
        if regions is not None:
            names, numbers = _regions(regions, len(kinds))
            self.region_names = [str(name) for name in names]
            message.cell_region_names.extend(self.region_names)
            message.cell_regions.extend(numbers.tolist())
        self.cell_count = len(kinds)
        self.point_count = count
        self.content = message.SerializeToString(deterministic=True)
        self.id = "sha256:" + hashlib.sha256(self.content).hexdigest()

    @classmethod
    def from_meshio(cls, mesh: Any, **options: Any) -> "Mesh":
        """Of a meshio.Mesh, or what looks like one: points, cells_dict, and point_data with one number a point."""
        return cls(mesh.points, _volume_cells(mesh.cells_dict), _scalars(mesh.point_data, len(mesh.points)), **options)

    @classmethod
    def from_pyvista(cls, grid: Any, **options: Any) -> "Mesh":
        """Of a pyvista.UnstructuredGrid, or what looks like one: points, cells_dict, point_data."""
        return cls(grid.points, _volume_cells(grid.cells_dict), _scalars(grid.point_data, len(grid.points)), **options)

    @classmethod
    def from_file(cls, path: Any) -> "Mesh":
        """Of a .ccmesh file, as `ccslice convert` writes it from other formats. Raises ValueError if it is none."""
        with open(path, "rb") as file:
            content = file.read()
        try:
            message = mesh_pb2.ControlMesh.FromString(content)
        except Exception as wrong:
            raise ValueError(f"{path} isn't a .ccmesh file") from wrong
        if not message.cell_kinds:
            raise ValueError(f"{path} isn't a .ccmesh file: it has no cells")
        mesh = cls.__new__(cls)
        mesh.channel_names = list(message.channel_names)
        mesh.region_names = list(message.cell_region_names)
        mesh.cell_count = len(message.cell_kinds)
        mesh.point_count = len(message.positions_mm) // 3
        mesh.content = content
        mesh.id = "sha256:" + hashlib.sha256(content).hexdigest()
        return mesh

    def __repr__(self) -> str:
        return f"<ccslice.Mesh: {self.cell_count} cells, {self.point_count} points, channels {self.channel_names}>"


def _volume_cells(cells: Mapping[Any, Any]) -> Mapping[Any, Any]:
    """Of all cells those with a volume: meshes hold triangles of the surface and the like beside them."""
    volumes = {kind: block for kind, block in cells.items() if kind in _CORNERS}
    if not volumes:
        raise ValueError(f"the mesh has no hexahedra, tetrahedra or wedges, only {list(cells)}")
    return volumes


def _scalars(point_data: Mapping[str, Any], count: int) -> Mapping[str, Any]:
    arrays = {name: np.ma.asanyarray(point_data[name]) for name in point_data.keys()}  # With their masks.
    return {name: array for name, array in arrays.items() if array.shape == (count,) and array.dtype.kind in "fiu"}
