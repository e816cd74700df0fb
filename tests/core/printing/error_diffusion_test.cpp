// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Layers of random fractions in random shapes, whose errors are worked out again from the materials that were chosen.

#include "core/printing/error_diffusion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <random>
#include <utility>
#include <vector>

#include "core/base/types.h"
#include "core/printing/voxel_hash.h"

namespace ccslice {
namespace {

constexpr std::uint32_t kSeed = 20261123;
constexpr std::uint32_t kBlock = kMixBlock;

using Mix = std::array<float, kMaxPrintMaterials>;

/// Voxels [begin, end).
struct Columns {
  std::uint32_t begin, end;
};

struct Voxel {
  Mix fractions{};
  std::uint8_t material = 0;  // 0: outside.
};

struct Layer {
  std::uint32_t width = 0;
  std::vector<std::vector<Voxel>> rows;

  Layer(std::uint32_t the_width, std::uint32_t height) : width(the_width), rows(height) {
    for (std::vector<Voxel>& row : rows) row.resize(width);
  }
  bool inside(std::int64_t x, std::int64_t y) const {
    return y >= 0 && y < static_cast<std::int64_t>(rows.size()) && x >= 0 && x < width &&
           rows[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)].fractions != Mix{};
  }
  std::vector<Columns> runs(std::uint32_t y) const {
    std::vector<Columns> result;
    for (std::uint32_t x = 0; x < width; ++x) {
      if (!inside(x, y)) continue;
      if (result.empty() || result.back().end != x) result.push_back({x, x});
      result.back().end = x + 1;
    }
    return result;
  }
};

bool reverse(std::uint32_t y) { return y % 2 != 0; }

/// As a layer's worker does: runs and the blocks of each in the row's direction.
void diffuse(ErrorDiffusion& diffusion, Layer& layer, std::uint32_t seed) {
  diffusion.start_layer(layer.width);
  std::uint32_t last = 0;
  for (std::uint32_t y = 0; y < layer.rows.size(); ++y) {
    std::vector<Columns> parts;  // None across the end of a block.
    for (const auto& [begin, end] : layer.runs(y)) {
      for (std::uint32_t x = begin; x < end; x = (x / kBlock + 1) * kBlock) {
        parts.push_back({x, std::min(end, (x / kBlock + 1) * kBlock)});
      }
    }
    if (parts.empty()) continue;
    diffusion.start_row(y - last, reverse(y),
                        {row_key(seed, y, 0), 0x12345678u * (y + seed), ErrorDiffusion::minor_phase(seed, y, 0)});
    last = y;
    if (reverse(y)) std::reverse(parts.begin(), parts.end());
    for (const auto& [begin, end] : parts) {
      const std::uint32_t left = begin / kBlock * kBlock;
      Fractions fractions{};
      std::array<std::uint8_t, kBlock> chosen{};
      for (std::uint32_t x = begin; x < end; ++x) {
        for (std::size_t m = 0; m < kMaxPrintMaterials; ++m) fractions[m][x - left] = layer.rows[y][x].fractions[m];
      }
      diffusion.choose(left, begin - left, end - left, fractions, chosen.data());
      for (std::uint32_t x = begin; x < end; ++x) layer.rows[y][x].material = chosen[x - left];
    }
  }
}

std::vector<std::uint8_t> materials_of(const Layer& layer) {
  std::vector<std::uint8_t> result;
  for (const std::vector<Voxel>& row : layer.rows) {
    for (const Voxel& voxel : row) result.push_back(voxel.material);
  }
  return result;
}

/// Discs, in rows some of which are left out, and some voxels missing.
Layer random_shape(std::mt19937& random) {
  const auto below = [&](std::uint32_t n) { return static_cast<std::uint32_t>(random() % n); };
  Layer layer(80 + below(120), 30 + below(20));
  for (int disc = 0; disc < 4; ++disc) {
    const double x0 = below(layer.width), y0 = below(40), radius = 5 + below(30);
    for (std::uint32_t y = 0; y < layer.rows.size(); ++y) {
      if (y % 17 == 16) continue;
      for (std::uint32_t x = 0; x < layer.width; ++x) {
        if (std::hypot(x - x0, y - y0) < radius && below(200) != 0) layer.rows[y][x].fractions[0] = 1;
      }
    }
  }
  return layer;
}

/// An error is made up for this voxel: one of the row above would come from outside, or no run comes before its own.
bool is_at_rim(const Layer& layer, std::uint32_t x, std::uint32_t y, bool starts_run) {
  const std::int64_t above = std::int64_t{y} - 1;
  return starts_run || !layer.inside(std::int64_t{x} - 1, above) || !layer.inside(x, above) ||
         !layer.inside(std::int64_t{x} + 1, above);
}

void normalize(Mix& fractions) {
  float sum = 0;
  for (const float fraction : fractions) sum += fraction;
  for (float& fraction : fractions) fraction /= sum;
}

/// Random mixes without minor materials, but a single one at the rim: there no errors are made up for it.
void fill(Layer& layer, std::size_t materials, std::mt19937& random) {
  std::uniform_real_distribution<float> share(0, 1);
  for (std::uint32_t y = 0; y < layer.rows.size(); ++y) {
    for (const auto& [begin, end] : layer.runs(y)) {
      for (std::uint32_t x = begin; x < end; ++x) {
        Mix& fractions = layer.rows[y][x].fractions;
        fractions.fill(0);
        fractions[random() % materials] = 1;
        if (is_at_rim(layer, x, y, x == (reverse(y) ? end - 1 : begin))) continue;
        for (std::size_t m = 0; m < materials; ++m) fractions[m] += random() % 4 == 0 ? 0 : 2 * share(random);
        normalize(fractions);
        const float least = std::min(kMinorFraction, *std::max_element(fractions.begin(), fractions.end()));
        for (float& fraction : fractions) fraction = fraction < least ? 0 : fraction;
        normalize(fractions);
      }
    }
  }
}

using Errors = Eigen::Array<double, kMaxPrintMaterials, 1>;

/// A voxel, and what it had to choose by: its fractions and the errors carried to it.
struct Choice {
  std::uint32_t x, y;
  const Voxel& voxel;
  Errors sum;
};

/// Floyd and Steinberg's errors of the materials that were chosen. REQUIRES: none are made up.
void replay(const Layer& layer, const std::function<void(const Choice&)>& visit) {
  std::vector<Errors> here(layer.width + 2, Errors::Zero()), below = here;  // One column of margin each side.
  Errors error = Errors::Zero();
  std::int64_t next = -1000;
  for (std::uint32_t y = 0; y < layer.rows.size(); ++y) {
    std::vector<Columns> runs = layer.runs(y);
    here.assign(here.size(), Errors::Zero());
    here.swap(below);
    if (runs.empty()) next = -1000;
    if (reverse(y)) std::reverse(runs.begin(), runs.end());
    const int step = reverse(y) ? -1 : 1;
    for (const auto& [begin, end] : runs) {
      std::int64_t x = reverse(y) ? end - std::int64_t{1} : begin;
      if (std::abs(next - x) > 16) error.setZero();
      for (std::uint32_t left = end - begin; left > 0; --left, x += step) {
        const Voxel& voxel = layer.rows[y][static_cast<std::size_t>(x)];
        const auto column = static_cast<std::size_t>(x + 1);
        const Errors sum = Eigen::Map<const Eigen::ArrayXf>(voxel.fractions.data(), kMaxPrintMaterials).cast<double>() +
                           here[column] + 7.0 / 16 * error;
        visit({static_cast<std::uint32_t>(x), y, voxel, sum});
        error = sum;
        error[voxel.material - 1] -= 1;
        below[column - step] += 3.0 / 16 * error;
        below[column] += 5.0 / 16 * error;
        below[column + step] += 1.0 / 16 * error;
      }
      next = x;
    }
  }
}

/// With two materials the first one is taken where its fraction and errors are beyond a random number around a half.
void expect_two_chosen_by_errors(const Layer& layer, std::uint32_t seed) {
  constexpr double kRounding = 1e-4;
  replay(layer, [&](const Choice& choice) {
    const auto& [x, y, voxel, sum] = choice;
    ASSERT_NEAR(sum.sum(), 1, kRounding);
    const int absent = voxel.fractions[0] == 0 ? 1 : voxel.fractions[1] == 0 ? 2 : 0;
    const double random = 0.5 + 0.4 * (random_unit(row_key(seed, y, 0), x) - 0.5);
    if (absent != 0) {
      ASSERT_NE(voxel.material, absent);
    } else if (std::abs(sum[0] - random) > kRounding) {
      ASSERT_EQ(voxel.material, sum[0] > random ? 1 : 2)
          << "seed " << kSeed << ", layer " << seed << " at " << x << ' ' << y;
    }
    ASSERT_LE(std::abs(sum[0] - (voxel.material == 1 ? 1 : 0)), 0.7 + kRounding);
  });
}

TEST(ErrorDiffusion, ChoosesOfTwoByFractionsAndErrorsCarried) {
  std::mt19937 random(kSeed);
  ErrorDiffusion diffusion(2);
  for (std::uint32_t seed = 0; seed < 40; ++seed) {
    Layer layer = random_shape(random);
    fill(layer, 2, random);
    diffuse(diffusion, layer, seed);
    expect_two_chosen_by_errors(layer, seed);
    if (testing::Test::HasFatalFailure()) return;
  }
}

TEST(ErrorDiffusion, ChoosesOfManyTheLargestButForNoise) {
  std::mt19937 random(kSeed);
  std::size_t mixed = 0, not_largest = 0;
  for (std::uint32_t seed = 0; seed < 60; ++seed) {
    const std::size_t materials = 3 + seed % 6;
    Layer layer = random_shape(random);
    fill(layer, materials, random);
    ErrorDiffusion diffusion(materials);
    diffuse(diffusion, layer, seed);
    replay(layer, [&](const Choice& choice) {
      const std::size_t chosen = choice.voxel.material - 1u;
      ASSERT_LT(chosen, materials);
      ASSERT_GT(choice.voxel.fractions[chosen], 0);
      ASSERT_NEAR(choice.sum.sum(), 1, 1e-3);
      double largest = -100;
      for (std::size_t m = 0; m < materials; ++m) {
        if (choice.voxel.fractions[m] >= 1e-4f) largest = std::max(largest, choice.sum[static_cast<int>(m)]);
      }
      const double behind = largest - choice.sum[static_cast<int>(chosen)];
      ASSERT_LE(behind, 0.4 + 1e-3) << "seed " << kSeed << ", layer " << seed << " at " << choice.x << ' ' << choice.y;
      mixed += choice.voxel.fractions[chosen] < 1;
      not_largest += behind > 1e-3;
    });
    if (testing::Test::HasFatalFailure()) return;
  }
  EXPECT_GT(not_largest, mixed / 20) << "of " << mixed;
  EXPECT_LT(not_largest, mixed / 2) << "of " << mixed;
}

// Row 0 fills the layer, so that the rows below get errors of voxels only; in row 1 there is a gap.
TEST(ErrorDiffusion, CarriesErrorsAcrossGapsOfSixteenColumns) {
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<float> share(0.2f, 0.8f);
  for (std::uint32_t seed = 0; seed < 200; ++seed) {
    for (const std::uint32_t gap : {1u, 15u, 16u, 17u, 40u}) {
      Layer layer(200, 2);
      for (std::uint32_t x = 0; x < layer.width; ++x) {
        layer.rows[0][x].fractions[0] = 1;
        const float first = share(random);
        const bool outside = x >= 80 && x < 80 + gap, at_rim = x == 0 || x + 1 == layer.width;
        if (!outside) layer.rows[1][x].fractions = {at_rim ? 1 : first, at_rim ? 0 : 1 - first};
      }
      if (gap > 16) layer.rows[1][79].fractions = {1, 0};  // Row 1 comes from the right.
      ErrorDiffusion diffusion(2);
      diffuse(diffusion, layer, seed);
      expect_two_chosen_by_errors(layer, seed);
      if (testing::Test::HasFatalFailure()) FAIL() << "gap " << gap;
    }
  }
}

/// Of material 1, by column, in layers of one row.
std::vector<double> shares_of_first(const Mix& mix, std::size_t materials, std::uint32_t layers) {
  std::vector<double> shares(100);
  ErrorDiffusion diffusion(materials);
  for (std::uint32_t seed = 0; seed < layers; ++seed) {
    Layer layer(100, 1);
    for (Voxel& voxel : layer.rows[0]) voxel.fractions = mix;
    diffuse(diffusion, layer, seed);
    for (std::size_t x = 0; x < shares.size(); ++x) shares[x] += (layer.rows[0][x].material == 1) / double(layers);
  }
  return shares;
}

// No error comes in from anywhere: all are made up.
TEST(ErrorDiffusion, RowsOnTheirOwnHaveTheirFractionsInEveryColumn) {
  constexpr std::uint32_t kLayers = 4096;
  for (const std::vector<float>& mix :
       {std::vector<float>{0.1f, 0.9f}, {0.7f, 0.3f}, {0.2f, 0.3f, 0.5f}, {0.6f, 0.2f, 0.1f, 0.1f}}) {
    Mix fractions{};
    std::copy(mix.begin(), mix.end(), fractions.begin());
    const std::vector<double> shares = shares_of_first(fractions, mix.size(), kLayers);
    double mean = 0;
    for (std::size_t x = 0; x < shares.size(); ++x) {
      EXPECT_NEAR(shares[x], mix[0], 0.1) << x;
      mean += shares[x] / 100;
    }
    EXPECT_NEAR(mean, mix[0], 0.02);
  }
}

TEST(ErrorDiffusion, AConstantMixHasItsFractionsInALayer) {
  std::mt19937 random(kSeed);
  for (std::uint32_t seed = 0; seed < 12; ++seed) {
    const std::size_t materials = 2 + seed % 4;
    Mix mix{};
    float sum = 0;
    for (std::size_t m = 0; m < materials; ++m) sum += mix[m] = 1 + static_cast<float>(random() % 16);
    for (float& fraction : mix) fraction /= sum;
    Layer layer(300, 200);
    for (std::vector<Voxel>& row : layer.rows) {
      for (Voxel& voxel : row) voxel.fractions = mix;
    }
    ErrorDiffusion diffusion(materials);
    diffuse(diffusion, layer, seed);
    std::vector<std::uint8_t> chosen = materials_of(layer);
    for (std::size_t m = 0; m < materials; ++m) {
      const auto count = std::count(chosen.begin(), chosen.end(), m + 1);
      EXPECT_NEAR(static_cast<double>(count) / 60000, mix[m], 1e-3) << "seed " << kSeed << ", layer " << seed;
    }
  }
}

void fill_all(Layer& layer, const Mix& mix) {
  for (std::vector<Voxel>& row : layer.rows) {
    for (Voxel& voxel : row) voxel.fractions = mix;
  }
}

std::size_t voxels_of(const Layer& layer, std::uint8_t material) {
  const std::vector<std::uint8_t> chosen = materials_of(layer);
  return static_cast<std::size_t>(std::count(chosen.begin(), chosen.end(), material));
}

// Nothing of a minor material is carried, so no row waits for its first voxel of it.
TEST(ErrorDiffusion, PlacesMinorMaterialsFromTheFirstVoxelOn) {
  Layer layer(4000, 10);
  fill_all(layer, {0.01f, 0.99f});
  ErrorDiffusion diffusion(2);
  diffuse(diffusion, layer, 3);
  for (const std::vector<Voxel>& row : layer.rows) {
    const auto count = std::count_if(row.begin(), row.begin() + 1000, [](const Voxel& v) { return v.material == 1; });
    EXPECT_NEAR(static_cast<double>(count), 10, 4);
  }
  EXPECT_NEAR(static_cast<double>(voxels_of(layer, 1)), 400, 12);
}

TEST(ErrorDiffusion, SharesWhatMinorMaterialsLeaveAmongTheOthers) {
  const Mix mix = {0.004f, 0.3f, 0.02f, 0.676f};
  Layer layer(600, 400);
  fill_all(layer, mix);
  ErrorDiffusion diffusion(4);
  diffuse(diffusion, layer, 0);
  for (std::uint8_t m = 1; m <= 4; ++m) {
    EXPECT_NEAR(static_cast<double>(voxels_of(layer, m)) / 240'000, mix[m - 1u], 6e-4) << "material " << int{m};
  }
}

TEST(ErrorDiffusion, MixesOfMinorMaterialsAloneHaveNoOthers) {
  for (const std::size_t present : {6u, 7u, 8u}) {
    Mix mix{};
    std::fill_n(mix.begin(), present, 1 / static_cast<float>(present));
    Layer layer(640, 400);
    fill_all(layer, mix);
    ErrorDiffusion diffusion(kMaxPrintMaterials);
    diffuse(diffusion, layer, 5);
    for (std::uint8_t m = 1; m <= kMaxPrintMaterials; ++m) {
      EXPECT_NEAR(static_cast<double>(voxels_of(layer, m)) / 256'000, mix[m - 1u], mix[m - 1u] * 2e-3)
          << "material " << int{m} << " of " << present;
    }
  }
}

TEST(ErrorDiffusion, AMaterialBelowATenthOfAThousandthIsNowhere) {
  Layer layer(2000, 200);
  fill_all(layer, {9e-5f, 0.4f, 0.59991f});
  ErrorDiffusion diffusion(3);
  diffuse(diffusion, layer, 0);
  EXPECT_EQ(voxels_of(layer, 1), 0u);
}

TEST(ErrorDiffusion, LayersDependOnNothingBefore) {
  std::mt19937 random(kSeed);
  for (const std::size_t materials : {2u, 5u}) {
    ErrorDiffusion kept(materials);
    for (std::uint32_t seed = 0; seed < 10; ++seed) {
      Layer layer = random_shape(random);
      fill(layer, materials, random);
      ErrorDiffusion fresh(materials);
      diffuse(fresh, layer, seed);
      const std::vector<std::uint8_t> expected = materials_of(layer);
      diffuse(kept, layer, seed);
      EXPECT_EQ(materials_of(layer), expected);
      diffuse(kept, layer, seed + 1);
      EXPECT_NE(materials_of(layer), expected);
    }
  }
}

TEST(ErrorDiffusion, ASingleMaterialIsEverywhere) {
  Layer layer(130, 3);
  for (std::vector<Voxel>& row : layer.rows) {
    for (Voxel& voxel : row) voxel.fractions[0] = 1;
  }
  ErrorDiffusion diffusion(1);
  diffuse(diffusion, layer, 0);
  EXPECT_EQ(materials_of(layer), std::vector<std::uint8_t>(390, 1));
}

}  // namespace
}  // namespace ccslice
