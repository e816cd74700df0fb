// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A cubic polynomial of the point for each channel of a block of forward samples (interpolation/samples/cell_block.h):
// least squares over its even nodes, judged at all of them. Half of the errors so are those of samples that the fit
// hasn't seen.

#pragma once

#include <array>
#include <cstddef>

#include "core/interpolation/samples/cell_block.h"
#include "core/interpolation/samples/cubic_polynomial.h"

namespace ccslice {

/// A set of axes as bits, bit a for axis a: all three.
inline constexpr unsigned kAllAxes = 7;

/// Fits many channels over the same places.
class BlockFitter {
 public:
  /// `places`: in the polynomials' frame, in [-1, 1]^3.
  void factorize(const std::array<BlockValues, 3>& places) noexcept;
  /// Returns the largest error at the nodes; infinity if the places leave the polynomial undetermined.
  double fit(const BlockValues& values, CubicPolynomial& polynomial) noexcept;
  /// Errors of the last fit.
  const BlockValues& errors() const noexcept { return errors_; }
  /// Along which axes to halve the block so that the last fit gets better (bit a: axis a): the fewest that are
  /// predicted to be enough or, where none are, to do about as well as all. `error`: the fit's, as a share of what is
  /// allowed. REQUIRES: the fit was finite.
  unsigned axes_to_halve(double error) const noexcept;

 private:
  void fill_normal_row(std::size_t r) noexcept;
  void eliminate() noexcept;
  void solve(CubicPolynomial& x) const noexcept;

  std::array<LaneTerms, kBlockGroups> terms_;
  // The normal equations, eliminated: what is right of the diagonal counts.
  std::array<std::array<double, kCubicTerms>, kCubicTerms> rows_;
  std::array<double, kCubicTerms> inverse_diagonal_;
  BlockValues errors_;
};

}  // namespace ccslice
