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
    background = manifest["slice_job"].get("printing", {}).get("background_rgba", 0x000000ff)
    rgba = [f"#{background:08x}"] + [material["rgba"] for material in manifest.get("materials", [])]
    return [tuple(bytes.fromhex(colour[1:])) for colour in rgba]


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
            outside = voxels - sum(layer["material_voxels"])
            require(counts == [outside, *layer["material_voxels"]], f"{path.name}: {counts}")


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
            printed = sum(count for count, material in zip(layer["material_voxels"], manifest["materials"])
                          if not material.get("leaves_empty"))
            require(printed == layer["voxel_count"], f"histogram of layer {layer['layer']}")
    for index, material in enumerate(manifest.get("materials", [])):
        total = sum(layer["material_voxels"][index] for layer in layers)
        require(total == material["voxel_count"], f"{material['name']}: {total} voxels")
    strangers = {path.name for path in folder.glob("layer_*.*") if "_contours." not in path.name} - named
    require(not strangers, f"files that the manifest doesn't name: {strangers}")
    return manifest


def check_dates(archive):
    require(archive.testzip() is None, "a damaged archive")
    require({info.date_time for info in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}, "an archive with dates")


# Fields of ConfigFile.xml in their order, as public writers of such archives have them.
GCVF = ["Version", "Resolution", "SliceDimensions", "SliceRange", "BitDepth", "MaxNumberOfColors", "DataSemantics",
        "CreationMode", "ImageFilePrefix", "MaterialList"]
GCVF_CONSTANTS = {"Version": "2", "SliceRange/StartIndex": "0", "BitDepth": "4", "MaxNumberOfColors": "6",
                  "DataSemantics": "Materials", "CreationMode": "MODEL_ONLY", "ImageFilePrefix": "layer_",
                  "MaterialList/BackGroundMaterialRGBA": "0 0 0 255"}


def colour_of(text):
    colour = tuple(int(number) for number in text.split(" "))
    require(len(colour) == 4 and all(0 <= number <= 255 for number in colour), f"the colour {text}")
    return colour


def check_gcvf_size(name, config, manifest):
    pitch, region = manifest["grid"]["pitch_mm"], manifest["region"]
    dots = [int(config.find(f"Resolution/{axis}Dpi").text) for axis in "XY"]
    require(all(abs(25.4 / n - mm) < 0.002 * mm for n, mm in zip(dots, pitch)), f"{name}: {dots} dpi for {pitch} mm")
    require(int(config.find("Resolution/SliceThicknessNanoMeter").text) == round(1e6 * pitch[2]), f"{name}: thickness")
    size = [int(config.find(f"SliceDimensions/Slice{side}").text) for side in ("Width", "Height")]
    require(size == [region["columns"], region["rows"]], f"{name}: {size}")


def check_gcvf(path, manifest):
    with zipfile.ZipFile(path) as archive:
        check_dates(archive)
        config = xml.etree.ElementTree.fromstring(archive.read("ConfigFile.xml"))
        require(config.tag == "GCVF" and [child.tag for child in config] == GCVF, f"{path.name}: fields")
        for field, value in GCVF_CONSTANTS.items():
            require(config.find(field).text == value, f"{path.name}: {field} is {config.find(field).text}")
        check_gcvf_size(path.name, config, manifest)
        layers = int(config.find("SliceRange/NumberOfSlices").text)
        require(layers == len(manifest["layers"]), f"{path.name}: {layers} layers")
        require(set(archive.namelist()) == {"ConfigFile.xml", *(f"layer_{i}.png" for i in range(layers))}, f"{path.name}: entries")
        require([child.tag for child in config.find("MaterialList")][0] == "BackGroundMaterialRGBA", f"{path.name}: background")
        materials = [[m.find(tag).text for tag in ("Name", "RGBA", "VoxelCount")] for m in config.iter("Material")]
        require(all([child.tag for child in m] == ["Name", "RGBA", "VoxelCount"] for m in config.iter("Material")), "a material")
        expected = [m["name"] for m in manifest["materials"] if m["voxel_count"] > 0]
        require([name for name, _, _ in materials] == expected, f"{path.name}: {materials}")
        palette = [(0, 0, 0, 255)] + [colour_of(rgba) for _, rgba, _ in materials]
        counted = numpy.zeros(len(palette), dtype=numpy.int64)
        for layer in range(layers):
            with Image.open(archive.open(f"layer_{layer}.png")) as picture:
                require(picture.mode == "RGBA", f"layer_{layer}.png is {picture.mode}")
                counted += material_counts(picture, palette)
        require(list(counted[1:]) == [int(count) for _, _, count in materials], f"{path.name} counts {counted}: {materials}")


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


