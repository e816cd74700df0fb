#!/usr/bin/env python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Checks that every unit of core has a test of its own: core/FOLDER/UNIT.h has tests/core/FOLDER/UNIT_test.cpp, which
includes it.

Units whose own test would repeat another's are in the table below, with the test that covers them. Units and tests go
by their names without folders: those are unique enough, and files may move.
"""

import re

import source_tree

INCLUDE = re.compile(r'^\s*#\s*include\s*"([^"]+)"')

# Unit -> (the tests that cover it, why it has none of its own).
COVERED = {
    # Values and constants, without anything that a test could break.
    "block_nodes": ("block_slots_test", "constants, and the order of nodes"),
    "boundary_face": ("boundary_surface_test", "structs; keys of places are compared there"),
    "control_mesh": ("validate_test", "a struct of arrays"),
    "curved_cells": ("as_meshed_test", "compared with finite elements of the textbooks there"),
    "engine_version": ("upload_test", "a constant"),
    "interpolation_spec": ("slab_materials_test", "a struct"),
    "layer_target": ("material_pass_test", "a struct; what it counts is compared there"),
    "mesh_file": ("read_mesh_test", "structs"),
    "operators": ("operator_table_test", "structs; operators of many meshes are looked at there"),
    "prepare_options": ("limit_solid_test", "a struct"),
    "shares": ("cell_fitter_test", "constants"),
    "slice_limits": ("validate_job_test", "constants"),
    "solid_data": ("limit_solid_test", "a struct; its queries are tested there"),
    "load_sample": ("volume_test", "loads a number; every reader's samples go through it"),
    "solid_sampler": ("values_off_map_test", "shares of volumes are compared there; outside_share_test too"),
    "volume_file": ("read_volume_file_test", "a struct"),
    "version": ("server_process_test", "a constant, which programs compare there"),
    "types": ("grid_test", "names of Eigen's types"),
    "float_points": ("triangle_lanes_test", "names of arrays"),
    "formula_error": ("formula_parser_test", "a column and a message"),
    "interval": ("interval_operations_test", "a struct"),
    "program": ("run_program_test", "structs and an enum"),
    "voxel_runs": ("occupancy_test", "structs"),
    "row_crossings": ("occupancy_test", "scan conversion is made of them; region_runs_test too"),
    "cell_class": ("classify_test", "an enum"),
    # A line or two.
    "contains": ("polyhedra_test", "std::find"),
    "corner_determinant": ("validate_test", "a formula; cells of every kind are inverted there"),
    "disjoint_sets": ("point_clusters_test", "sets of random points are compared there; connected_parts_test too"),
    "manifold": ("validate_test", "meshes of every fault are refused there; split_touching_test makes solids of others"),
    "find_named": ("channel_table_test", "channels are found by it"),
    "channel_source": ("channel_sources_test", "an interface; sources go through planes, maps and pictures there"),
    "face_cone": ("cell_averages_test", "a formula; volumes of cells are compared there, of solids in deviation_test"),
    "prefetch": ("same_bytes_test", "changes nothing but time"),
    "block_faces": ("block_shape_test", "its loops are those of shapes and scans"),
    "polling": ("encode_test", "constants; cancelled encoders are tested there"),
    "sparse_rows": ("packed_stencils_test", "sums of theirs are compared with those of stencils; stencils_test too"),
    "byte_counts": ("deflate_test", "wrong counts make streams that don't inflate"),
    # Parts of a unit whose test looks at each of them.
    "build_cells": ("limit_solid_test", "the first step of preparing"),
    "build_levels": ("limit_solid_test", "the levels that cells are built from; limit_oracle_test refines everything"),
    "cell_adder": ("limit_solid_test", "what build_cells does with each cell; level_test looks at the faces"),
    "find_bricks": ("cell_bricks_test", "fills what is looked at there"),
    "find_hulls": ("cell_hulls_test", "fills what is looked at there"),
    "find_folds": ("limit_solid_test", "folds are looked for there and in line_folds_test"),
    "byte_order": ("netcdf_file_test", "numbers of every type"),
    "id_ranges": ("limit_solid_test", "solids are the same for any number of threads"),
    "prepare": ("limit_solid_test", "declares the steps of preparing"),
    "prepare_solid": ("solid_preparation_test", "takes the steps, which are compared there"),
    "patch_path": ("limit_evaluator_test", "each evaluation finds its patch by it; line_folds_test walks it"),
    "vertex_folds": ("line_folds_test", "cells at the ends of sharp edges are sampled there"),
    "contour_tracer": ("contour_test", "contours of one layer after the other"),
    "ring_store": ("limit_solid_test", "rings are looked at there, and every evaluation reads them"),
    "cell_index": ("limit_solid_test", "a struct; its queries are tested there"),
    "piece_finder": ("cell_node_store_test", "pieces of slabs, whatever the store holds"),
    "slab_pieces": ("cell_node_store_test", "pieces of slabs, whatever the store holds; piece_cover_test asks them"),
    "tile_painter": ("tile_tree_builder_test", "every voxel that it paints is compared there"),
    "tile_particles": ("tile_fitter_test", "found, halved and forgotten there"),
    "part_planes": ("layer_slicer_test", "the pictures of whole layers"),
    "part_painter": ("layer_slicer_test", "layers of one part are what it paints"),
    "placed_part": ("layer_composer_test", "parts are composed there"),
    "pixel_colours": ("plane_painter_test", "colours of whole pictures; layer_painter_test too"),
    "preview_job": ("plane_painter_test", "what planes can't show is refused there"),
    "layer_scope": ("layer_slicer_test", "regions are compared with the whole there"),
    "zstd_frame": ("encode_test", "frames are read back there"),
    "colour_gamut": ("mixture_test", "its mixes are the table's"),
    "check_arrays": ("validate_test", "the first step of validating"),
    "offenders": ("validate_test", "what its errors name is compared there"),
    "abaqus_lines": ("read_abaqus_test", "keywords, continuations and includes"),
    "gmsh_elements": ("read_gmsh_test", "a table; each cell of it is read there"),
    "gmsh_node_data": ("read_gmsh_test", "a section of the file"),
    "medit_sections": ("medit_high_order_test", "a table; sections are read and refused there and in read_medit_test"),
    "set_members": ("abaqus_sets_test", "its bound is compared there and in gmsh_groups_test"),
    "gmsh_scanner": ("read_gmsh_test", "text and binary files are compared there"),
    "bezier_nodes": ("vtk_cells_test", "only those cells have control points"),
    "vtk_cell_types": ("vtk_cells_test", "a table; each type of it is read there"),
    "vtk_point_data": ("read_vtk_test", "a section of the file"),
    "vtk_scanner": ("read_vtk_test", "text and binary files are compared there"),
    "vtu_cells": ("read_vtu_test", "the cells of its pieces"),
    "vtu_document": ("read_vtu_test", "the elements and arrays of its files"),
    "deflate_block": ("deflate_test", "every stream is inflated there"),
    "image_file": ("image_file_oiio_test", "declares what that file implements"),
    "image_file_unavailable": ("encode_test", "refuses, in builds without OpenImageIO"),
    "printer_profile": ("printers_test", "a table of figures"),
    # The models' parts.
    "bracket_model": ("models_test", "a model"),
    "coyote_model": ("models_test", "a model"),
    "engine_model": ("models_test", "a model"),
    "grid_model": ("models_test", "a model"),
    "model_builder": ("models_test", "builds them"),
}


def units():
    """Name -> path without its ending."""
    return {path.stem: path.with_suffix("") for path in source_tree.files(".h", ".cpp", under="core")}


def includes(path):
    return {match.group(1) for _, text in source_tree.lines(path) if (match := INCLUDE.match(text))}


def missing_twin(path, sources):
    """What is wrong with a unit's test, or nothing."""
    twin = source_tree.pathlib.Path("tests", path.parent, f"{path.name}_test.cpp")
    header = path.with_suffix(".h")
    if twin not in sources:
        return f"{path}: has no {twin}"
    if header in sources and str(header) not in includes(twin):
        return f"{twin}: doesn't include {header}"
    return None


def main():
    sources = set(source_tree.files(".h", ".cpp"))
    tests = {path.stem for path in sources if path.parts[0] == "tests"}
    findings = []
    for name, path in sorted(units().items()):
        missing = missing_twin(path, sources)
        if missing and name not in COVERED:
            findings.append(f"{missing}: write it, or say in check_twins.py whose test covers it")
        if not missing and name in COVERED:
            findings.append(f"check_twins.py: {name} has a test of its own")
    for name, (test, _) in COVERED.items():
        if name not in units():
            findings.append(f"check_twins.py: there is no {name} in core")
        if test not in tests:
            findings.append(f"check_twins.py: there is no {test}, which is to cover {name}")
    source_tree.finish(findings)


main()
