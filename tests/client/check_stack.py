#!/usr/bin/env python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Checks a folder of layers, and the packages made of it, with other programs' readers.

    check_stack.py FOLDER [FILE.gcvf] [FILE.3mf]

Sizes, numbering, digests; palettes, alpha and histograms of materials; that packages unzip, parse and are complete.
"""

import collections
import hashlib
import json
import pathlib
import re
import sys
import xml.etree.ElementTree
import zipfile

import numpy
from PIL import Image

Image.MAX_IMAGE_PIXELS = None
VOLUMETRIC = "{http://schemas.3mf.io/3dmanufacturing/volumetric/2022/01}"
CORE = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
RELATIONSHIP = "{http://schemas.openxmlformats.org/package/2006/relationships}Relationship"


def require(condition, what):
    if not condition:
        sys.exit(f"check_stack.py: {what}")


def colours(manifest):
    """The materials' RGBA, the background's first."""
    background = manifest.get("printing", {}).get("background_rgba", 0x000000FF)
    rgba = [background] + [int(material["rgba"][1:], 16) for material in manifest.get("materials", [])]
    return [tuple(value >> shift & 255 for shift in (24, 16, 8, 0)) for value in rgba]


def material_counts(picture, palette):
    """Voxels of each colour of an RGBA or indexed picture, the background's first."""
    rgba = numpy.asarray(picture.convert("RGBA")).reshape(-1, 4)
    found, counts = numpy.unique(rgba, axis=0, return_counts=True)
    by_colour = collections.Counter({tuple(int(c) for c in colour): int(n) for colour, n in zip(found, counts)})
    strangers = set(by_colour) - set(palette)
    require(not strangers, f"colours outside the palette: {strangers}")
    return [by_colour[colour] for colour in palette]


def check_picture(path, plane, layer, manifest):
    region = manifest["region"]
    with Image.open(path) as picture:
        picture.load()
        require(picture.size == (region["columns"], region["rows"]), f"{path.name} is {picture.size}")
        voxels = region["columns"] * region["rows"]
        if plane["content"] == "occupancy":
            inside = int(numpy.count_nonzero(numpy.asarray(picture)))
            require(inside == layer["voxel_count"], f"{path.name} shows {inside} voxels")
        if plane["content"] == "materials":
            palette = colours(manifest)
            if plane["encoding"] == "png_rgba":
                require(picture.mode == "RGBA", f"{path.name} is {picture.mode}")
                if all(colour[3] == 255 for colour in palette):
                    require(picture.getextrema()[3] == (255, 255), f"{path.name} isn't opaque")
            counts = material_counts(picture, palette)
            require(counts == [voxels - layer["voxel_count"], *layer["material_voxels"]], f"{path.name}: {counts}")


def check_region(manifest):
    """Voxels of the grid, and layers of the region."""
    grid, region = manifest["grid"], manifest["region"]
    for first, count in (("first_column", "columns"), ("first_row", "rows"), ("first_layer", "layers")):
        require(region[count] > 0 and region[first] + region[count] <= grid[count], f"the region's {count}")
    end = region["first_layer"] + region["layers"]
    strangers = [x["layer"] for x in manifest["layers"] if not region["first_layer"] <= x["layer"] < end]
    require(not strangers, f"layers outside of the region: {strangers}")


def check_folder(folder):
    manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    layers = manifest["layers"]
    check_region(manifest)
    first = layers[0]["layer"]
    require([layer["layer"] for layer in layers] == list(range(first, first + len(layers))), "layers aren't numbered in order")
    named = set()
    for layer in layers:
        for plane, file in zip(manifest["planes"], layer["planes"], strict=True):
            path = folder / file["file"]
            data = path.read_bytes()
            named.add(path.name)
            require(re.fullmatch(rf"layer_0*{layer['layer']}_.*", path.name), f"{path.name} is of layer {layer['layer']}")
            require(len(data) == file["file_bytes"], f"{path.name} has {len(data)} bytes")
            require(hashlib.sha256(data).hexdigest() == file["sha256"], f"{path.name} has another digest")
            if path.suffix == ".png":
                check_picture(path, plane, layer, manifest)
        if "material_voxels" in layer:
            require(sum(layer["material_voxels"]) == layer["voxel_count"], f"histogram of layer {layer['layer']}")
    for index, material in enumerate(manifest.get("materials", [])):
        total = sum(layer["material_voxels"][index] for layer in layers)
        require(total == material["voxel_count"], f"{material['name']}: {total} voxels")
    strangers = {path.name for path in folder.glob("layer_*.*") if "_contours." not in path.name} - named
    require(not strangers, f"files that the manifest doesn't name: {strangers}")
    return manifest


