// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The contours of each cell region by itself: the edges of its boundary and of its interfaces, joined into loops.

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/types.h"
#include "core/contour/contour.h"

namespace ccslice {

/// Closed: the last point joins the first. Counter-clockwise round the region when seen from above the plane, clockwise
/// round what it leaves open. Regions that meet have the points of their interface in common, to the last bit.
struct RegionLoop {
  std::uint8_t region = 0;
  std::vector<Vec2> points;  // In the plane's coordinates, mm.
  std::uint32_t part = 0;    // Of a layer of several parts: whose it is.
};

/// By region, and for each region in a canonical order, whatever the order of the edges. Throws Error{kCancelled}, and
/// {kInternal} if the edges of a region don't close.
std::vector<RegionLoop> join_region_loops(std::span<const RegionEdge> edges, const CancellationToken& cancel = {});

}  // namespace ccslice
