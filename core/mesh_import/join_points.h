// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Points in one place become one vertex. Many programs write each cell, or each part of a partition, with points of its
// own; cells hang together by common vertices only, so such a file would be as many solids as it has cells.
//
// The points of a cluster (point_clusters.h) become one, in the middle of their box, which is where they all are if
// they agree to the bit. Nothing depends on their order but the numbers of vertices: a joined vertex has the place of
// its first point among all.
//
// Channels: where the values at joined points agree within a millionth of the channel's range, their middle holds.
// Else each cell region has its own (region_values.h), if those of its points agree. If they don't, nobody knows what
// is meant, and the mesh is refused.

#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/mesh/control_mesh.h"
#include "core/mesh_import/mesh_file.h"

namespace ccslice {

/// How near points have to be to be in one place, mm: a billionth of the diagonal of the mesh's box. Where all
/// coordinates are single-precision numbers it is two units in the last place of the largest one, but no more than a
/// millionth of the diagonal: programs that compute a point twice write such neighbours.
double same_place_mm(const ControlMesh& mesh);

/// How far points are apart that differ in the last digit of text, mm: where the coordinates take 6 to 9 decimal
/// digits, two units in the last place of the largest one; else 0. No more than a millionth of the diagonal, with 6
/// digits 20 and with 7 digits 2 millionths.
double last_digit_mm(const ControlMesh& mesh);

/// A cluster that is longer than the distance: each of its points is within the distance of another one only.
struct PointChain {
  std::size_t points = 0;
  double length_mm = 0;
  Vec3 place = Vec3::Zero();  // Its middle, mm.
};

struct JoinReport {
  std::size_t places = 0;        // Vertices that several points have become.
  std::size_t joined = 0;        // Points that are no vertices of their own any more.
  double farthest_apart_mm = 0;  // Of two joined points (PointCluster::length).
  std::size_t jumps = 0;         // Vertices where regions keep values of their own.
  std::size_t chains = 0;
  PointChain longest_chain;
  std::size_t bent_edges = 0;         // Edges, faces and cells with mid-nodes that are farther apart than the distance.
  double bent_by_mm = 0;              // How far at most.
  bool has_other_order = false;       // So far, and so many, that all mid-nodes are left out (is_another_order()).
  std::size_t disagreeing_edges = 0;  // Likewise with mid-nodes that disagree in a channel.
};

/// Joins points within `distance_mm` of each other. Sharp edges and vertices, region values, missed vertices, mid-nodes
/// and numbers.vertices go along. Throws, with the ids of vertices and cells before they were joined, and leaves the
/// mesh as it is then:
///   kMeshRepeatedVertex: two corners of one cell become one that are farther apart than `same_mm`. Others may, for
///     resolve_collapsed_cells() to say what is left of the cell. DEFAULT: none may.
///   kMeshInvertedCell: another cell becomes flat or folded, unless mesh.allow_folds or mesh.interpolating.
///   kMeshBadChannel: values disagree, and no regions keep them apart.
/// REQUIRES: the cells' vertices exist; region values pass check_region_values(); distance_mm >= 0.
JoinReport join_points(double distance_mm, ControlMesh& mesh, FileNumbers& numbers, std::optional<double> same_mm = {});

}  // namespace ccslice
