#!/usr/bin/env python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Reads PNG files with other programs: Pillow, ImageMagick, and libpng's pngfix.

    check_png_readers.py FOLDER

Each NAME.png of the folder must show the colours of NAME.rgba, four bytes a voxel, and say 600 x 300 dots an inch.
"""

import pathlib
import subprocess
import sys

from PIL import Image


def check(picture):
    expected = picture.with_suffix(".rgba").read_bytes()
    with Image.open(picture) as image:
        image.load()
        if image.convert("RGBA").tobytes() != expected:
            sys.exit(f"Pillow sees something else in {picture.name}")
        if [round(dpi, 1) for dpi in image.info["dpi"]] != [600, 300]:
            sys.exit(f"Pillow sees {image.info['dpi']} dots an inch in {picture.name}")
    seen = subprocess.run(["convert", picture, "-depth", "8", "rgba:-"], check=True, capture_output=True).stdout
    if seen != expected:
        sys.exit(f"ImageMagick sees something else in {picture.name}")
    report = subprocess.run(["pngfix", picture], capture_output=True, text=True)
    if report.returncode or " OK " not in report.stdout:
        sys.exit(f"pngfix: {report.stdout}{report.stderr}")


def main():
    pictures = sorted(pathlib.Path(sys.argv[1]).glob("*.png"))
    for picture in pictures:
        check(picture)
    print(f"{len(pictures)} pictures as they should be")


main()
