// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Edges that a fitted limit rounds although they look sharp. The limit of control points that were fitted to a mesh
// passes through its vertices, and is smooth between them unless edges are sharp. Of a round part that is right: it
// holds more than the flat faces between its vertices. Along the edges of a box the limit bulges out of the faces, and
// what it holds more is wrong. The mesh tells the two apart by how far its surface turns at an edge: where n faces go
// round a part it turns by 360/n degrees, at the edges of a box by 90.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "core/base/types.h"
#include "core/mesh/surface_rings.h"

namespace ccslice {

/// Fewer than five faces go round nothing that is meant to be round.
inline constexpr double kLeastRoundedDeg = 75;

struct RoundedEdges {
  std::size_t count = 0;
  Vec3 place = Vec3::Zero();  // The middle of the one where the surface turns most, mm.
  double turn_deg = 0;        // By so much, either way.
};

/// The edges of the surface, but for the sharp ones, where it turns by at least kLeastRoundedDeg. `place`: of the mesh
/// that the limit is to pass through. `sharp_edges`: in any order.
RoundedEdges find_rounded_edges(const SurfaceRings& rings, const PlaceOfVertex& place,
                                std::span<const std::array<std::uint32_t, 2>> sharp_edges);

/// "72 edges where the mesh turns by 75 degrees or more aren't sharp, and the limit bulges there; the most, by 90
/// degrees, near (1, 2, 3) mm". REQUIRES: there are some.
std::string describe(const RoundedEdges& rounded);

}  // namespace ccslice
