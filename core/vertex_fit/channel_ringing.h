// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Channels that RING: fitted control values overshoot beside a step, and so does the limit between the vertices, where
// nothing says what it has to be. The limit is sampled where the points of one refinement go: at the vertices and in
// the middles of edges, faces and cells. On real meshes of tetrahedra and hexahedra twice as fine samples found the
// same extremes to a hundredth of the range.
//
// Ringing is told and not damped. Control values kept within the range of the vertices, widened by a tenth, hold the
// limit there as well, but no longer meet the vertices: on the plate of docs/from-cad.md they miss 250 of 1,250, by up
// to 0.42 of the range. Held at the ends of the range, as maps and planes hold them, values were then farther from the
// skin that is meant: 0.137 instead of 0.108 of the range (root of the mean square at the samples); for a skin of 4 mm
// on lower_arm.vtk 0.158 instead of 0.101.

#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/types.h"
#include "core/mesh/cell_complex.h"
#include "core/vertex_fit/vertex_system.h"

namespace ccslice {

/// A channel rings if its limit leaves the range that it has at the mesh's vertices by more than this share of it.
inline constexpr double kRingingShare = 0.1;

struct ChannelRinging {
  std::size_t channel = 0;
  double low = 0, high = 0;   // What the samples of the limit reach.
  double value = 0;           // The one that is farthest beyond, low or high, ...
  Vec3 place = Vec3::Zero();  // ... and where it is, mm, ...
  ControlCellId cell;         // ... in which cell.
};

/// The channels that ring, ascending. `points`: a row for each vertex of the control point's position, mm, and of its
/// channels. `ranges`: by channel the least and the greatest value at the mesh's vertices. `on_sampled`, if any, is
/// told how many of the cells have been sampled. Takes about a hundred microseconds a cell, and nothing if no channel's
/// control values leave the ranges that far: the limit lies among them. REQUIRES: no cut-out. Throws Error{kCancelled}.
std::vector<ChannelRinging> find_ringing(const CellComplex& complex, const VertexSystem::Values& points,
                                         std::span<const std::array<double, 2>> ranges,
                                         const CancellationToken& cancel = {},
                                         const std::function<void(std::size_t, std::size_t)>& on_sampled = {});

}  // namespace ccslice