def picture_of(archive, name):
    with archive.open(name) as file, Image.open(file) as picture:
        return numpy.asarray(picture)


def functions_of(model):
    """By their ids: the sheets, and what is added to samples from 0 to 1 once they are scaled."""
    images = {}
    for image in model.iter(f"{VOLUMETRIC}image3d"):
        images[image.get("id")] = [sheet.get("path").lstrip("/") for sheet in image.iter(f"{VOLUMETRIC}imagesheet")]
    return {f.get("id"): (images[f.get("image3did")], float(f.get("valueoffset")), float(f.get("valuescale")))
            for f in model.iter(f"{VOLUMETRIC}functionfromimage3d")}


def check_colour(model, pictures):
    """In linear light, the mean of the materials' colours, weighted by their ratios."""
    functions = functions_of(model)
    encoded = [[int(base.get("displaycolor")[at:at + 2], 16) / 255 for at in (1, 3, 5)] for base in model.iter(f"{CORE}base")]
    linear = [[c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055)**2.4 for c in colour] for colour in encoded]
    colour = next(model.iter(f"{VOLUMETRIC}color"))
    require(colour.get("channel") == "color", "the colour's channel")
    for layer, sheet in enumerate(functions[colour.get("functionid")][0]):
        mixed, total = 0, 0
        for mapping, light in zip(model.iter(f"{VOLUMETRIC}materialmapping"), linear):
            sheets, offset, scale = functions[mapping.get("functionid")]
            ratio = offset + scale * pictures[sheets[layer]].astype(float)[..., None] / 255
            mixed, total = mixed + ratio * numpy.array(light), total + ratio
        expected = numpy.where(total > 1e-9, mixed / numpy.maximum(total, 1e-9), 0)
        difference = numpy.abs(pictures[sheet] / 255 - expected).max()
        require(difference < 0.51 / 255, f"{sheet} is off by {difference}")


def check_properties(model, manifest):
    """One for each 8-bit channel, in its own unit."""
    functions = functions_of(model)
    found = [functions[p.get("functionid")][1:] for p in model.iter(f"{VOLUMETRIC}property")]
    planes = [plane for plane in manifest["planes"] if plane["content"] == "channel" and plane["sample_type"] == "u8"]
    ranges = [plane["value_range"] for plane in planes if plane["encoding"] == "png"]
    require(found == [(low, high - low) for low, high in ranges], f"properties of {found}, channels of {ranges}")


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
        pictures = {sheet: picture_of(archive, sheet) for sheet in sheets}
        for sheet, picture in pictures.items():
            require(picture.shape[:2] == (grid["rows"], grid["columns"]), f"{sheet}: {picture.shape}")
            require(picture.ndim == (3 if "/colour/" in sheet else 2), f"{sheet}: {picture.shape}")
        ids = [element.get("id") for element in next(model.iter(f"{CORE}resources"))]
        require(len(ids) == len(set(ids)), "resources of one id")
        functions = {f.get("id") for f in model.iter(f"{VOLUMETRIC}functionfromimage3d")}
        mappings = [m.get("functionid") for m in model.iter(f"{VOLUMETRIC}materialmapping")]
        require(set(mappings) <= functions and len(mappings) == len(list(model.iter(f"{CORE}base"))), "mixing ratios")
        check_colour(model, pictures)
        check_properties(model, manifest)
        check_mesh(model)


def main():
    manifest = check_folder(pathlib.Path(sys.argv[1]))
    for name in map(pathlib.Path, sys.argv[2:]):
        (check_gcvf if name.suffix == ".gcvf" else check_3mf)(name, manifest)
    print(f"{len(manifest['layers'])} layers, {len(sys.argv) - 2} packages: as they should be")


main()
