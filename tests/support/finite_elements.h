// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Finite elements by the shape functions of the textbooks (Zienkiewicz, Taylor, Zhu, "The Finite Element Method",
// chapter 6): linear tetrahedra, wedges and hexahedra; second-order ones with nodes on their edges (10, 15 and 20
// nodes), and with nodes on faces and in the middle too (18 and 27). An oracle for meshes that are taken as meshed.
//
// NATURAL COORDINATES: hexahedra -1..1 along each axis; tetrahedra the shares r, s, t of corners 1, 2, 3; wedges the
// shares r, s of corners 1, 2, and t = -1..1 along the third axis.

#pragma once

#include <cstdint>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include "core/mesh/control_mesh.h"

namespace ccslice::oracle {

class FiniteElements {
 public:
  /// REQUIRES: a mesh that is as meshed, as validate() leaves it. A cell has nodes on none or on all of its edges; and
  /// on all of its quadrilaterals and in its middle, or nowhere there. The mesh outlives it.
  explicit FiniteElements(const ControlMesh& mesh);

  /// x, y, z (mm), and the channels.
  std::vector<double> value(std::uint32_t cell, const Vec3& natural) const;
  Vec3 position(std::uint32_t cell, const Vec3& natural) const;
  /// The natural coordinates of a point, if the cell holds it, or misses it by rounding.
  std::optional<Vec3> find(std::uint32_t cell, const Vec3& point) const;
  /// By quadrature that is exact but for rounding, mm^3.
  double volume_mm3(std::uint32_t cell) const;
  /// A place in the cell.
  Vec3 random_place(std::uint32_t cell, std::mt19937& random) const;
  std::uint32_t cell_count() const { return static_cast<std::uint32_t>(mesh_.cell_count()); }

 private:
  Mat3 jacobian(std::uint32_t cell, const Vec3& natural) const;

  const ControlMesh& mesh_;
  std::size_t dimension_;
  std::vector<std::vector<double>> nodes_;  // By cell: values of its nodes, one after the other.
};

/// Nodes near the middles of all edges, moved by up to `share` of the edge, with values near the mean of its ends; and
/// of all quadrilaterals and hexahedra if `of_faces`.
void add_random_mid_nodes(double share, bool of_faces, std::uint32_t seed, ControlMesh& mesh);

}  // namespace ccslice::oracle
