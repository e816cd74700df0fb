// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What halftones keep of fractions and gradients, and how grainy they are.

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "tests/core/halftone/halftoned_blocks.h"

namespace ccslice {
namespace {

constexpr std::array<std::size_t, 3> kCube = {24, 12, 37};  // Voxels of a cube of 1 mm.

/// The largest difference between the share of a material in a cube of 1 mm and `fraction`, over cubes at every 5th
/// place.
double worst_cube(const HalftonedBlock& block, std::uint8_t material, double fraction) {
  double worst = 0;
  for (std::size_t z0 = 0; z0 + kCube[2] <= block.size[2]; z0 += 5) {
    for (std::size_t y0 = 0; y0 + kCube[1] <= block.size[1]; y0 += 5) {
      for (std::size_t x0 = 0; x0 + kCube[0] <= block.size[0]; x0 += 5) {
        std::size_t count = 0;
        for (std::size_t z = z0; z < z0 + kCube[2]; ++z) {
          for (std::size_t y = y0; y < y0 + kCube[1]; ++y) {
            for (std::size_t x = x0; x < x0 + kCube[0]; ++x) count += block.at(x, y, z) == material;
          }
        }
        const double share = static_cast<double>(count) / static_cast<double>(kCube[0] * kCube[1] * kCube[2]);
        worst = std::max(worst, std::abs(share - fraction));
      }
    }
  }
  return worst;
}

/// Correlation of a material's voxels in two layers.
double correlation(const HalftonedBlock& block, std::uint8_t material, std::size_t z) {
  const std::size_t layer = block.size[0] * block.size[1];
  double a = 0, b = 0, ab = 0;
  for (std::size_t i = z * layer; i < (z + 1) * layer; ++i) {
    const double here = block.materials[i] == material, above = block.materials[i + layer] == material;
    a += here;
    b += above;
    ab += here * above;
  }
  const auto n = static_cast<double>(layer);
  a /= n, b /= n, ab /= n;
  return (ab - a * b) / std::sqrt(a * (1 - a) * b * (1 - b));
}

class Mix : public testing::TestWithParam<std::vector<float>> {};

TEST_P(Mix, KeepsItsFractionsInEveryMillimetre) {
  const std::vector<float>& fractions = GetParam();
  for (const auto& [method, bar] :
       {std::pair(HalftoneMethod::kBlueNoise, 0.01), {HalftoneMethod::kErrorDiffusion, 0.005}}) {
    const HalftonedBlock block = constant_block(shares_of(fractions.size(), method, 7), fractions, {96, 96, 64});
    for (std::size_t m = 0; m < fractions.size(); ++m) {
      EXPECT_LT(worst_cube(block, static_cast<std::uint8_t>(m + 1), fractions[m]), bar)
          << "material " << m + 1 << ", method " << static_cast<int>(method);
    }
  }
}

TEST_P(Mix, IsATenthAsGrainyAsWhiteNoiseAtMost) {
  const HalftonedBlock block =
      constant_block(shares_of(GetParam().size(), HalftoneMethod::kBlueNoise), GetParam(), {128, 128, 128});
  for (std::size_t m = 1; m <= GetParam().size(); ++m) {
    EXPECT_LT(mean_power_below(block.pattern(static_cast<std::uint8_t>(m)), 1.5), 0.1) << "material " << m;
  }
}

TEST_P(Mix, MakesNoColumnsInErrorDiffusion) {
  const HalftonedBlock block =
      constant_block(shares_of(GetParam().size(), HalftoneMethod::kErrorDiffusion), GetParam(), {128, 128, 24});
  for (std::size_t m = 1; m <= GetParam().size(); ++m) {
    for (std::size_t z = 0; z + 1 < block.size[2]; ++z) {
      EXPECT_LT(std::abs(correlation(block, static_cast<std::uint8_t>(m), z)), 0.05)
          << "material " << m << ", layer " << z;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Fractions, Mix,
                         testing::Values(std::vector<float>{0.1f, 0.9f}, std::vector<float>{0.3f, 0.7f},
                                         std::vector<float>{0.5f, 0.5f}, std::vector<float>{0.2f, 0.3f, 0.5f}));

TEST(Gradient, KeepsTheMeanOfEveryLayer) {
  const std::array<std::size_t, 3> size = {192, 96, 80};
  for (const auto method : {HalftoneMethod::kBlueNoise, HalftoneMethod::kErrorDiffusion}) {
    for (const std::size_t materials : {2, 3}) {
      const auto along_z = [&](std::size_t, std::size_t, std::size_t z) {
        return std::vector<float>{static_cast<float>(z) * static_cast<float>(materials - 1) / 79};
      };
      const HalftonedBlock block = halftone_block(plan_of(blend_of(materials, method)), kPitch, size, along_z);
      for (std::size_t z = 0; z < size[2]; ++z) {
        const auto begin = block.materials.begin() + static_cast<std::ptrdiff_t>(z * size[0] * size[1]);
        const double sum = std::accumulate(begin, begin + static_cast<std::ptrdiff_t>(size[0] * size[1]), 0.0);
        const double mean = sum / static_cast<double>(size[0] * size[1]) - 1;
        EXPECT_NEAR(mean, static_cast<double>(z) * static_cast<double>(materials - 1) / 79, 0.005) << "layer " << z;
      }
    }
  }
}

}  // namespace
}  // namespace ccslice
