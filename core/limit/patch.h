// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A regular patch: 4 x 4 x 4 control points of a tricubic uniform B-spline over [0,1]^3, the one kernel that every
// evaluation ends in.

#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/limit/limit_evaluator.h"
#include "core/subdivision/ring.h"

namespace ccslice {

/// A regular patch, owned by someone else.
struct Patch {
  const double* points;    // 64 * {x, y, z, 0}, index i + 4 j + 16 k; mm, mesh frame; aligned to 32 bytes.
  const double* channels;  // 64 * c: channels[p * c + channel].
};
inline constexpr std::size_t kPatchPoints = 64 * 4;  // Doubles of Patch::points.

/// Values and slopes of four basis functions along each axis.
struct TensorBasis {
  std::array<std::array<double, 4>, 3> value, slope;
};

/// Position and Jacobian of 4 x 4 x 4 points (x, y, z, 0 each, 32-byte aligned) in any tensor basis.
LimitSample tensor_sample(const double* points, const TensorBasis& basis) noexcept;

/// Cubic uniform B-spline basis at t and its derivative.
void bspline_basis(double t, std::array<double, 4>& value, std::array<double, 4>& derivative) noexcept;

Vec3 patch_position(const Patch& patch, const Vec3& uvw) noexcept;
/// Derivatives with respect to the patch's own parameters. `points`: as Patch::points, aligned to 32 bytes.
LimitSample patch_sample(const double* points, const Vec3& uvw) noexcept;
void patch_channels(const Patch& patch, const Vec3& uvw, std::span<double> out) noexcept;

/// A channel and its derivatives with respect to the patch's own parameters.
struct ChannelSample {
  double value;
  Vec3 slope;
};
/// Evaluates one of the patch's `channel_count` channels.
ChannelSample patch_channel_sample(const Patch& patch, std::size_t channel, std::size_t channel_count,
                                   const TensorBasis& basis) noexcept;

/// Fills phantom layers in a grid of `dimension` doubles a point, 4 points along each of `axes` (2 or 3) axes:
/// P(-1) = 2 P(0) - P(1), and likewise at the other end. The relation survives refinement.
void fill_phantoms(double* grid, int axes, std::size_t dimension, PhantomMask phantoms) noexcept;

/// Splits a grid of points (x, y, z, channels...) into a patch's points and its 64 * (dimension - 3) channels.
void load_patch(const double* grid, std::size_t dimension, double* points, double* channels) noexcept;

/// Control points of the B-spline -> Bezier control points along one axis (stride in points), in place.
void bspline_to_bezier(double* grid, int axes, std::size_t dimension) noexcept;

}  // namespace ccslice
