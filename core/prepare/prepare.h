// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The steps from a validated control mesh to a prepared solid. Private to core/limit.

#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/cancellation.h"
#include "core/limit/solid_data.h"
#include "core/mesh/cell_complex.h"
#include "core/mesh/control_mesh.h"
#include "core/mesh/surface_rings.h"
#include "core/prepare/prepare_options.h"

namespace ccslice {

/// Refines where necessary, classifies, numbers the limit-ready cells, walks their rings and makes the operators; finds
/// the boundary faces. `complex`: the mesh's. Fills points, rings, cells, operators, faces, face_rings, face_hulls and
/// the counts of the summary. Returns what options.reserve was told at last, which is meant to do for the steps that
/// follow, too. Throws Error{kMeshTooComplex} if the rings outgrow 32-bit numbers, Error{kCancelled}, and what
/// options.reserve does.
std::uint64_t build_cells(const ControlMesh& mesh, CellComplex complex, const PrepareOptions& options,
                          LimitSolid::Data& data);

/// Fills boundary_vertices and interface_vertices, and the summary's bounding_box, deviation (deviation.h) and
/// cell_regions. REQUIRES: faces; `rings`: the mesh's, kept while cells were built, which takes the complex; a
/// thirtieth of what a face of the boundary is reckoned with there.
void measure_surface(const ControlMesh& mesh, const SurfaceRings& rings, const PrepareOptions& options,
                     LimitSolid::Data& data);

/// Fills cell_boxes, cell_maps and volumes.
void build_cell_boxes(const PrepareOptions& options, LimitSolid::Data& data);

/// Levels of patches looked at towards an irregular line or vertex.
inline constexpr int kFoldLevels = 3;

/// Looks for places where det J <= 0: fills fold_boxes and the summary's folds. REQUIRES: cell_boxes.
///
/// Conclusive for every patch that it looks at (fold_search.h): it folds, it doesn't, or it counts as undecided, which
/// the inversion treats as folding. It looks at the first kFoldLevels levels of patches towards an irregular line or
/// vertex (at one level along the lines of a vertex cell), and at the limit on all of each line (line_folds.h) and at
/// the vertex, which decides for all levels that are deep enough; where sharp edges lead to the vertex, at one level
/// after the other (vertex_folds.h). What can go unreported is a fold in the levels between that reaches neither:
/// within an eighth of a cell of a line or vertex (a quarter along the lines of a vertex cell), yet off it. Bounded by
/// a number of steps for each patch and for each range of cells.
void find_folds(const PrepareOptions& options, LimitSolid::Data& data);

/// Finds the cells whose boxes meet those of a separate part of the solid (one that shares no vertex): fills
/// overlap_boxes and parts. REQUIRES: cell_boxes.
void find_overlaps(const ControlMesh& mesh, const CancellationToken& cancel, LimitSolid::Data& data);

/// Finds cells that overlap although they don't touch, of one part or of several: fills the summary's overlaps, and
/// adds where cells of one part do to fold_boxes. It looks for faces of the boundary that cross (face_crossing.h) and
/// for parts in others, and goes on from there to all cells around. Overlaps less deep than kLeastOverlapMm
/// (cell_probe.h) aren't looked for, nor those of cells that touch: they are folds. Bounded by a number of points that
/// are looked for in cells. `solid`: of `data`. REQUIRES: all else but hulls_near_folds.
void find_overlapping_cells(const LimitSolid& solid, const PrepareOptions& options, LimitSolid::Data& data);

/// Fills bricks. REQUIRES: the summary's deviation and counts.
void find_bricks(const PrepareOptions& options, LimitSolid::Data& data);

/// Finds what the cells near fold_boxes consist of, as closely as `most_bytes` allow: fills hulls_near_folds, or leaves
/// them empty, which costs time near folds and changes nothing else. REQUIRES: cell_boxes, fold_boxes.
void find_hulls_near_folds(std::size_t most_bytes, const CancellationToken& cancel, LimitSolid::Data& data);

}  // namespace ccslice
