#!/usr/bin/python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Takes a .gcvf apart by what is known of such archives, and by nothing of ours: an archive of ConfigFile.xml and of
pictures, whose fields and order are FIELDS, whose pictures are RGBA and are named layer_0.png, layer_1.png, ... Counts
the voxels of each material, and compares them with the archive's own counts and with the folder that it was made of.

    gcvf.py CCSLICE        (which finds its ccsliced by itself)
"""

import collections
import json
import pathlib
import struct
import subprocess
import sys
import tempfile
import xml.etree.ElementTree
import zipfile
import zlib

FIELDS = [
    ("Version", "2"),
    ("Resolution", ["XDpi", "YDpi", "SliceThicknessNanoMeter"]),
    ("SliceDimensions", ["SliceWidth", "SliceHeight"]),
    ("SliceRange", ["StartIndex", "NumberOfSlices"]),
    ("BitDepth", "4"),
    ("MaxNumberOfColors", "6"),
    ("DataSemantics", "Materials"),
    ("CreationMode", "MODEL_ONLY"),
    ("ImageFilePrefix", "layer_"),
    ("MaterialList", None),
]
BACKGROUND = (0, 0, 0, 255)
INCH_MM = 25.4
# Names that XML has to escape, and two resins of printers.
MATERIALS = {"soft & <clear>": "#00ffff", "VeroMGT-V": "#ff00ff", "\"hard\" 'grey'": "#808080"}
DPI, LAYER_MM = (600, 300), 0.027


def whole(element, path):
    return int(element.find(path).text)


class Picture:
    """A PNG of 8-bit RGBA samples, read with zlib alone."""

    def __init__(self, data):
        assert data[:8] == b"\x89PNG\r\n\x1a\n"
        chunks = collections.defaultdict(bytes)
        at = 8
        while at < len(data):
            length, kind = struct.unpack(">I4s", data[at:at + 8])
            body = data[at + 8:at + 8 + length]
            assert zlib.crc32(kind + body) == struct.unpack(">I", data[at + 8 + length:at + 12 + length])[0], kind
            chunks[kind] += body
            at += 12 + length
        self.width, self.height, *form = struct.unpack(">IIBBBBB", chunks[b"IHDR"])
        assert form == [8, 6, 0, 0, 0], f"not 8-bit RGBA: {form}"
        self.dots_a_metre = struct.unpack(">IIB", chunks[b"pHYs"])
        self.rows = self._rows(zlib.decompress(chunks[b"IDAT"]))

    def _rows(self, filtered):
        stride, rows, above = 4 * self.width, [], bytes(4 * self.width)
        assert len(filtered) == (stride + 1) * self.height
        for at in range(0, len(filtered), stride + 1):
            row = self._unfiltered(filtered[at], bytearray(filtered[at + 1:at + 1 + stride]), above)
            rows.append(bytes(row))
            above = row
        return rows

    @staticmethod
    def _unfiltered(kind, row, above):
        for i in range(len(row) if kind else 0):
            left, up, corner = (row[i - 4], above[i], above[i - 4]) if i >= 4 else (0, above[i], 0)
            paeth = min((left, up, corner), key=lambda near: abs(left + up - corner - near))
            row[i] = (row[i] + (left, up, (left + up) // 2, paeth)[kind - 1]) & 255
        return row

    def colours(self):
        """How many voxels have each colour."""
        counts = collections.Counter()
        for row in self.rows:
            counts.update(struct.iter_unpack("4B", row))
        return counts


def check_fields(config):
    assert config.tag == "GCVF", config.tag
    assert [child.tag for child in config] == [name for name, _ in FIELDS], [child.tag for child in config]
    for name, content in FIELDS:
        element = config.find(name)
        if isinstance(content, str):
            assert element.text == content, (name, element.text)
        elif content:
            assert [child.tag for child in element] == content, (name, [child.tag for child in element])
    assert whole(config, "SliceRange/StartIndex") == 0


def materials_of(config):
    """[(name, colour, voxels)], in their order."""
    background, *materials = config.find("MaterialList")
    assert background.tag == "BackGroundMaterialRGBA" and background.text == "0 0 0 255", background.text
    found = []
    for material in materials:
        assert material.tag == "Material" and [child.tag for child in material] == ["Name", "RGBA", "VoxelCount"]
        colour = tuple(int(number) for number in material.find("RGBA").text.split(" "))
        assert len(colour) == 4 and colour[3] == 255 and colour != BACKGROUND, colour
        found.append((material.find("Name").text, colour, whole(material, "VoxelCount")))
    assert 1 <= len(found) <= 6 and len({colour for _, colour, _ in found}) == len(found)
    return found


def check_picture(picture, config):
    assert picture.width == whole(config, "SliceDimensions/SliceWidth"), picture.width
    assert picture.height == whole(config, "SliceDimensions/SliceHeight"), picture.height
    x, y, unit = picture.dots_a_metre
    assert unit == 1
    for dots, axis in ((x, "XDpi"), (y, "YDpi")):
        assert abs(dots * INCH_MM / 1000 - whole(config, f"Resolution/{axis}")) < 0.02, (dots, axis)


def take_apart(path):
    """[(name, colour, voxels)], counted in the pictures."""
    with zipfile.ZipFile(path) as archive:
        assert archive.testzip() is None
        config = xml.etree.ElementTree.fromstring(archive.read("ConfigFile.xml"))
        check_fields(config)
        layers = whole(config, "SliceRange/NumberOfSlices")
        assert sorted(archive.namelist()) == sorted(["ConfigFile.xml", *(f"layer_{i}.png" for i in range(layers))])
        counted = collections.Counter()
        for layer in range(layers):
            picture = Picture(archive.read(f"layer_{layer}.png"))
            check_picture(picture, config)
            counted += picture.colours()
    materials = materials_of(config)
    assert counted.keys() <= {BACKGROUND, *(colour for _, colour, _ in materials)}, counted.keys()
    for name, colour, voxels in materials:
        assert counted[colour] == voxels > 0, (name, counted[colour], voxels)
    assert (whole(config, "Resolution/XDpi"), whole(config, "Resolution/YDpi")) == DPI
    assert whole(config, "Resolution/SliceThicknessNanoMeter") == round(1e6 * LAYER_MM)
    return materials


def main(ccslice):
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)

        def run(*words):
            subprocess.run([ccslice, *words, "--quiet"], check=True, cwd=folder, stdout=subprocess.PIPE)

        run("models", "box", "-o", "box.ccmesh")
        options = [word for pair in MATERIALS.items() for word in ("--material", "=".join(pair))]
        stops = ",".join(f"{value}={material}" for value, material in zip((0, 0.5, 1), MATERIALS))
        run("slice", "box.ccmesh", "--local", "--format", "grabcad", "--dpi", "600,300", "--layer-height", str(LAYER_MM),
            "--box-voxels", "0,0,100,560,20,4", *options, "--map", f"blend:gradient:{stops}", "-o", "layers")
        run("package", "layers", "-o", "box.gcvf")
        materials = take_apart(folder / "box.gcvf")
        manifest = json.loads((folder / "layers/manifest.json").read_text(encoding="utf-8"))
        ours = {material["name"]: material["voxel_count"] for material in manifest["materials"] if material["voxel_count"]}
        assert {name: voxels for name, _, voxels in materials} == ours, (materials, ours)
        print(json.dumps(ours))


main(sys.argv[1])
