// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Rings and stars from where equal topologies agree to start, so that they get equal keys and share one operator: of
// several possible cells and frames the one that gives the smallest key.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh/cell_complex.h"
#include "core/subdivision/frame.h"
#include "core/subdivision/key_hash.h"
#include "core/subdivision/ring.h"

namespace ccslice {

struct FramedLineRing {
  LineRing ring;
  Frame frame;
};

struct FramedVertexRing {
  VertexRing ring;
  Frame frame;
};

/// Which of several starts gives the smallest key, by the key that the first one gives: a key tells the whole topology,
/// so rings whose first keys are equal needn't be walked from all their starts again. One thread.
struct KnownStarts {
  /// By the first one's key, followed by where the starts are, seen from it: the number of the best one.
  TableByKey<std::size_t> of_lines, of_vertices;
};

/// The ring of a line cell whose line is that local edge, from one of the line's ends.
FramedLineRing canonical_line_ring(RingWalker& walker, KnownStarts& known, CellId cell, std::uint8_t edge);

/// The star of a vertex. Where many cells meet, only some starts are tried: then equal stars may have different keys.
/// REQUIRES: hexahedra at the vertex, which is complete.
VertexStar canonical_star(RingWalker& walker, VertexId vertex);

/// The ring of a vertex cell with that irregular vertex. `star`: the points of the vertex's star.
FramedVertexRing canonical_vertex_ring(RingWalker& walker, KnownStarts& known, CellId cell, VertexId vertex,
                                       std::span<const VertexId> star);

}  // namespace ccslice
