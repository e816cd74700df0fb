// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/fits/residual_bound.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <tuple>

namespace ccslice {
namespace {

using ByInterval = std::array<Lanes, 3>;

/// Derivatives of a cubic at four places. The third ones are the same everywhere.
struct Derivatives {
  ByInterval first;
  std::array<ByInterval, 3> second;
  std::array<std::array<std::array<double, 3>, 3>, 3> third;

  Derivatives(const CubicPolynomial& p, const ByInterval& at)
      : third{{{{{6 * p[19], 2 * p[17], 2 * p[18]}, {2 * p[17], 2 * p[13], p[14]}, {2 * p[18], p[14], 2 * p[15]}}},
               {{{2 * p[17], 2 * p[13], p[14]}, {2 * p[13], 6 * p[6], 2 * p[7]}, {p[14], 2 * p[7], 2 * p[8]}}},
               {{{2 * p[18], p[14], 2 * p[15]}, {p[14], 2 * p[7], 2 * p[8]}, {2 * p[15], 2 * p[8], 6 * p[9]}}}}} {
    const std::array<std::array<double, 3>, 3> second_in_middle = {
        {{2 * p[16], p[11], p[12]}, {p[11], 2 * p[3], p[4]}, {p[12], p[4], 2 * p[5]}}};
    const std::array<double, 3> first_in_middle = {p[10], p[1], p[2]};
    for (std::size_t a = 0; a < 3; ++a) {
      first[a] = Lanes{} + first_in_middle[a];
      for (std::size_t b = 0; b < 3; ++b) {
        Lanes change{};
        for (std::size_t c = 0; c < 3; ++c) change = multiply_add(at[c], third[a][b][c], change);
        second[a][b] = change + second_in_middle[a][b];
        first[a] = multiply_add(0.5 * change + second_in_middle[a][b], at[b], first[a]);
      }
    }
  }
};

/// Bounds the second part less (s - g.R), by Taylor's theorem: p's derivatives, and so g, are those at a box's middle,
/// I X lies within `reach` of it, and |R| is at most `left`.
Lanes rest_of(const Derivatives& p, const ByInterval& reach, const ByInterval& left) {
  Lanes rest{};
  for (std::size_t a = 0; a < 3; ++a) {
    Lanes of_axis{};
    for (std::size_t b = 0; b < 3; ++b) {
      Lanes third{}, of_left{};
      for (std::size_t c = 0; c < 3; ++c) {
        third = multiply_add(reach[c], std::abs(p.third[a][b][c]), third);
        of_left = multiply_add(left[c], std::abs(p.third[a][b][c]), of_left);
      }
      const Lanes second = absolute(p.second[a][b]);
      of_axis = multiply_add(second + 0.5 * third, reach[b], of_axis);
      of_axis = multiply_add(0.5 * (second + third) + of_left * (1.0 / 6), left[b], of_axis);
    }
    rest = multiply_add(of_axis, left[a], rest);
  }
  return rest;
}

double coefficient(const BlockGrid& grid, std::size_t i, std::size_t j, std::size_t k) {
  return grid[j + kBlockNodes * k][i / kLanes][i % kLanes];
}

/// Between two neighbouring nodes along each axis, a polynomial misses what is linear between the nodes along each axis
/// by no more than this.
double off_linear(const BlockGrid& coefficients) {
  // T'' is no larger than 4, 24 and 80, and intervals are half a unit long: an eighth of its square times that.
  constexpr std::array<double, kBlockNodes> kByDegree = {0, 0, 4.0 / 32, 24.0 / 32, 80.0 / 32};
  double off = 0;
  for (std::size_t n = 0; n < std::tuple_size_v<BlockPoints>; ++n) {
    const std::size_t i = n % kBlockNodes, j = n / kBlockNodes % kBlockNodes, k = n / kBlockNodes / kBlockNodes;
    off += (kByDegree[i] + kByDegree[j] + kByDegree[k]) * std::abs(coefficient(coefficients, i, j, k));
  }
  return off;
}

}  // namespace

void ResidualBound::set_block(const std::array<BlockValues, 3>& places, const BlockResiduals& residuals,
                              const Mat3& frame_of_mm) {
  residuals_ = &residuals;
  boxes_.clear();
  place_residuals(frame_of_mm);
  place_boxes(places);
}

void ResidualBound::place_residuals(const Mat3& frame_of_mm) {
  const std::size_t count = residuals_->planar->count();
  positions_.resize(count);
  for (std::size_t j = 0; j < count; ++j) {
    for (std::size_t n = 0; n < kBlockIntervals; ++n) {
      for (std::size_t a = 0; a < 3; ++a) {
        Lanes sum{};
        for (std::size_t b = 0; b < 3; ++b) {
          sum = multiply_add(residuals_->position[b][j][n],
                             frame_of_mm(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b)), sum);
        }
        positions_[j][n][a] = sum;
      }
    }
  }
}

