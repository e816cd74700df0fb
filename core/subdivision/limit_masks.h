// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// LIMIT MASKS: what each control point weighs in the limit point of a vertex, which is where subdivision takes it in
// the end. Of a vertex of the boundary only control points of the boundary weigh anything.
//
// A vertex's limit depends on the points around it one refinement on: itself, one on each edge, face and cell at it.
// There all cells are hexahedra, whatever they were. Let A be one more step among these points; then the mask over them
// is the row l with l A = l and sum 1. Where the vertex lies regularly, l is known; v, e, f, c stand for the weights of
// the vertex, of each point on an edge, on a face, in a cell, and all are divided by their sum.
//
//   interior, n cells round     v = 4 n^2; e = n^2 along the line, 16 across; f = 4; c = 1     [product of a surface's
//   a straight line             mask and (1, 4, 1)]; n = 4 is the regular vertex
//   smooth boundary, k edges    v = k^2, e = 4, f = 1                                   [Halstead, Kass, DeRose 1993]
//   two sharp edges to a and b  (a + 4 P + b) / 6
//   three or more, or tagged    P
//
// Elsewhere (vertices where irregular lines meet, and ends of sharp edges) the row is iterated: l A needs no matrix, as
// each rule hands its weight to the means that it is made of, and each mean to its points.

#pragma once

#include <span>

#include "core/base/cancellation.h"
#include "core/mesh/cell_complex.h"
#include "core/subdivision/stencils.h"

namespace ccslice {

/// Row v: the limit point of vertex v from the control points. Weights are good to 1e-14. Takes some microseconds for a
/// vertex, some tens where irregular lines meet. REQUIRES: no cut-out. Throws Error{kCancelled}.
Stencils limit_masks(const CellComplex& complex, const CancellationToken& cancel = {});
/// Row n: that of vertices[n]. REQUIRES: they are complete.
Stencils limit_masks(const CellComplex& complex, std::span<const VertexId> vertices,
                     const CancellationToken& cancel = {});

/// Row n: the limit of the middle of the n-th face of the boundary, by number, where its point of the next refinement
/// goes. REQUIRES: no cut-out. Throws Error{kCancelled}.
Stencils boundary_face_masks(const CellComplex& complex, const CancellationToken& cancel = {});

}  // namespace ccslice
