// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/samples/brick_blocks.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/limit/patch.h"
#include "core/limit/patch_lanes.h"
#include "core/limit/solid_data.h"

namespace ccslice {
namespace {

using Four = std::array<double, 4>;

/// Chebyshev nodes as shares of an interval: (1 + cos((2 k + 1) pi / 8)) / 2.
constexpr Four kSites = {0.03806023374435663, 0.3086582838174551, 0.6913417161825449, 0.9619397662556434};

/// 1 over the product of a node's differences from the others.
constexpr Four lagrange_scales() {
  Four scales{};
  for (std::size_t m = 0; m < 4; ++m) {
    double product = 1;
    for (std::size_t q = 0; q < 4; ++q) {
      if (q != m) product *= kSites[m] - kSites[q];
    }
    scales[m] = 1 / product;
  }
  return scales;
}
constexpr Four kScales = lagrange_scales();

/// The blossom of the m-th Lagrange polynomial at three shares of the interval: the mean of its factors' products over
/// all orders of the three.
constexpr double lagrange_blossom(std::size_t m, double a, double b, double c) {
  std::array<double, 3> others{};
  std::size_t count = 0;
  for (std::size_t q = 0; q < 4; ++q) {
    if (q != m) others[count++] = kSites[q];
  }
  const auto [p, q, r] = others;
  const double sum = (a - p) * ((b - q) * (c - r) + (c - q) * (b - r)) +
                     (b - p) * ((a - q) * (c - r) + (c - q) * (a - r)) +
                     (c - p) * ((a - q) * (b - r) + (b - q) * (a - r));
  return kScales[m] * sum / 6;
}

/// A bound on how far a tricubic polynomial may exceed its values at the nodes, by number.
///
/// A cubic's second derivative is linear: at nodes it is the second difference there, or at the ends goes on from those
/// beside them. Along the other two axes it is cubic, and of a cubic 5 nodes see 1 / 1.2932 of its largest value.
Lanes bulge_of(const std::array<Lanes, kBlockPoints>& at_nodes) {
  constexpr double kBetweenNodes = 1.2932 * 1.2932 / 8;
  Lanes bulge{};
  for (std::size_t a = 0; a < 3; ++a) {
    const std::size_t step = kBlockStride[a];
    Lanes most{};
    for (std::size_t node = 0; node < kBlockPoints; ++node) {
      if (node / step % kBlockNodes != 0) continue;
      const Lanes* line = &at_nodes[node];
      const auto bend = [&](std::size_t n) { return line[(n - 1) * step] - 2 * line[n * step] + line[(n + 1) * step]; };
      const Lanes low = bend(1), middle = bend(2), high = bend(3);
      most = greater(most, greater(absolute(2 * low - middle), absolute(2 * high - middle)));
    }
    bulge += kBetweenNodes * most;
  }
  return bulge;
}

}  // namespace

BrickSampler::BrickSampler(const LimitSolid& solid, std::vector<std::uint32_t> channels)
    : data_(solid.data()), channels_(std::move(channels)) {}

/// Between the knots n and n + 1 the limit depends on the control points n to n + 3, and the point n + 1 is the blossom
/// at the knots n - 1, n and n + 1.
BrickSampler::Axis BrickSampler::axis_of(double low, double high) {
  Axis axis;
  const double begin = std::floor(low), size = std::ceil(high) - begin;
  axis.first = static_cast<std::size_t>(begin);
  const auto spans = static_cast<std::size_t>(size);
  axis.points = spans + 3;
  const auto share = [&](double knot) { return (knot - begin) / size; };
  for (std::size_t m = 0; m < 4; ++m) {
    const double at = kSites[m] * size;
    const std::size_t span = std::min(static_cast<std::size_t>(at), spans - 1);
    Four value, unused;
    bspline_basis(at - static_cast<double>(span), value, unused);
    axis.at_sites[m].fill(0);
    std::ranges::copy(value, axis.at_sites[m].begin() + static_cast<std::ptrdiff_t>(span));
    for (std::size_t p = 0; p < axis.points; ++p) {
      const double knot = begin + static_cast<double>(p) - 1;
      axis.of_points[p][m] = lagrange_blossom(m, share(knot - 1), share(knot), share(knot + 1));
    }
    for (std::size_t n = 0; n < kBlockNodes; ++n) {
      const double node = share(low + static_cast<double>(n) / (kBlockNodes - 1) * (high - low));
      axis.at_nodes[n][m] = lagrange_blossom(m, node, node, node);
    }
  }
  return axis;
}

void BrickSampler::sample(const CellBrick& brick, const ParamBox& box, CellBlock& block, BrickResiduals& residuals) {
  for (std::size_t a = 0; a < 3; ++a) {
    const auto axis = static_cast<Eigen::Index>(a);
    axes_[a] = axis_of(box.low[axis], box.high[axis]);
  }
  block.values.resize(channels_.size());
  residuals.position.setZero();
  residuals.bulge.setZero();
  residuals.values.assign(channels_.size(), 0);
  const bool in_one_cell = std::ranges::all_of(axes_, [](const Axis& axis) { return axis.points == 4; });
  for_each_four_numbers(channels_.size(), [&](std::size_t first_lane, std::size_t c, std::size_t count) {
    load_points(brick, first_lane, c, count);
    contract_to_sites();
    std::array<Lanes, kBlockPoints> found;
    contract(sites_, std::array{axes_[0].at_nodes, axes_[1].at_nodes, axes_[2].at_nodes}, found);
    for (std::size_t slot = 0; slot < kBlockSlots; ++slot) {
      const std::size_t group = slot / kLanes, at = slot % kLanes;
      const Lanes& numbers = found[node_of_slot(slot)];
      for (std::size_t lane = 0; lane < first_lane; ++lane) block.position[lane][group][at] = numbers[lane];
      for (std::size_t k = 0; k < count; ++k) block.values[c + k][group][at] = numbers[first_lane + k];
    }
    if (in_one_cell) return;
    const Lanes largest = largest_residual(), bulge = bulge_of(found);
    for (std::size_t lane = 0; lane < first_lane; ++lane) {
      residuals.position[static_cast<Eigen::Index>(lane)] = largest[lane];
      residuals.bulge[static_cast<Eigen::Index>(lane)] = bulge[lane];
    }
    for (std::size_t k = 0; k < count; ++k) residuals.values[c + k] = largest[first_lane + k];
  });
}

void BrickSampler::load_points(const CellBrick& brick, std::size_t first_lane, std::size_t channel, std::size_t count) {
  const std::span<const std::uint32_t> ids = data_.bricks.points(brick);
  for (std::size_t k = 0; k < axes_[2].points; ++k) {
    for (std::size_t j = 0; j < axes_[1].points; ++j) {
      const std::size_t row = brick.points_along(1) * (axes_[2].first + k) + axes_[1].first + j;
      const std::uint32_t* id = &ids[brick.points_along(0) * row + axes_[0].first];
      Lanes* point = &points_[kMostPoints * (kMostPoints * k + j)];
      for (std::size_t i = 0; i < axes_[0].points; ++i) {
        if (id[i] == kNone) continue;
        const double* numbers = data_.point(id[i]);
        Lanes loaded{};
        for (std::size_t lane = 0; lane < first_lane; ++lane) loaded[lane] = numbers[lane];
        for (std::size_t n = 0; n < count; ++n) loaded[first_lane + n] = numbers[3 + channels_[channel + n]];
        point[i] = loaded;
      }
    }
  }
  if (brick.phantoms != 0) fill_phantoms(brick);
}

/// Of those layers that the box depends on.
void BrickSampler::fill_phantoms(const CellBrick& brick) {
  constexpr std::array<std::size_t, 3> kStride = {1, kMostPoints, kMostPoints * kMostPoints};
  for (std::size_t a = 0; a < 3; ++a) {
    const std::size_t b = (a + 1) % 3, c = (a + 2) % 3, step = kStride[a], last = axes_[a].points - 1;
    const bool low = brick.phantoms >> (2 * a) & 1 && axes_[a].first == 0;
    const bool high = brick.phantoms >> (2 * a + 1) & 1 && axes_[a].first + axes_[a].points == brick.points_along(a);
    if (!low && !high) continue;
    for (std::size_t j = 0; j < axes_[b].points; ++j) {
      for (std::size_t i = 0; i < axes_[c].points; ++i) {
        Lanes* line = &points_[kStride[b] * j + kStride[c] * i];
        if (low) line[0] = 2 * line[step] - line[2 * step];
        if (high) line[last * step] = 2 * line[(last - 1) * step] - line[(last - 2) * step];
      }
    }
  }
}

/// X at the Chebyshev nodes, axis by axis.
void BrickSampler::contract_to_sites() {
  std::array<Lanes, 4 * kMostPoints * kMostPoints> rows;
  const auto& [u, v, w] = axes_;
  for (std::size_t k = 0; k < w.points; ++k) {
    for (std::size_t j = 0; j < v.points; ++j) {
      const Lanes* line = &points_[kMostPoints * (kMostPoints * k + j)];
      for (std::size_t m = 0; m < 4; ++m) {
        Lanes sum{};
        for (std::size_t i = 0; i < u.points; ++i) sum = multiply_add(line[i], u.at_sites[m][i], sum);
        rows[4 * (kMostPoints * k + j) + m] = sum;
      }
    }
  }
  std::array<Lanes, 16 * kMostPoints> planes;
  for (std::size_t k = 0; k < w.points; ++k) {
    for (std::size_t n = 0; n < 4; ++n) {
      std::array<Lanes, 4> sums{};
      for (std::size_t j = 0; j < v.points; ++j) {
        for (std::size_t m = 0; m < 4; ++m) {
          sums[m] = multiply_add(rows[4 * (kMostPoints * k + j) + m], v.at_sites[n][j], sums[m]);
        }
      }
      std::ranges::copy(sums, planes.begin() + static_cast<std::ptrdiff_t>(16 * k + 4 * n));
    }
  }
  for (std::size_t q = 0; q < 4; ++q) {
    for (std::size_t mn = 0; mn < 16; ++mn) {
      Lanes sum{};
      for (std::size_t k = 0; k < w.points; ++k) sum = multiply_add(planes[16 * k + mn], w.at_sites[q][k], sum);
      sites_[16 * q + mn] = sum;
    }
  }
}

/// The largest difference of a control point of X from that of Q, by number.
Lanes BrickSampler::largest_residual() const {
  const auto& [u, v, w] = axes_;
  const auto dot = [](const Four& weights, const Lanes* values, std::size_t step) {
    return multiply_add(values[0], weights[0], values[step] * weights[1]) +
           multiply_add(values[2 * step], weights[2], values[3 * step] * weights[3]);
  };
  Lanes largest{};
  for (std::size_t k = 0; k < w.points; ++k) {
    std::array<Lanes, 16> plane;
    for (std::size_t mn = 0; mn < 16; ++mn) plane[mn] = dot(w.of_points[k], &sites_[mn], 16);
    for (std::size_t j = 0; j < v.points; ++j) {
      std::array<Lanes, 4> row;
      for (std::size_t m = 0; m < 4; ++m) row[m] = dot(v.of_points[j], &plane[m], 4);
      const Lanes* point = &points_[kMostPoints * (kMostPoints * k + j)];
      for (std::size_t i = 0; i < u.points; ++i) {
        largest = greater(largest, absolute(point[i] - dot(u.of_points[i], row.data(), 1)));
      }
    }
  }
  return largest;
}

}  // namespace ccslice
