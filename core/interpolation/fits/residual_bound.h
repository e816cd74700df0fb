// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A bound on what interpolation at a block's nodes leaves out of the error of a cubic polynomial, beside an irregular
// line (interpolation/samples/line_residuals.h).
//
// Position X and channel m aren't polynomials of the parameters there. Let I X and I m interpolate them at the block's
// nodes, with degree 4 along each axis, and X = I X + R, m = I m + s. The error of a cubic p is
//
//   m - p(X) = [I m - p(I X)] + [s - (p(I X + R) - p(I X))].
//
// The first part is a polynomial that has the errors at the nodes: BlockBound's. The second one is bounded here in each
// of the 4 x 4 x 4 boxes between the nodes. With some vector g for each box, by Taylor's theorem,
//
//   |second| <= |s - g.R| + |p'(I X) - g| |R| + |p''| |R|^2 / 2 + |p'''| |R|^3 / 6.
//
// Both s - g.R and R are sums of a_j(u, v) r_j(w) with bounded |a_j|. Where m is nearly a function of the position, s
// is nearly g.R if g is the gradient of p in that box, although both are large. For g that of p at I X is taken to
// first order in the parameters, about the block's middle and then at the box's: what it differs by is bounded by the
// Chebyshev coefficients of I X.
//
// Nothing here rounds up: the bound holds but for rounding.

#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "core/interpolation/fits/block_bound.h"
#include "core/interpolation/samples/cubic_polynomial.h"
#include "core/interpolation/samples/line_residuals.h"

namespace ccslice {

class ResidualBound {
 public:
  using AlongLine = BlockResiduals::AlongLine;

  /// `places`: of the nodes, in the frame of the polynomials. `frame_of_mm`: what becomes of the residuals' millimetres
  /// there. `residuals` stay where they are.
  void set_block(const std::array<BlockValues, 3>& places, const BlockResiduals& residuals, const Mat3& frame_of_mm);

  /// `channel`: the residuals of the channel.
  /// A bound, if that is at most `enough`; or else some number above it.
  double operator()(const CubicPolynomial& polynomial, std::span<const AlongLine> channel, double enough) const;

 private:
  /// Three numbers in each interval between two nodes along w, a lane each.
  using ByInterval = std::array<Lanes, 3>;
  /// A part of (u, v).
  struct Box {
    const PlanarResiduals::Part* part;
    ByInterval middle, reach;  // I X lies here,
    ByInterval largest;        // and |R| is no larger.
  };

  void place_residuals(const Mat3& frame_of_mm);
  void place_boxes(const std::array<BlockValues, 3>& places);
  ByInterval largest_in(const PlanarResiduals::Part& part) const;
  Lanes largest_off_gradient(const Box& box, const ByInterval& gradient, std::span<const AlongLine> channel) const;

  const BlockResiduals* residuals_ = nullptr;
  std::vector<std::array<std::array<Lanes, 3>, kBlockIntervals>> positions_;  // By j, by interval. In the frame.
  std::vector<Box> boxes_;
};

}  // namespace ccslice
