// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The sign of det J towards an irregular line, all along it.
//
// Beside its line a volume is a planar subdivision scheme times a cubic B-spline along w, and d/dw tends to the
// derivative of the line itself, c'(w). Many levels down the planar derivatives are, to leading order, sums of a few
// functions of direction and level times vectors that follow from the control points, and det J a sum of their
// determinants. At one place beside the line it is a polynomial of degree 8 in w, whose sign its Bernstein coefficients
// prove. At which places one has to look follows from what kind of a line it is:
//
// INSIDE. Two vectors a(w), b(w): the characteristic map's, which doesn't fold. So for all directions and levels det J
// has the sign of det(a, b, c'), and one place shows it.
//
// SMOOTH BOUNDARY. Again two vectors, but where the matrix has a Jordan block one of them is a sum b + n d that grows
// with the level n: with one hexahedron d follows from how the boundary curves. Up to a factor det J is linear in n, so
// it has one sign at all levels between two if it has that at both.
//
// SHARP. Three vectors: the boundary's derivatives q-(w) and q+(w) on either side, which are independent, and one
// inwards. With two hexahedra a ramp along the boundary goes on inside like r (t cos t + log r sin t), as harmonic
// functions do: d/dv is b + (n k + h) (q+ - q-) with k > 0 and a bounded h, and d/du goes from q- to q+ as the
// direction does. So
//     det J = (n k + h) det(q-, q+, c') + s det(q+, b, c') + (1 - s) det(q-, b, c'),  0 <= s <= 1,
// and reentrant edges, where det(q-, q+, c') < 0, fold at some level, however blunt they are. It is linear in n and in
// s, so that one has to look along both faces of the cell, and between, at the first and at the last level.
//
// What the scheme does is composed once for each operator, less the limit on the line and doubled at every level, so
// that nothing cancels however deep. A look at one place then costs less than a patch.

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/limit/fold_search.h"
#include "core/limit/solid_data.h"

namespace ccslice {

/// One solid, one thread.
class LineFolds {
 public:
  static constexpr int kLevels = 8;       // Levels below the ring that is given.
  static constexpr int kLastLevels = 32;  // Levels where det J depends on the level: beyond, no voxel shows it.
  static constexpr int kFinest = 256;     // Parts of w; what can't be told there is undecided.

  /// At how many places and levels to look: as many as the kind of line needs, or at one.
  enum class Views { kAll, kFirst };

  explicit LineFolds(const LimitSolid::Data& data) : data_(data), weights_(data.operators.lines().size()) {}

  /// `op`: of a line cell or sub-cell. `layers`: its four layers of points, phantoms filled, kPositionDimension doubles
  /// each. The determinant found is of d/du, d/dv, d/dw of that (sub-)cell.
  FoldFinding examine(std::uint32_t op, std::span<const double> layers, Views views = Views::kAll);

  /// The line of this operator is sharp.
  bool is_sharp(std::uint32_t op) const;

  using Weights = Eigen::MatrixXd;  // A row a point: in the line's position, then in d/du and d/dv of each view.
  const Weights& weights_of(std::uint32_t op);

 private:
  const LimitSolid::Data& data_;
  std::vector<Weights> weights_;  // By operator; empty until they are needed.
};

}  // namespace ccslice
