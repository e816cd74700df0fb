// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/patch.h"

#include <algorithm>

#include "core/base/lanes.h"
#include "core/limit/lane_box.h"

namespace ccslice {

namespace {

Lanes load(const double* p) noexcept { return *reinterpret_cast<const Lanes*>(p); }

/// Visits the lines of a 4 x ... x 4 grid along `axis`: first point of each line, and the stride, both in points.
template <typename Visit>
void for_each_line(int axes, int axis, Visit visit) {
  const std::size_t stride = std::size_t{1} << (2 * axis);
  const std::size_t count = std::size_t{1} << (2 * axes);
  for (std::size_t p = 0; p < count; ++p) {
    if ((p / stride) % 4 == 0) visit(p, stride);
  }
}

/// The two are equal between the second and the third point: ends are the B-spline's values, (1, 4, 1) / 6, and inner
/// points part the leg between at thirds. `Number`: a double, or several of them in a register.
template <typename Number>
void to_bezier(Number& a, Number& b, Number& c, Number& d) noexcept {
  const Number bezier_a = (a + 4 * b + c) * (1.0 / 6), bezier_b = (2 * b + c) * (1.0 / 3);
  const Number bezier_c = (b + 2 * c) * (1.0 / 3), bezier_d = (b + 4 * c + d) * (1.0 / 6);
  a = bezier_a, b = bezier_b, c = bezier_c, d = bezier_d;
}

/// The lines along one axis of 4 x 4 x 4 points of four doubles.
template <std::size_t kStride>
void quads_to_bezier(double* grid) noexcept {
  constexpr std::size_t kStep = 4 * kStride;
  for (std::size_t block = 0; block < 64; block += 4 * kStride) {
    for (double* p = grid + 4 * block; p != grid + 4 * (block + kStride); p += 4) {
      Lanes a = load_unaligned(p), b = load_unaligned(p + kStep), c = load_unaligned(p + 2 * kStep),
            d = load_unaligned(p + 3 * kStep);
      to_bezier(a, b, c, d);
      store_unaligned(a, p), store_unaligned(b, p + kStep), store_unaligned(c, p + 2 * kStep);
      store_unaligned(d, p + 3 * kStep);
    }
  }
}

using PatchWeights = std::array<double, 64>;

/// bspline_basis() of all three axes at once, a lane each: the same operations one by one, so the same to the bit.
TensorBasis tensor_basis(const Vec3& uvw) noexcept {
  const Lanes t = {uvw[0], uvw[1], uvw[2], 0}, s = 1 - t, t2 = t * t, t3 = t2 * t;
  const std::array<Lanes, 4> values = {s * s * s / 6, (3 * t3 - 6 * t2 + 4) / 6, (-3 * t3 + 3 * t2 + 3 * t + 1) / 6,
                                       t3 / 6};
  const std::array<Lanes, 4> slopes = {-s * s / 2, (3 * t2 - 4 * t) / 2, (-3 * t2 + 2 * t + 1) / 2, t2 / 2};
  TensorBasis basis;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < 4; ++i) {
      basis.value[axis][i] = values[i][axis];
      basis.slope[axis][i] = slopes[i][axis];
    }
  }
  return basis;
}

/// Sums of so many neighbouring channels. They stay in registers.
template <std::size_t kCount>
void sum_channels(const PatchWeights& weights, const double* channels, std::size_t stride, double* out) noexcept {
  std::array<double, kCount> sums{};
  for (const double weight : weights) {
    for (std::size_t c = 0; c < kCount; ++c) sums[c] += weight * channels[c];
    channels += stride;
  }
  std::copy(sums.begin(), sums.end(), out);
}

}  // namespace

void bspline_basis(double t, std::array<double, 4>& value, std::array<double, 4>& derivative) noexcept {
  const double s = 1 - t, t2 = t * t, t3 = t2 * t;
  value = {s * s * s / 6, (3 * t3 - 6 * t2 + 4) / 6, (-3 * t3 + 3 * t2 + 3 * t + 1) / 6, t3 / 6};
  derivative = {-s * s / 2, (3 * t2 - 4 * t) / 2, (-3 * t2 + 2 * t + 1) / 2, t2 / 2};
}

Vec3 patch_position(const Patch& patch, const Vec3& uvw) noexcept {
  std::array<double, 4> bu, bv, bw, unused;
  bspline_basis(uvw[0], bu, unused);
  bspline_basis(uvw[1], bv, unused);
  bspline_basis(uvw[2], bw, unused);
  Lanes sum = {0, 0, 0, 0};
  for (std::size_t k = 0; k < 4; ++k) {
    Lanes plane = {0, 0, 0, 0};
    for (std::size_t j = 0; j < 4; ++j) {
      const double* p = patch.points + 4 * (4 * j + 16 * k);
      plane += bv[j] * (bu[0] * load(p) + bu[1] * load(p + 4) + bu[2] * load(p + 8) + bu[3] * load(p + 12));
    }
    sum += bw[k] * plane;
  }
  return to_vec3(sum);
}

