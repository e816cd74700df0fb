#!/usr/bin/env python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Checks who includes whom. The packages share one include directory, so nothing else keeps the layers apart.

core      std, Eigen, TBB, zstd, libdeflate, OpenImageIO (in one source file). Silent: no logging, printing or exiting.
server    core, proto, gRPC, spdlog. Never client.
client    proto, gRPC. Never core or server; the command line (client/cli) may use core/mesh and core/base.
core/*    the stages' folders include each other without cycles.
"""

import re

import source_tree

INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]')
NOISE = re.compile(r"std::(cout|cerr|clog|exit|abort|terminate|quick_exit)\b|(?<![\w:.>])(printf|fprintf|puts|abort|exit)\s*\(")

RPC = r"(grpc|grpcpp|google|proto|ccslice/v1|ccslice)/|.*\.(grpc\.)?pb\.h$"

# Folder -> (what its files must not include, what is excepted from that).
FORBIDDEN = {
    "core": (RPC + r"|spdlog/|fmt/|iostream$|(server|client|tests)/", r"$^"),
    "server": (r"(client|tests)/", r"$^"),
    "client": (r"(server|core|tests)/|(Eigen|tbb|oneapi|OpenImageIO)/", r"$^"),
    "client/cli": (r"(server|tests)/|core/", r"core/(mesh|base)/"),
}


def rule_of(path):
    """The rule of the deepest folder that has one."""
    folders = [folder for folder in FORBIDDEN if path.is_relative_to(folder)]
    return FORBIDDEN[max(folders, key=len)] if folders else None


def includes(path):
    for number, text in source_tree.lines(path):
        match = INCLUDE.match(text)
        if match:
            yield number, match.group(1)


def forbidden_includes(path):
    rule = rule_of(path)
    if not rule:
        return []
    forbidden, excepted = map(re.compile, rule)
    return [
        f"{path}:{number}: {path.parts[0]} must not include {header}"
        for number, header in includes(path)
        if forbidden.match(header) and not excepted.match(header)
    ]


def noise(path):
    if path.parts[0] != "core":
        return []
    return [
        f"{path}:{number}: core doesn't print or exit: {text.strip()}"
        for number, text in source_tree.lines(path)
        if NOISE.search(text.split("//")[0])
    ]


def image_library_users(sources):
    users = sorted({str(path) for path in sources for _, header in includes(path) if header.startswith("OpenImageIO/")})
    users = [user for user in users if not user.startswith("tests/")]
    return [f"OpenImageIO belongs behind one source file, not {users}"] if len(users) > 1 else []


def stage_cycle(sources):
    """A cycle among core's folders, if there is one."""
    uses = {}
    for path in sources:
        if path.parts[0] == "core" and len(path.parts) == 3:
            headers = [header.split("/") for _, header in includes(path)]
            uses.setdefault(path.parts[1], set()).update(
                parts[1] for parts in headers if parts[0] == "core" and len(parts) == 3 and parts[1] != path.parts[1])

    def walk(stage, trail):
        if stage in trail:
            return trail[trail.index(stage):] + [stage]
        for used in sorted(uses.get(stage, ())):
            cycle = walk(used, trail + [stage])
            if cycle:
                return cycle
        return None

    for stage in sorted(uses):
        cycle = walk(stage, [])
        if cycle:
            return ["core's stages include each other in a circle: " + " -> ".join(cycle)]
    return []


def main():
    sources = source_tree.files(".h", ".cpp")
    findings = image_library_users(sources) + stage_cycle(sources)
    for path in sources:
        findings += forbidden_includes(path) + noise(path)
    source_tree.finish(findings)


main()
