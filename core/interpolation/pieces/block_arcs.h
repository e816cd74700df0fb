// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Arcs through five equidistant nodes of a block (interpolation/samples/block_nodes.h), and how far chords between them
// are off. A chord of length L from node to node of an arc f is off by
//
//   chord - f = t (1 - t) (4 m + k (t - 1/2)),    m = f'' L^2 / 8 in its middle,    k = f''' L^3 / 6,    0 <= t <= 1,
//
// if f is a cubic, as in one patch; m and k follow from second and third differences. An arc with an inflection in its
// middle has m = 0, and is off all the same.

#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/base/lanes.h"
#include "core/base/types.h"
#include "core/interpolation/samples/block_nodes.h"

namespace ccslice {

/// The second differences of numbers, or of points, at the inner nodes of an arc.
template <typename Value>
struct ArcBends {
  std::array<Value, kBlockNodes - 2> at;

  /// Of the chord from node `from` to the step-th from there: m. Beyond the inner nodes second differences are taken to
  /// go on linearly.
  Value middle(std::size_t from, std::size_t step) const {
    const auto& [first, second, third] = at;
    if (step == kBlockNodes - 1) return 0.5 * (first + 2 * second + third);
    if (step > 1) return 0.5 * (from == 0 ? first : third);
    if (from == 0) return (3 * first - second) / 16;
    if (from == kBlockNodes - 2) return (3 * third - second) / 16;
    return (at[from - 1] + at[from]) / 16;
  }
};

/// `node(n)`: of the arc's five.
template <typename Value, typename Node>
ArcBends<Value> bends_of(const Node& node) {
  ArcBends<Value> bends;
  for (std::size_t n = 0; n < bends.at.size(); ++n) bends.at[n] = node(n) - 2 * node(n + 1) + node(n + 2);
  return bends;
}

inline ArcBends<double> across(const Eigen::RowVector3d& row, const ArcBends<Vec3>& bends) {
  return {{row.dot(bends.at[0]), row.dot(bends.at[1]), row.dot(bends.at[2])}};
}

/// By the length of the chord: L^3 / 6 of third derivatives.
inline double of_third_differences(std::size_t step) {
  const auto length = static_cast<double>(step);
  return length * length * length / 6;
}

/// k, of whichever third difference is larger.
inline double cubic_of(const ArcBends<double>& bends, std::size_t step) {
  const double rising = bends.at[1] - bends.at[0], falling = bends.at[2] - bends.at[1];
  return of_third_differences(step) * (std::abs(rising) > std::abs(falling) ? rising : falling);
}

inline Lanes cubic_of(const ArcBends<Lanes>& bends, std::size_t step) {
  const Lanes rising = bends.at[1] - bends.at[0], falling = bends.at[2] - bends.at[1];
  return of_third_differences(step) * (absolute(rising) > absolute(falling) ? rising : falling);
}

/// A chord's largest height over its arc, and where: t. 0 if it is nowhere above.
struct HighestOverArc {
  double height, share;
};
inline HighestOverArc highest_over_arc(double middle, double cubic) {
  if (0.5 * std::abs(cubic) <= -4 * middle) return {0, 0.5};
  const double from_middle = cubic / (2 * (8 * middle + std::sqrt(64 * middle * middle + 3 * cubic * cubic)));
  return {(0.25 - from_middle * from_middle) * (4 * middle + cubic * from_middle), 0.5 + from_middle};
}

/// The same of four chords, a lane each.
struct HighestOverArcs {
  Lanes height, share;
};
inline HighestOverArcs highest_over_arcs(Lanes middle, Lanes cubic) {
  const Lanes from_middle = cubic / (2 * (8 * middle + square_root(64 * middle * middle + 3 * cubic * cubic)));
  const Lanes height = (0.25 - from_middle * from_middle) * (4 * middle + cubic * from_middle);
  const auto above = 0.5 * absolute(cubic) > -4 * middle;
  return {above ? height : Lanes{}, 0.5 + (above ? from_middle : Lanes{})};
}

}  // namespace ccslice
