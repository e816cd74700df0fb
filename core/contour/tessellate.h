// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Triangles of the placed limit surface within a chord tolerance: for display, STL and 3MF.
//
// Every boundary face is halved in both directions until the chord bound (|S_ss| + 2 |S_st| + |S_tt|) / 8 of each leaf
// is below the tolerance: the largest distance between a patch over the unit square and the linear interpolation over
// either half of it [Filip, Magedson, Markot 1986]. A leaf with finer neighbours becomes a fan round its middle that
// takes in the neighbours' vertices, so the triangles close: vertices are identified by their exact dyadic place on the
// surface, never by comparing coordinates, and every edge of a triangle has exactly two triangles.

#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/ids.h"
#include "core/base/types.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

struct TessellationSummary {
  std::uint64_t vertices = 0;
  std::uint64_t triangles = 0;
};

/// A piece of the triangulation. Vertices are numbered in the order of their delivery, through all chunks; a triangle
/// may name vertices of this chunk and of earlier ones.
struct TessellationChunk {
  TessellationSummary whole;                            // What all chunks together hold.
  std::uint32_t first_vertex = 0;                       // Number of positions[0].
  std::vector<Vec3> positions;                          // On placement * limit surface, world mm.
  std::vector<CellParam> at;                            // Where each vertex lies in the limit volume.
  std::vector<float> channel_values;                    // Vertex-major: value[v * channel_count + channel].
  std::vector<std::array<std::uint32_t, 3>> triangles;  // Counter-clockwise from outside (mirrored placements too).
};

struct TessellationOptions {
  double tolerance_mm = 0.05;                // Largest distance between triangles and limit surface, world mm.
  std::uint32_t chunk_triangles = 8192;      // A chunk is delivered once it holds this many.
  std::uint64_t max_triangles = 50'000'000;  // More are refused before any is delivered.
  CancellationToken cancel = {};
};

/// What there will be, told before it is made.
struct TessellationBound {
  std::uint64_t leaves = 0;         // Exactly.
  TessellationSummary most;         // Vertices and triangles, at most.
  std::uint64_t scratch_bytes = 0;  // That tessellate() holds, besides what it delivers.
};

/// Calls visit(corners), counter-clockwise, for each leaf: triangles 0-1-2 and 0-2-3 of all leaves together are within
/// options.tolerance_mm of the surface, and the surface of them, but don't close. `faces`: of the boundary, or
/// interfaces. Throws as below, max_triangles apart.
void visit_leaves(const LimitSolid& solid, const Placement& placement, const TessellationOptions& options,
                  const IdRange<BoundaryFaceId>& faces, const std::function<void(const std::array<Vec3, 4>&)>& visit);

/// Halves the faces without keeping anything, in a part of the time of tessellate(). Throws as that does.
TessellationBound bound_tessellation(const LimitSolid& solid, const Placement& placement,
                                     const TessellationOptions& options);

/// Delivers the chunks in a canonical order, on the calling thread; what `deliver` throws passes through.
/// REQUIRES: placement passes validate_placement(). Throws Error{kToleranceInvalid} if the tolerance isn't positive and
/// finite, Error{kTooManyTriangles} if there would be more than options.max_triangles; Error{kCancelled}.
TessellationSummary tessellate(const LimitSolid& solid, const Placement& placement, const TessellationOptions& options,
                               const std::function<void(const TessellationChunk&)>& deliver);

/// Likewise, for whoever has bounded it before.
TessellationSummary tessellate(const LimitSolid& solid, const Placement& placement, const TessellationOptions& options,
                               const TessellationBound& bound,
                               const std::function<void(const TessellationChunk&)>& deliver);

}  // namespace ccslice
