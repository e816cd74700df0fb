// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/patch.h"

#include <gtest/gtest.h>

#include <array>
#include <random>
#include <vector>

namespace ccslice {
namespace {

/// A grid of x, y, z and one channel, random or graded.
std::vector<double> random_grid(std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> value(-1, 1);
  std::vector<double> grid(64 * 4);
  for (double& x : grid) x = value(random);
  return grid;
}

struct LoadedPatch {
  explicit LoadedPatch(const std::vector<double>& grid) { load_patch(grid.data(), 4, points.data(), channels.data()); }
  operator Patch() const { return {points.data(), channels.data()}; }

  alignas(32) std::array<double, kPatchPoints> points;
  std::array<double, 64> channels;
};

TEST(Patch, ReproducesLinearFunctions) {
  std::vector<double> grid;
  for (int p = 0; p < 64; ++p) {
    const double x = (p & 3) - 1, y = (p >> 2 & 3) - 1, z = (p >> 4) - 1;
    grid.insert(grid.end(), {x, 2 * y, 3 * z, x + y - z});
  }
  const LoadedPatch patch(grid);
  const Vec3 at(0.3, 0.7, 0.9);
  const LimitSample sample = patch_sample(patch.points.data(), at);
  EXPECT_LT((sample.position - Vec3(0.3, 1.4, 2.7)).norm(), 1e-14);
  EXPECT_LT((sample.jacobian - Mat3(Vec3(1, 2, 3).asDiagonal())).norm(), 1e-14);
  double channel = 0;
  patch_channels(patch, at, std::span(&channel, 1));
  EXPECT_NEAR(channel, 0.1, 1e-14);
}

TEST(Patch, JacobianAgreesWithFiniteDifferences) {
  const LoadedPatch patch(random_grid(1));
  const double h = 1e-6;
  for (const Vec3& at : {Vec3(0.2, 0.5, 0.8), Vec3(0.5, 0.5, 0.5), Vec3(0.9, 0.1, 0.4)}) {
    const Mat3 jacobian = patch_sample(patch.points.data(), at).jacobian;
    EXPECT_EQ(patch_sample(patch.points.data(), at).position, patch_position(patch, at));
    for (int a = 0; a < 3; ++a) {
      const Vec3 step = h * Vec3::Unit(a);
      const Vec3 slope = (patch_position(patch, at + step) - patch_position(patch, at - step)) / (2 * h);
      EXPECT_LT((slope - jacobian.col(a)).norm(), 1e-9);
    }
  }
}

TEST(Patch, SlopesOfChannelsAgreeWithFiniteDifferences) {
  const std::vector<double> grid = random_grid(2), other = random_grid(3);
  alignas(32) std::array<double, kPatchPoints> points;
  std::array<double, 2 * 64> channels;
  std::vector<double> wide;
  for (std::size_t p = 0; p < 64; ++p) {
    wide.insert(wide.end(), grid.begin() + static_cast<std::ptrdiff_t>(4 * p),
                grid.begin() + static_cast<std::ptrdiff_t>(4 * p + 4));
    wide.push_back(other[4 * p]);
  }
  load_patch(wide.data(), 5, points.data(), channels.data());
  const Patch patch{points.data(), channels.data()};
  const Vec3 at(0.2, 0.5, 0.8);
  TensorBasis basis;
  for (std::size_t a = 0; a < 3; ++a) {
    bspline_basis(at[static_cast<Eigen::Index>(a)], basis.value[a], basis.slope[a]);
  }
  const double h = 1e-6;
  for (std::size_t c = 0; c < 2; ++c) {
    const auto value = [&](const Vec3& uvw) {
      std::array<double, 2> values;
      patch_channels(patch, uvw, values);
      return values[c];
    };
    const ChannelSample sample = patch_channel_sample(patch, c, 2, basis);
    EXPECT_NEAR(sample.value, value(at), 1e-14);
    for (int a = 0; a < 3; ++a) {
      const Vec3 step = h * Vec3::Unit(a);
      EXPECT_NEAR(sample.slope[a], (value(at + step) - value(at - step)) / (2 * h), 1e-9);
    }
  }
}

TEST(Patch, ChannelsDontDependOnHowManyThereAre) {
  const Vec3 at(0.2, 0.5, 0.8);
  for (std::size_t count = 1; count <= 9; ++count) {
    std::mt19937 random(static_cast<unsigned>(count));
    std::uniform_real_distribution<double> uniform(-1, 1);
    std::vector<double> together(64 * count), values(count);
    for (double& value : together) value = uniform(random);
    patch_channels({nullptr, together.data()}, at, values);
    for (std::size_t c = 0; c < count; ++c) {
      std::array<double, 64> alone;
      for (std::size_t p = 0; p < alone.size(); ++p) alone[p] = together[p * count + c];
      double value = 0;
      patch_channels({nullptr, alone.data()}, at, {&value, 1});
      EXPECT_EQ(values[c], value) << c << " of " << count;
    }
  }
}

TEST(Patch, PhantomLayersMakeTheSideInterpolateItsFace) {
  std::vector<double> grid = random_grid(2);
  fill_phantoms(grid.data(), 3, 4, 0b000001);
  const LoadedPatch patch(grid);
  // At u = 0 the patch is the bicubic B-spline of the points at i = 1 alone.
  const Vec3 at(0, 0.3, 0.6);
  std::array<double, 4> bv, bw, unused;
  bspline_basis(at[1], bv, unused);
  bspline_basis(at[2], bw, unused);
  Vec3 expected = Vec3::Zero();
  for (std::size_t k = 0; k < 4; ++k) {
    for (std::size_t j = 0; j < 4; ++j) expected += bv[j] * bw[k] * Vec3::Map(&grid[4 * (1 + 4 * j + 16 * k)]);
  }
  EXPECT_LT((patch_position(patch, at) - expected).norm(), 1e-14);
}

TEST(Patch, PhantomsOnAllSidesFillEveryPoint) {
  // Real points 1 and 2 of each axis hold a linear function; the phantoms must continue it.
  const auto value = [](std::size_t p) { return double(p & 3) + 10 * double(p >> 2 & 3) + 100 * double(p >> 4); };
  std::vector<double> grid(64 * 3, 0.0);
  for (std::size_t p = 0; p < 64; ++p) {
    const auto inner = [](std::size_t i) { return i == 1 || i == 2; };
    if (inner(p & 3) && inner(p >> 2 & 3) && inner(p >> 4)) grid[3 * p] = value(p);
  }
  fill_phantoms(grid.data(), 3, 3, 0b111111);
  for (std::size_t p = 0; p < 64; ++p) EXPECT_NEAR(grid[3 * p], value(p), 1e-12) << p;
}

TEST(Patch, BezierNetGivesTheSamePatch) {
  std::vector<double> grid = random_grid(3);
  const LoadedPatch patch(grid);
  bspline_to_bezier(grid.data(), 3, 4);
  const auto bernstein = [](double t) {
    const double s = 1 - t;
    return std::array<double, 4>{s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t};
  };
  const Vec3 at(0.25, 0.6, 0.95);
  const auto bu = bernstein(at[0]), bv = bernstein(at[1]), bw = bernstein(at[2]);
  Vec3 sum = Vec3::Zero();
  for (std::size_t p = 0; p < 64; ++p) sum += bu[p & 3] * bv[p >> 2 & 3] * bw[p >> 4] * Vec3::Map(&grid[4 * p]);
  EXPECT_LT((sum - patch_position(patch, at)).norm(), 1e-14);
}

}  // namespace
}  // namespace ccslice