def check_dates(archive):
    require(archive.testzip() is None, "a damaged archive")
    require({info.date_time for info in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}, "an archive with dates")


def check_gcvf(path, manifest):
    with zipfile.ZipFile(path) as archive:
        check_dates(archive)
        layers = len(manifest["layers"])
        require(set(archive.namelist()) == {"ConfigFile.xml", *(f"layer_{i}.png" for i in range(layers))}, f"{path.name}: entries")
        config = xml.etree.ElementTree.fromstring(archive.read("ConfigFile.xml"))
        size = tuple(int(config.find(name).text) for name in ("Width", "Height", "SliceCount"))
        require(size == (manifest["region"]["columns"], manifest["region"]["rows"], layers), f"{path.name}: {size}")
        found = {m.get("Name"): int(m.find("VoxelCount").text) for m in config.iter("Material")}
        require(found == {m["name"]: m["voxel_count"] for m in manifest["materials"]}, f"{path.name}: {found}")


def relations(archive, name):
    root = xml.etree.ElementTree.fromstring(archive.read(name))
    return {relation.get("Target").lstrip("/") for relation in root.iter(RELATIONSHIP)}


def check_mesh(model):
    """Closed: every edge is run along once in each direction."""
    mesh = next(model.iter(f"{CORE}mesh"))
    vertices = len(list(mesh.iter(f"{CORE}vertex")))
    edges = collections.Counter()
    for triangle in mesh.iter(f"{CORE}triangle"):
        corners = [int(triangle.get(name)) for name in ("v1", "v2", "v3")]
        require(max(corners) < vertices, "a triangle of vertices that aren't there")
        edges.update(zip(corners, corners[1:] + corners[:1]))
    require(edges and all(n == 1 and edges[b, a] == 1 for (a, b), n in edges.items()), "the mesh isn't closed")


def check_3mf(path, manifest):
    with zipfile.ZipFile(path) as archive:
        check_dates(archive)
        names = set(archive.namelist())
        require({"[Content_Types].xml", "_rels/.rels", "3D/3dmodel.model", "3D/_rels/3dmodel.model.rels"} <= names, f"{path.name}: parts")
        require(relations(archive, "_rels/.rels") == {"3D/3dmodel.model"}, "the package's relationships")
        model = xml.etree.ElementTree.fromstring(archive.read("3D/3dmodel.model"))
        sheets = [sheet.get("path").lstrip("/") for sheet in model.iter(f"{VOLUMETRIC}imagesheet")]
        require(relations(archive, "3D/_rels/3dmodel.model.rels") == set(sheets), "the model's relationships")
        require(set(sheets) == {name for name in names if name.endswith(".png")}, "sheets")
        grid = manifest["region"]
        for stack in model.iter(f"{VOLUMETRIC}imagestack"):
            size = [int(stack.get(key)) for key in ("columncount", "rowcount", "sheetcount")]
            require(size == [grid["columns"], grid["rows"], len(manifest["layers"])], f"a stack of {size}")
            require(len(list(stack)) == size[2], "sheets of a stack")
        for sheet in sheets:
            with archive.open(sheet) as file, Image.open(file) as picture:
                require(picture.mode == "L" and picture.size == (grid["columns"], grid["rows"]), f"{sheet}: {picture.mode}")
        ids = [element.get("id") for element in next(model.iter(f"{CORE}resources"))]
        require(len(ids) == len(set(ids)), "resources of one id")
        functions = {f.get("id") for f in model.iter(f"{VOLUMETRIC}functionfromimage3d")}
        mappings = [m.get("functionid") for m in model.iter(f"{VOLUMETRIC}materialmapping")]
        require(set(mappings) <= functions and len(mappings) == len(list(model.iter(f"{CORE}base"))), "mixing ratios")
        check_mesh(model)


def main():
    manifest = check_folder(pathlib.Path(sys.argv[1]))
    for name in map(pathlib.Path, sys.argv[2:]):
        (check_gcvf if name.suffix == ".gcvf" else check_3mf)(name, manifest)
    print(f"{len(manifest['layers'])} layers, {len(sys.argv) - 2} packages: as they should be")


main()
