// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/halve_patch_net.h"

#include <gtest/gtest.h>

#include <random>

namespace ccslice {
namespace {

using Net = std::array<double, 16>;

/// The sum of coefficients by Bernstein polynomials.
double value_at(const Net& net, double s, double t) {
  const auto bernstein = [](double x) {
    const double y = 1 - x;
    return std::array{y * y * y, 3 * x * y * y, 3 * x * x * y, x * x * x};
  };
  const auto along_s = bernstein(s), along_t = bernstein(t);
  double sum = 0;
  for (std::size_t i = 0; i < 16; ++i) sum += net[i] * along_s[i % 4] * along_t[i / 4];
  return sum;
}

TEST(HalvePatchNet, GivesTheSamePatchOverEachHalf) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> share(0, 1);
  Net net, low, high;
  for (double& coefficient : net) coefficient = share(random);
  for (const std::size_t stride : {1, 4}) {
    halve_patch_net(net, stride, low, high);
    for (int i = 0; i < 20; ++i) {
      const double s = share(random), t = share(random);
      const bool along_s = stride == 1;
      const double low_s = along_s ? s / 2 : s, low_t = along_s ? t : t / 2;
      EXPECT_NEAR(value_at(low, s, t), value_at(net, low_s, low_t), 1e-14);
      EXPECT_NEAR(value_at(high, s, t), value_at(net, along_s ? 0.5 + low_s : s, along_s ? t : 0.5 + low_t), 1e-14);
    }
  }
}

}  // namespace
}  // namespace ccslice
