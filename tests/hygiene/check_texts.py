#!/usr/bin/env python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Checks what every file has to have and what none may: licence headers, include guards, unfinished marks, build files
that list each source, no addresses of package registries, no paths of somebody's machine, nothing that the fuzz targets'
compiler can't take, lines of prose, of the contract and of C++ that fit the width (clang-format leaves comments as
they are)."""

import re

import source_tree

COPYRIGHT = "SPDX-FileCopyrightText: The ccslice authors"
LICENSE = "SPDX-License-Identifier: Apache-2.0"
CODE = (".h", ".cpp", ".proto", ".py", ".sh", ".cmake", "CMakeLists.txt")
WRAPPED = (".md", ".proto", ".h", ".cpp")
COLUMNS = 120
TEXTS = CODE + (".md", ".json", ".yaml", ".yml", ".in", "run")

# The checks' own patterns are assembled so that they don't find themselves.
MARKS = re.compile("|".join(["TO" + "DO", "FIX" + "ME", "XX" + "X"]))
GLOB = re.compile(r"file\s*\(\s*GL" + "OB", re.IGNORECASE)
REGISTRY = re.compile(r"https?://(registry\.|[\w.-]*(pypi|npmjs|artifact)[\w.-]*)|\"resol" + "ved\"")
# What makes a std::ranges::subrange: Clang 14 can't compile that with GCC 12's library, and the fuzz targets are built so.
SUBRANGE = re.compile(r"std::(views::|ranges::(uni" + r"que|remove|remove_if|partition|rotate|equal_range|search|subrange)\b)")
MACHINE_PATH = re.compile(r"(?<![\w./$}])/(home|root|wo" + r"rk)/\w")


def header(path):
    """The two licence lines, after a #! line if there is one. Vendored protos keep their own."""
    head = "\n".join(text for _, text in list(source_tree.lines(path))[:4])
    if "third_party" in path.parts or "google" in path.parts:
        return []
    return [] if COPYRIGHT in head and LICENSE in head else [f"{path}:1: the two SPDX lines are missing"]


def guard(path):
    if path.suffix != ".h":
        return []
    code = [text for _, text in source_tree.lines(path) if text and not text.startswith("//")]
    return [] if code and code[0] == "#pragma once" else [f"{path}:1: the first code line isn't #pragma once"]


def unwanted(path):
    patterns = [(MARKS, "an unfinished mark"), (REGISTRY, "a package registry's address"), (MACHINE_PATH, "a path of one machine")]
    if path.suffix in (".h", ".cpp"):
        patterns.append((SUBRANGE, "a subrange, which Clang 14 can't compile here; take the function of std"))
    if path.name == "CMakeLists.txt" or path.suffix == ".cmake":
        patterns.append((GLOB, "sources by pattern instead of by name"))
    return [
        f"{path}:{number}: {what}: {text.strip()[:100]}"
        for number, text in source_tree.lines(path)
        for pattern, what in patterns
        if pattern.search(text)
    ]


def too_wide(path):
    """Rows of tables can't be wrapped."""
    return [
        f"{path}:{number}: {len(text)} columns, more than {COLUMNS}"
        for number, text in source_tree.lines(path)
        if len(text) > COLUMNS and not text.startswith("|")
    ]


def unlisted_sources():
    """Source files that no CMakeLists.txt above them names: they would never be compiled."""
    build_files = source_tree.files("CMakeLists.txt")
    texts = {path.parent: (source_tree.ROOT / path).read_text(encoding="utf-8") for path in build_files}
    findings = []
    for source in source_tree.files(".cpp"):
        named = any(source.is_relative_to(folder) and str(source.relative_to(folder)) in text for folder, text in texts.items())
        if not named:
            findings.append(f"{source}: no CMakeLists.txt names it")
    return findings


def main():
    findings = unlisted_sources()
    for path in source_tree.files(*CODE):
        findings += header(path)
    for path in source_tree.files(*WRAPPED):
        findings += too_wide(path)
    for path in source_tree.files(*TEXTS):
        findings += guard(path) + unwanted(path)
    source_tree.finish(findings)


main()
