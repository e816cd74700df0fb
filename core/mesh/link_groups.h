// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The LINK of a vertex shows how its cells hang together: a triangle for each cell, which share an edge where cells
// share a face. Where it is neither a disc nor a sphere it is cut into discs.
//
// Discs grow triangle by triangle. One fits if it shares one edge with the disc and its other vertex isn't there yet,
// or if it shares two or three edges. Growing in any order covers a disc or a sphere wholly [Danaraj & Klee 1978:
// 2-balls and 2-spheres are extendably shellable], so a link that is in order comes out as one group.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh/cell_complex.h"

namespace ccslice {

/// A face of a cell at the vertex.
struct LinkEdge {
  std::uint32_t beyond = kNone;    // The triangle on its other side, or kNone.
  std::uint32_t opposite = kNone;  // The link's vertex that isn't on it.
};

/// A cell there.
struct LinkTriangle {
  std::array<LinkEdge, 3> edges;
};

/// The triangles in groups each of which is a disc or a sphere.
struct LinkGroups {
  std::vector<std::uint32_t> groups;  // By triangle, from 0.
  std::uint32_t count = 0;
  std::size_t cuts = 0;  // Edges of the link between groups.
};

/// The groups with the fewest cuts of those that grow from different triangles.
LinkGroups group_link(std::span<const LinkTriangle> link);

/// The triangles in groups that edges hold together, whatever their shape.
LinkGroups fans_of_link(std::span<const LinkTriangle> link);

}  // namespace ccslice
