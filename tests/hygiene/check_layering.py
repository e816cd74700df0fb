#!/usr/bin/env python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Checks who includes whom. The packages share one include directory, so nothing else keeps the layers apart.

core      std, Eigen, TBB, zstd, libdeflate, zlib and pugixml (in core/mesh), OpenImageIO (in one source
          file). Silent: no logging, printing or exiting.
server    core, proto, gRPC, spdlog. Never client.
client    proto, gRPC. Never core or server; the command line (client/cli) may use core/mesh, core/base and
          core/job/printer_profile.h, core/prepare/bezier_cells.h, core/prepare/deviation.h,
          core/prepare/preparation_progress.h, core/output/png.h, core/output/region_colours.h, core/vertex_fit/vertex_fit.h and core/subdivision/refined_mesh.h.

Nowhere do headers or folders include each other in a circle, and some headers are private to their folder.
"""

import re

import source_tree

INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]')
NOISE = re.compile(r"std::(cout|cerr|clog|exit|abort|terminate|quick_exit)\b|(?<![\w:.>])(printf|fprintf|puts|abort|exit)\s*\(")

RPC = r"(grpc|grpcpp|google|proto|ccslice/v1|ccslice)/|.*\.(grpc\.)?pb\.h$"

CLI_USES = (
    r"core/((base|mesh|mesh_import|mesh_files|mesh_authoring|models|volume_files)/|(job/printer_profile|output/png|output/region_colours"
    r"|prepare/(bezier_cells|deviation|preparation_progress|prepare_solid)|subdivision/refined_mesh|vertex_fit/vertex_fit)"
    r"\.h$)"
)

# Folder -> (what its files must not include, what is excepted from that).
FORBIDDEN = {
    "core": (RPC + r"|spdlog/|fmt/|iostream$|(server|client|tests)/", r"$^"),
    "server": (r"(client|tests)/", r"$^"),
    "client": (r"(server|core|tests)/|(Eigen|tbb|oneapi|OpenImageIO)/", r"$^"),
    "client/cli": (r"(server|tests)/|core/", CLI_USES),
}

# Header -> the folders or files that may include it, besides tests. Sampling blocks walks down a cell's rings itself.
PRIVATE = {
    "core/prepare/prepare.h": ("core/prepare",),
    "core/limit/solid_data.h": (
        "core/limit", "core/prepare", "core/interpolation/samples/block_stencils.h",
        "core/interpolation/samples/brick_blocks.cpp", "core/interpolation/samples/cell_block.cpp",
        "core/interpolation/samples/line_residuals.h", "core/interpolation/samples/voxel_blocks.cpp"),
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


def private_includes(path):
    return [
        f"{path}:{number}: {header} is private to {' and '.join(PRIVATE[header])}"
        for number, header in includes(path)
        if header in PRIVATE and path.parts[0] != "tests" and not any(map(path.is_relative_to, PRIVATE[header]))
    ]


def folder_of(path):
    return str(path.parent)


def uses_of(sources, name_of):
    """Who includes whom among our own; names by name_of(path)."""
    known = {str(path): name_of(path) for path in sources if path.suffix == ".h"}
    uses = {}
    for path in sources:
        used = {known[header] for _, header in includes(path) if header in known}
        uses.setdefault(name_of(path), set()).update(used - {name_of(path)})
    return uses


def cycle_in(uses):
    """Names that lead back to the first of them, if there are any."""
    done = set()

    def walk(name, trail):
        if name in trail:
            return trail[trail.index(name):] + [name]
        if name in done:
            return None
        for used in sorted(uses.get(name, ())):
            cycle = walk(used, trail + [name])
            if cycle:
                return cycle
        done.add(name)
        return None

    return next(filter(None, (walk(name, []) for name in sorted(uses))), None)


def cycles(sources):
    ours = [path for path in sources if path.parts[0] in ("core", "server", "client")]
    headers = [path for path in ours if path.suffix == ".h"]
    found = {"headers": cycle_in(uses_of(headers, str)), "folders": cycle_in(uses_of(ours, folder_of))}
    return [f"{what} include each other in a circle: " + " -> ".join(cycle) for what, cycle in found.items() if cycle]


def main():
    sources = source_tree.files(".h", ".cpp")
    findings = image_library_users(sources) + cycles(sources)
    for path in sources:
        findings += forbidden_includes(path) + private_includes(path) + noise(path)
    source_tree.finish(findings)


main()
