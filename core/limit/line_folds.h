// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The sign of det J towards an irregular line, all along it.
//
// Beside its line a volume is a planar subdivision scheme times a cubic B-spline along w. Many levels down the planar
// derivatives are, to leading order, those of the scheme's own (characteristic) map, which doesn't fold, times two
// vectors a(w) and b(w) that follow from the control points; d/dw tends to the derivative of the line itself, c'(w). So
// for every direction about the line, and for every level deep enough, det J has the sign of det(a, b, c')(w), and one
// direction at one deep level shows it. There det J is a polynomial of degree 8 in w, whose sign its Bernstein
// coefficients prove. What the scheme does in kLevels steps is composed once for each operator, so this costs less than
// a patch.

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
  static constexpr int kLevels = 8;    // Below the ring that is given.
  static constexpr int kFinest = 256;  // Parts of w; what can't be told there is undecided.

  explicit LineFolds(const LimitSolid::Data& data) : data_(data), rows_(data.operators.lines().size()) {}

  /// `op`: of a line cell or sub-cell. `layers`: its four layers of points, phantoms filled, kPositionDimension doubles
  /// each. The determinant found is of d/du, d/dv, d/dw of that (sub-)cell.
  FoldFinding examine(std::uint32_t op, std::span<const double> layers);

 private:
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, 3>;  // Weights of the points in the value, d/du and d/dv.
  const Rows& rows(std::uint32_t op);

  const LimitSolid::Data& data_;
  std::vector<Rows> rows_;  // By operator; empty until it is needed.
};

}  // namespace ccslice