void ResidualBound::place_boxes(const std::array<BlockValues, 3>& places) {
  const LineBox& box = residuals_->box;
  std::array<double, 3> off;
  // By u, v and w: residuals know the axes of the line's frame, places those of the cell.
  std::array<std::array<std::array<std::array<double, kBlockNodes>, kBlockNodes>, kBlockNodes>, 3> nodes;
  for (std::size_t c = 0; c < 3; ++c) {
    BlockGrid grid = grid_of(places[c]);
    for (std::size_t n = 0; n < std::tuple_size_v<BlockPoints>; ++n) {
      std::array<std::size_t, 3> at;
      for (std::size_t a = 0; a < 3; ++a) {
        at[a] = n / kBlockStride[box.axis[a]] % kBlockNodes;
        if (box.mirrored[a]) at[a] = kBlockNodes - 1 - at[a];
      }
      nodes[c][at[0]][at[1]][at[2]] = grid[n / kBlockNodes][n % kBlockNodes / kLanes][n % kBlockNodes % kLanes];
    }
    to_chebyshev(grid);
    off[c] = off_linear(grid);
  }
  for (const PlanarResiduals::Part& part : residuals_->planar->parts()) {
    // A function that is linear along each axis takes its extremes at a box's corners, and I X is off it by off[c].
    Box& held = boxes_.emplace_back(Box{&part, {}, {}, largest_in(part)});
    for (std::size_t c = 0; c < 3; ++c) {
      Lanes low{}, high{};
      for (unsigned corner = 0; corner < 8; ++corner) {
        const double u = corner & 1 ? part.high[0] : part.low[0], v = corner & 2 ? part.high[1] : part.low[1];
        const auto along = [&](std::size_t i, std::size_t k) {
          Lanes lanes;
          std::memcpy(&lanes, &nodes[c][part.i + i][part.k + k][corner >> 2], sizeof(lanes));
          return lanes;
        };
        const Lanes at =
            (1 - v) * ((1 - u) * along(0, 0) + u * along(1, 0)) + v * ((1 - u) * along(0, 1) + u * along(1, 1));
        if (corner == 0) low = high = at;
        low = at < low ? at : low;
        high = at > high ? at : high;
      }
      held.middle[c] = 0.5 * (low + high);
      held.reach[c] = 0.5 * (high - low) + off[c];
    }
  }
}

/// |R|: R is a sum of a_j r_j, |a_j| is bounded in the part, and |r_j| by its Bezier coefficients.
ResidualBound::ByInterval ResidualBound::largest_in(const PlanarResiduals::Part& part) const {
  ByInterval result{};
  for (std::size_t n = 0; n < kBlockIntervals; ++n) {
    std::array<Lanes, 3> sums{};
    for (std::size_t j = 0; j < positions_.size(); ++j) {
      for (std::size_t a = 0; a < 3; ++a) sums[a] = multiply_add(absolute(positions_[j][n][a]), part.most[j], sums[a]);
    }
    for (std::size_t a = 0; a < 3; ++a) result[a][n] = largest(sums[a]);
  }
  return result;
}

/// |s - g.R|. It is a sum of a_j times one cubic along w each, s_j - g.r_j, so that what cancels does so before its
/// size is taken.
Lanes ResidualBound::largest_off_gradient(const Box& box, const ByInterval& gradient,
                                          std::span<const AlongLine> channel) const {
  Lanes result{};
  for (std::size_t n = 0; n < kBlockIntervals; ++n) {
    Lanes sum{};
    for (std::size_t j = 0; j < channel.size(); ++j) {
      Lanes residual = channel[j][n];
      for (std::size_t a = 0; a < 3; ++a) residual = multiply_add(positions_[j][n][a], -gradient[a][n], residual);
      sum = multiply_add(absolute(residual), box.part->most[j], sum);
    }
    result[n] = largest(sum);
  }
  return result;
}

double ResidualBound::operator()(const CubicPolynomial& polynomial, std::span<const AlongLine> channel,
                                 double enough) const {
  double most = 0;
  for (const Box& box : boxes_) {
    const Derivatives p(polynomial, box.middle);
    most = std::max(most, largest(largest_off_gradient(box, p.first, channel) + rest_of(p, box.reach, box.largest)));
    if (!(most <= enough)) break;
  }
  return most;
}

}  // namespace ccslice
