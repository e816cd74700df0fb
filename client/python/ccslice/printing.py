# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Materials of a printer, and how channels mix them."""

import dataclasses
import numbers as numbers_abc
import string
from typing import Iterable, List, Mapping, Optional, Tuple, Union

from .layers import Layer
from .v1 import material_pb2

_METHODS = {
    "blue-noise": material_pb2.HALFTONE_METHOD_BLUE_NOISE,
    "error-diffusion": material_pb2.HALFTONE_METHOD_ERROR_DIFFUSION,
    "largest-fraction": material_pb2.HALFTONE_METHOD_LARGEST_FRACTION,
    "white-noise": material_pb2.HALFTONE_METHOD_WHITE_NOISE,
}

Colour = Union[str, Tuple[int, int, int], Tuple[int, int, int, int]]


def blend(channel: str, stops: Mapping[float, str]) -> material_pb2.MaterialMap:
    """Mixes neighbours: {0: "soft", 0.5: "mid", 1: "hard"} is half soft and half mid where the channel is 0.25."""
    result = material_pb2.MaterialMap()
    result.blend.channel = channel
    for value in sorted(stops):
        result.blend.stops.add(value=value, material=stops[value])
    return result


def direct(shares: Mapping[str, str], rest: str = "") -> material_pb2.MaterialMap:
    """Channels are fractions of materials, {channel: material}; rest gets what is left."""
    result = material_pb2.MaterialMap()
    for channel, material in shares.items():
        result.direct.shares.add(channel=channel, material=material)
    result.direct.rest_material = rest
    return result


def calibration(channel: str, material: str, base: str, points: Mapping[float, float]) -> material_pb2.MaterialMap:
    """points: {value of the channel: fraction of the material}; the base gets the rest."""
    result = material_pb2.MaterialMap()
    result.calibration.channel, result.calibration.material, result.calibration.base = channel, material, base
    for value in sorted(points):
        result.calibration.points.add(property=value, fraction=points[value])
    return result


def where(channel: str, below: float, material: str, otherwise: Union[material_pb2.MaterialMap, str],
          instead_of: str = "") -> material_pb2.MaterialMap:
    """All of a material where a channel or field is below a bound, else by another map or of one material.

    where("depth", 0.5, "hard", blend("share", {0: "soft", 1: "clear"})) is a shell round a gradient. `otherwise` may
    come from where() itself.
    instead_of: names the material that this one takes the place of. All others stay as they are: where("depth", 0.8,
        "hard", ..., instead_of="LIQUID") keeps a liquid 0.8 mm below the surface.
    """
    result = material_map(otherwise, False)
    rest = list(result.overrides)
    del result.overrides[:]
    result.overrides.add(channel=channel, below=below, material=material, instead_of=instead_of)
    result.overrides.extend(rest)
    return result


def _rgba(colour: Colour) -> int:
    """0xRRGGBBAA of "#RRGGBB", "#RRGGBBAA" or a tuple of 3 or 4 numbers from 0 to 255."""
    if isinstance(colour, str):
        digits = colour[1:]
        if colour[:1] != "#" or len(digits) not in (6, 8) or not set(digits) <= set(string.hexdigits):
            raise ValueError(f"a colour is '#RRGGBB' or '#RRGGBBAA', not {colour!r}")
        return int(digits if len(digits) == 8 else digits + "ff", 16)
    numbers = tuple(colour)
    whole = all(isinstance(number, numbers_abc.Integral) and 0 <= number <= 255 for number in numbers)
    if len(numbers) not in (3, 4) or not whole:
        raise ValueError(f"a colour has 3 or 4 whole numbers from 0 to 255, not {colour!r}")
    return int.from_bytes(bytes(numbers if len(numbers) == 4 else numbers + (255,)), "big")


