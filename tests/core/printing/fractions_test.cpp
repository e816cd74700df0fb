// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What halftones keep of fractions and gradients, and how grainy they are.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <utility>

#include "tests/core/printing/halftoned_blocks.h"

namespace ccslice {
namespace {

constexpr std::array<std::size_t, 3> kCube = {24, 12, 37};  // Voxels of a cube of 1 mm.
constexpr std::size_t kCubeVoxels = kCube[0] * kCube[1] * kCube[2];

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

/// A part of a block, in voxels.
using InPart = std::function<bool(std::size_t x, std::size_t y)>;

/// Likewise of the voxels of a part, over cubes at every 3rd place, cut by its sides, front and back or not, of which
/// at least `filled` is in the part.
double worst_cut_cube(const HalftonedBlock& block, const InPart& in_part, std::uint8_t material, double fraction,
                      double filled) {
  double worst = 0;
  for (std::size_t y0 = 0; y0 + kCube[1] <= block.size[1]; y0 += 3) {
    for (std::size_t x0 = 0; x0 + kCube[0] <= block.size[0]; x0 += 3) {
      std::vector<std::size_t> counts(block.size[2] + 1);
      std::size_t in_layer = 0;
      for (std::size_t y = y0; y < y0 + kCube[1]; ++y) {
        for (std::size_t x = x0; x < x0 + kCube[0]; ++x) {
          if (!in_part(x, y)) continue;
          ++in_layer;
          for (std::size_t z = 0; z < block.size[2]; ++z) counts[z + 1] += block.at(x, y, z) == material;
        }
      }
      const std::size_t voxels = in_layer * kCube[2];
      if (static_cast<double>(voxels) < filled * static_cast<double>(kCubeVoxels)) continue;
      std::partial_sum(counts.begin(), counts.end(), counts.begin());
      for (std::size_t z0 = 0; z0 + kCube[2] <= block.size[2]; ++z0) {
        const double share = static_cast<double>(counts[z0 + kCube[2]] - counts[z0]) / static_cast<double>(voxels);
        worst = std::max(worst, std::abs(share - fraction));
      }
    }
  }
  return worst;
}

/// Error diffusion of a constant mix in a part, whose rows come in runs as a slicer has them.
HalftonedBlock diffuse(const std::vector<float>& mix, const InPart& in_part, const std::array<std::size_t, 3>& size) {
  HalftonedBlock block{size, kPitch, std::vector<std::uint8_t>(size[0] * size[1] * size[2])};
  const HalftonePlan plan = plan_of(shares_of(mix.size(), HalftoneMethod::kErrorDiffusion, 7));
  Halftoner halftoner(plan);
  Fractions fractions{};
  for (std::size_t m = 0; m < mix.size(); ++m) fractions[m].fill(mix[m]);
  for (std::uint32_t z = 0; z < size[2]; ++z) {
    halftoner.start_layer(static_cast<std::uint32_t>(size[0]), z);
    for (std::uint32_t y = 0; y < size[1]; ++y) {
      std::vector<std::pair<std::uint32_t, std::uint32_t>> runs;  // Columns, none across the end of a block.
      for (std::uint32_t x = 0; x < size[0]; ++x) {
        if (!in_part(x, y)) continue;
        if (runs.empty() || runs.back().second != x || x % kMixBlock == 0) runs.emplace_back(x, x);
        runs.back().second = x + 1;
      }
      if (runs.empty()) continue;
      halftoner.start_row(y);
      if (halftoner.reverse()) std::reverse(runs.begin(), runs.end());
      for (const auto& [begin, end] : runs) {
        const std::uint32_t index = begin / kMixBlock, left = index * kMixBlock;
        halftoner.choose(index, begin - left, end - left, fractions,
                         &block.materials[(z * size[1] + y) * size[0] + left]);
      }
    }
  }
  return block;
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

TEST_P(Mix, KeepsItsFractionsBesideTheBoundaryInErrorDiffusion) {
  const std::vector<float>& fractions = GetParam();
  const std::array<std::size_t, 3> size = {144, 72, 111};
  const auto ring = [](std::size_t x, std::size_t y) {
    const double radius = std::hypot(static_cast<double>(x) / 2 - 36, static_cast<double>(y) - 36);
    return radius < 34 && radius > 14;
  };
  const auto bar = [](std::size_t x, std::size_t y) {
    return std::abs(0.6 * static_cast<double>(x) / 2 + 0.8 * static_cast<double>(y) - 50) < 9;
  };
  const auto block = [](std::size_t x, std::size_t y) { return x >= 12 && x < 132 && y >= 6 && y < 66; };
  for (const InPart& part : {InPart(ring), InPart(bar), InPart(block)}) {
    const HalftonedBlock halftoned = diffuse(fractions, part, size);
    for (std::size_t m = 0; m < fractions.size(); ++m) {
      const auto material = static_cast<std::uint8_t>(m + 1);
      EXPECT_LE(worst_cut_cube(halftoned, part, material, fractions[m], 1), 0.0055) << "material " << m + 1;
      EXPECT_LE(worst_cut_cube(halftoned, part, material, fractions[m], 0.5), 0.008) << "material " << m + 1;
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
      EXPECT_LT(correlation(block, static_cast<std::uint8_t>(m), z), 0.05) << "material " << m << ", layer " << z;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Fractions, Mix,
                         testing::Values(std::vector<float>{0.1f, 0.9f}, std::vector<float>{0.3f, 0.7f},
                                         std::vector<float>{0.5f, 0.5f}, std::vector<float>{0.2f, 0.3f, 0.5f},
                                         std::vector<float>{0.02f, 0.98f}, std::vector<float>{0.05f, 0.05f, 0.9f},
                                         std::vector<float>{0.02f, 0.08f, 0.3f, 0.6f}));

/// Counts of a material in all boxes from the first voxel on.
class Counts {
 public:
  Counts(const HalftonedBlock& block, std::uint8_t material)
      : size_({block.size[0] + 1, block.size[1] + 1, block.size[2] + 1}), sums_(size_[0] * size_[1] * size_[2]) {
    for (std::size_t z = 1; z < size_[2]; ++z) {
      for (std::size_t y = 1; y < size_[1]; ++y) {
        for (std::size_t x = 1; x < size_[0]; ++x) {
          const int here = block.at(x - 1, y - 1, z - 1) == material;
          sums_[index(x, y, z)] = here + at(x - 1, y, z) + at(x, y - 1, z) + at(x, y, z - 1) - at(x - 1, y - 1, z) -
                                  at(x - 1, y, z - 1) - at(x, y - 1, z - 1) + at(x - 1, y - 1, z - 1);
        }
      }
    }
  }
  int in_box(const std::array<std::size_t, 3>& low, const std::array<std::size_t, 3>& edges) const {
    const auto [x, y, z] = low;
    const std::size_t i = x + edges[0], j = y + edges[1], k = z + edges[2];
    return at(i, j, k) - at(x, j, k) - at(i, y, k) - at(i, j, z) + at(x, y, k) + at(x, j, z) + at(i, y, z) -
           at(x, y, z);
  }

 private:
  std::size_t index(std::size_t x, std::size_t y, std::size_t z) const { return (z * size_[1] + y) * size_[0] + x; }
  int at(std::size_t x, std::size_t y, std::size_t z) const { return sums_[index(x, y, z)]; }

  std::array<std::size_t, 3> size_;
  std::vector<int> sums_;
};

/// The largest difference, in voxels, between a material's count in a cube of 1 mm and its fraction of the cube, over
/// all cubes of the block.
double worst_count(const HalftonedBlock& block, std::uint8_t material, double fraction) {
  const Counts counts(block, material);
  std::array<std::size_t, 3> edges;
  for (std::size_t a = 0; a < 3; ++a) edges[a] = static_cast<std::size_t>(std::lround(1 / block.pitch_mm[a]));
  const double expected = fraction * static_cast<double>(edges[0] * edges[1] * edges[2]);
  double worst = 0;
  for (std::size_t z = 0; z + edges[2] <= block.size[2]; ++z) {
    for (std::size_t y = 0; y + edges[1] <= block.size[1]; ++y) {
      for (std::size_t x = 0; x + edges[0] <= block.size[0]; ++x) {
        worst = std::max(worst, std::abs(counts.in_box({x, y, z}, edges) - expected));
      }
    }
  }
  return worst;
}

struct MinorCase {
  std::array<double, 3> pitch_mm;
  float fraction;
  double voxels;  // Off by these at most.
};

class Minor : public testing::TestWithParam<MinorCase> {
 protected:
  /// 3 mm each way, from the part's first voxel on.
  HalftonedBlock block(std::uint64_t seed) const {
    const MinorCase& minor = GetParam();
    std::array<std::size_t, 3> size;
    for (std::size_t a = 0; a < 3; ++a) size[a] = static_cast<std::size_t>(std::lround(3 / minor.pitch_mm[a]));
    const HalftonePlan plan(shares_of(2, HalftoneMethod::kErrorDiffusion, seed), minor.pitch_mm[0], minor.pitch_mm[1],
                            minor.pitch_mm[2]);
    return halftone_block(plan, minor.pitch_mm, size, [&](auto...) {
      return std::vector<float>{minor.fraction, 1 - minor.fraction};
    });
  }
};

TEST_P(Minor, FractionIsKeptInEveryMillimetreFromTheFirstRowOn) {
  for (const std::uint64_t seed : {0u, 7u}) {
    EXPECT_LE(worst_count(block(seed), 1, static_cast<double>(GetParam().fraction)), GetParam().voxels)
        << "seed " << seed;
  }
}

TEST_P(Minor, VoxelsAreNotAboveOneAnother) {
  const HalftonedBlock halftoned = block(0);
  for (std::size_t z = 0; z + 1 < halftoned.size[2]; ++z) {
    for (std::size_t i = 0, layer = halftoned.size[0] * halftoned.size[1]; i < layer; ++i) {
      ASSERT_FALSE(halftoned.materials[z * layer + i] == 1 && halftoned.materials[(z + 1) * layer + i] == 1);
    }
  }
}

constexpr std::array<double, 3> kFine = {0.0423, 0.0846, 0.03}, kEven = {0.1, 0.1, 0.1};
INSTANTIATE_TEST_SUITE_P(Fractions, Minor,
                         testing::Values(MinorCase{kFine, 0.0005f, 4}, MinorCase{kFine, 0.001f, 4.6},
                                         MinorCase{kFine, 0.003f, 4}, MinorCase{kFine, 0.01f, 4},
                                         MinorCase{kFine, 0.04f, 5}, MinorCase{kFine, 0.08f, 5},
                                         MinorCase{kFine, 0.15f, 5}, MinorCase{kEven, 0.0005f, 2.1},
                                         MinorCase{kEven, 0.001f, 2.1}, MinorCase{kEven, 0.003f, 3.1},
                                         MinorCase{kEven, 0.01f, 4.1}, MinorCase{kEven, 0.04f, 5.1},
                                         MinorCase{kEven, 0.15f, 5.1}));

// Errors take over from the fraction on that isn't minor.
TEST(Gradient, KeepsItsFractionWhereErrorsTakeOver) {
  const std::array<std::size_t, 3> size = {192, 144, 111};
  for (const int axis : {0, 1}) {
    const HalftonedBlock block = halftone_block(
        plan_of(shares_of(2, HalftoneMethod::kErrorDiffusion)), kPitch, size, [&](std::size_t x, std::size_t y, auto) {
          const float first = 0.1f * static_cast<float>(axis == 0 ? x : y) / static_cast<float>(size[axis]);
          return std::vector<float>{first, 1 - first};
        });
    const Counts counts(block, 1);
    std::array<std::size_t, 3> edges = size, low{};
    edges[axis] = kCube[axis];
    for (; low[axis] + edges[axis] <= size[axis]; ++low[axis]) {
      const double voxels = static_cast<double>(edges[0] * edges[1] * edges[2]);
      const double middle = static_cast<double>(low[axis]) + static_cast<double>(edges[axis] - 1) / 2;
      EXPECT_NEAR(counts.in_box(low, edges) / voxels, 0.1 * middle / static_cast<double>(size[axis]), 1.2e-3)
          << "from " << low[axis];
    }
  }
}

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