LimitSample tensor_sample(const double* points, const TensorBasis& basis) noexcept {
  const auto& [bu, bv, bw] = basis.value;
  const auto& [du, dv, dw] = basis.slope;
  Lanes value = {0, 0, 0, 0}, along_u = value, along_v = value, along_w = value;
  for (std::size_t k = 0; k < 4; ++k) {
    Lanes plane = {0, 0, 0, 0}, plane_u = plane, plane_v = plane;
    for (std::size_t j = 0; j < 4; ++j) {
      const double* p = points + 4 * (4 * j + 16 * k);
      const Lanes p0 = load(p), p1 = load(p + 4), p2 = load(p + 8), p3 = load(p + 12);
      const Lanes row = bu[0] * p0 + bu[1] * p1 + bu[2] * p2 + bu[3] * p3;
      plane_u += bv[j] * (du[0] * p0 + du[1] * p1 + du[2] * p2 + du[3] * p3);
      plane += bv[j] * row;
      plane_v += dv[j] * row;
    }
    value += bw[k] * plane;
    along_u += bw[k] * plane_u;
    along_v += bw[k] * plane_v;
    along_w += dw[k] * plane;
  }
  LimitSample sample;
  sample.position = to_vec3(value);
  sample.jacobian.col(0) = to_vec3(along_u);
  sample.jacobian.col(1) = to_vec3(along_v);
  sample.jacobian.col(2) = to_vec3(along_w);
  return sample;
}

LimitSample patch_sample(const double* points, const Vec3& uvw) noexcept {
  return tensor_sample(points, tensor_basis(uvw));
}

void patch_channels(const Patch& patch, const Vec3& uvw, std::span<double> out) noexcept {
  const TensorBasis basis = tensor_basis(uvw);
  const auto& [bu, bv, bw] = basis.value;
  const Lanes along_u = load_unaligned(bu.data());
  PatchWeights weights;
  for (std::size_t j = 0; j < 4; ++j) {
    const Lanes row = along_u * bv[j];
    for (std::size_t k = 0; k < 4; ++k) store_unaligned(row * bw[k], &weights[4 * j + 16 * k]);
  }
  const std::size_t count = out.size();
  std::size_t c = 0;
  for (; c + kLanes <= count; c += kLanes) sum_channels<kLanes>(weights, patch.channels + c, count, &out[c]);
  for (; c + 2 <= count; c += 2) sum_channels<2>(weights, patch.channels + c, count, &out[c]);
  if (c < count) sum_channels<1>(weights, patch.channels + c, count, &out[c]);
}

ChannelSample patch_channel_sample(const Patch& patch, std::size_t channel, std::size_t channel_count,
                                   const TensorBasis& basis) noexcept {
  const auto& [bu, bv, bw] = basis.value;
  const auto& [du, dv, dw] = basis.slope;
  // Rows along u stay apart, a lane a point, until both other axes are summed up.
  Lanes row = {0, 0, 0, 0}, along_v = row, along_w = row;
  const double* p = patch.channels + channel;
  for (std::size_t k = 0; k < 4; ++k) {
    Lanes plane = {0, 0, 0, 0}, plane_v = plane;
    for (std::size_t j = 0; j < 4; ++j, p += 4 * channel_count) {
      const Lanes points = {p[0], p[channel_count], p[2 * channel_count], p[3 * channel_count]};
      plane += bv[j] * points;
      plane_v += dv[j] * points;
    }
    row += bw[k] * plane;
    along_v += bw[k] * plane_v;
    along_w += dw[k] * plane;
  }
  const Lanes values = {bu[0], bu[1], bu[2], bu[3]}, slopes = {du[0], du[1], du[2], du[3]};
  return {sum(row * values), {sum(row * slopes), sum(along_v * values), sum(along_w * values)}};
}

void fill_phantoms(double* grid, int axes, std::size_t dimension, PhantomMask phantoms) noexcept {
  for (int axis = 0; axis < axes; ++axis) {
    const bool low = phantoms >> (2 * axis) & 1, high = phantoms >> (2 * axis + 1) & 1;
    if (!low && !high) continue;
    // One axis after the other: where phantom layers meet, points are made of phantoms of the axis before.
    for_each_line(axes, axis, [&](std::size_t first, std::size_t stride) {
      double* p = grid + first * dimension;
      const std::size_t step = stride * dimension;
      for (std::size_t d = 0; d < dimension; ++d) {
        if (low) p[d] = 2 * p[step + d] - p[2 * step + d];
        if (high) p[3 * step + d] = 2 * p[2 * step + d] - p[step + d];
      }
    });
  }
}

void load_patch(const double* grid, std::size_t dimension, double* points, double* channels) noexcept {
  for (std::size_t p = 0; p < 64; ++p, grid += dimension, points += 4) {
    for (std::size_t a = 0; a < 3; ++a) points[a] = grid[a];
    points[3] = 0;
    for (std::size_t c = 3; c < dimension; ++c) *channels++ = grid[c];
  }
}

void bspline_to_bezier(double* grid, int axes, std::size_t dimension) noexcept {
  if (axes == 3 && dimension == 4) return quads_to_bezier<1>(grid), quads_to_bezier<4>(grid), quads_to_bezier<16>(grid);
  for (int axis = 0; axis < axes; ++axis) {
    for_each_line(axes, axis, [&](std::size_t first, std::size_t stride) {
      double* p = grid + first * dimension;
      const std::size_t step = stride * dimension;
      for (double* end = p + dimension; p != end; ++p) to_bezier(p[0], p[step], p[2 * step], p[3 * step]);
    });
  }
}

}  // namespace ccslice