def material_map(map: Union[material_pb2.MaterialMap, str], strict: bool) -> material_pb2.MaterialMap:
    """The map, or that of one material."""
    message = material_pb2.MaterialMap(material=map) if isinstance(map, str) else material_pb2.MaterialMap()
    if not isinstance(map, str):
        message.CopyFrom(map)
    message.strict = strict
    return message


@dataclasses.dataclass(frozen=True)
class MaterialAmount:
    """How much of a material layers hold."""

    name: str
    voxels: int
    cm3: float
    share: Optional[float]  # Of all that is printed, 0 to 1; None for what is left empty.
    grams: Optional[float]  # None unless the printing has its density.


class Printing:
    """What a printer holds, and which material goes where.

    materials: {name: colour}, up to 8; material i of them is number i + 1 in layers, 0 is outside. A colour of None is
        nothing: voxels of that material are left empty, and black in pictures.
    map: blend(), direct(), calibration(), where(), or the name of one material. region_maps: {cell region: the
        same}, which wins there.
    halftone: "blue-noise", "error-diffusion", "largest-fraction" or "white-noise". seed: another pattern of the same
        fractions.
    strict: whether values that give no fractions are refused instead of clamped.
    densities: {name: grams of a cubic centimetre}, for reports.
    """

    def __init__(self, materials: Mapping[str, Optional[Colour]],
                 map: Union[material_pb2.MaterialMap, str, None] = None, *,
                 region_maps: Optional[Mapping[str, Union[material_pb2.MaterialMap, str]]] = None,
                 halftone: str = "blue-noise", seed: int = 0, strict: bool = False,
                 densities: Optional[Mapping[str, float]] = None):
        if halftone not in _METHODS:
            raise ValueError(f"halftone is one of {', '.join(_METHODS)}, not {halftone!r}")
        self.material_names = list(materials)
        empty = [name for name, colour in materials.items() if colour is None]
        if len(empty) > 1:
            raise ValueError(f"materials has {empty[0]!r} and {empty[1]!r} of the colour None: one is enough")
        self.message = material_pb2.Printing()
        for name, colour in materials.items():
            self.message.materials.add(name=name, leaves_empty=colour is None,
                                       rgba=_rgba((0, 0, 0) if colour is None else colour))
        for name, density in (densities or {}).items():
            if name not in materials:
                raise ValueError(f"densities names {name!r}, which is none of the materials")
            if materials[name] is None:
                raise ValueError(f"densities names {name!r}, which is left empty and weighs nothing")
            if not 0 < density < float("inf"):
                raise ValueError(f"densities[{name!r}] is a number of grams above 0, not {density!r}")
            self.message.materials[self.material_names.index(name)].density_g_per_cm3 = density
        if map is not None:
            self.message.map.CopyFrom(material_map(map, strict))
        for region, own in (region_maps or {}).items():
            self.message.cell_region_maps.add(cell_region=region, map=material_map(own, strict))
        self.message.halftone.method = _METHODS[halftone]
        self.message.halftone.seed = seed

    def amounts(self, layers: Iterable[Layer]) -> List[MaterialAmount]:
        """How much of each material layers of this printing hold, in the order of the materials."""
        voxels = [0] * len(self.material_names)
        voxel_cm3 = 0.0
        for layer in layers:
            if len(layer.material_voxels) != len(voxels):
                raise ValueError(f"layer {layer.index} counts {len(layer.material_voxels)} materials, and the printing "
                                 f"has {len(voxels)}: give the layers that were sliced with it")
            voxels = [before + here for before, here in zip(voxels, layer.material_voxels)]
            voxel_cm3 = layer.voxel_mm3 / 1000
        materials = self.message.materials
        printed = sum(count for count, material in zip(voxels, materials) if not material.leaves_empty)
        return [MaterialAmount(
            material.name, count, count * voxel_cm3,
            None if material.leaves_empty else count / max(printed, 1),
            count * voxel_cm3 * material.density_g_per_cm3 if material.density_g_per_cm3 > 0 else None)
            for count, material in zip(voxels, materials)]
