// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Directions of the edges of cell regions where cells are inverted (allow_folds). The frames of neighbouring faces may
// contradict each other there, so that the edges of a region neither close nor give a winding number. The contours of
// one region are closed lines through the crossings of the leaf mesh, whatever the directions are; so each line gets
// that of most of its segments, as loops of the boundary do (contour_stitcher.h). An interface may turn round for one
// of its regions alone: then it becomes an edge for each. Where a region touches itself in an edge, its lines meet in a
// crossing, but don't cross there.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/contour/contour.h"

namespace ccslice {

/// What one leaf adds to the edges of regions: some that follow each other, all with the same regions beside them.
struct RegionSegment {
  std::uint32_t from = 0, to = 0;  // Crossings, as ContourStitcher numbers them.
  std::size_t begin = 0, end = 0;  // Among the edges.
};

/// A region one of whose lines has an end keeps its edges as they are. REQUIRES: `segments` have all edges, in their
/// order; `crossings` is above all of theirs.
void orient_regions(std::span<const RegionSegment> segments, std::size_t crossings, std::vector<RegionEdge>& edges);

}  // namespace ccslice
