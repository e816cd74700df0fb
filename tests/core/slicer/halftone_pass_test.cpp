// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/halftone_pass.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "tests/support/halftone_block.h"

namespace ccslice {
namespace {

constexpr std::uint32_t kSeed = 20261123;
constexpr std::size_t kMaterials = 3;
constexpr std::uint32_t kLayer = 5;
constexpr double kZMm = 1.25;

/// Voxels of some rows, some of which touch.
std::vector<VoxelRun> random_spans(const LayerLattice& lattice, std::mt19937& random) {
  std::vector<VoxelRun> spans;
  for (std::uint32_t y = 0; y < lattice.height; ++y) {
    if (random() % 5 == 0) continue;
    for (auto x = static_cast<std::uint32_t>(random() % 40); x < lattice.width;) {
      const std::uint32_t end = std::min(lattice.width, x + 1 + static_cast<std::uint32_t>(random() % 150));
      spans.push_back({y, x, end});
      x = end + static_cast<std::uint32_t>(random() % 30);
    }
  }
  return spans;
}

/// Of a channel at a voxel of the layer.
float value(std::size_t channel, std::uint32_t x, std::uint32_t y) {
  return 0.2f + 0.1f * static_cast<float>((3 * x + 5 * y + 7 * channel * x) % 11);
}

class HalftonePassTest : public testing::TestWithParam<HalftoneMethod> {
 protected:
  HalftonePassTest() : plan_(printing(), 0.05, 0.05, 0.05), random_(kSeed) {}

  static Printing printing() { return shares_of(kMaterials, GetParam(), 9); }

  /// Planes of the values in a window.
  static std::vector<ContonePlane> planes(const LayerWindow& window) {
    PlaneSpec spec;
    spec.content = PlaneContent::kChannel;
    spec.sample_type = SampleType::kFloat32;
    std::vector<ContonePlane> planes;
    for (std::uint32_t channel = 0; channel < kMaterials; ++channel) {
      planes.emplace_back(spec, ChannelRange{"", 0, 10}, channel);
      planes.back().clear(window.columns, window.rows);
      for (std::uint32_t y = window.first_row; y < window.end_row(); ++y) {
        for (std::uint32_t x = window.first_column; x < window.end_column(); ++x) {
          std::array<double, kMaterials> values{};
          for (std::size_t c = 0; c < kMaterials; ++c) values[c] = value(c, x, y);
          planes.back().set(window.index(x, y), values);
        }
      }
    }
    return planes;
  }

  /// Of the whole layer: 0 outside.
  std::vector<std::uint8_t> expected(const LayerLattice& lattice, const std::vector<VoxelRun>& spans) const {
    std::vector<std::uint8_t> result(std::size_t{lattice.width} * lattice.height);
    Halftoner halftoner(plan_);
    halftoner.start_layer(lattice.width, kLayer);
    for (std::uint32_t y = 0; y < lattice.height; ++y) {
      std::vector<VoxelRun> row;
      std::copy_if(spans.begin(), spans.end(), std::back_inserter(row),
                   [&](const VoxelRun& span) { return span.row == y; });
      if (row.empty()) continue;
      halftoner.start_row(y);
      if (halftoner.reverse()) std::reverse(row.begin(), row.end());
      for (const VoxelRun& span : row) choose(halftoner, span, &result[std::size_t{lattice.width} * y]);
    }
    return result;
  }

  /// Block by block; each voxel's fractions are its values' shares of their sum.
  static void choose(Halftoner& halftoner, const VoxelRun& span, std::uint8_t* row) {
    constexpr auto kBlock = static_cast<std::uint32_t>(kMixBlock);
    std::vector<std::uint32_t> blocks;
    for (std::uint32_t block = span.begin / kBlock; block * kBlock < span.end; ++block) blocks.push_back(block);
    if (halftoner.reverse()) std::reverse(blocks.begin(), blocks.end());
    for (const std::uint32_t block : blocks) {
      const std::uint32_t left = block * kBlock, begin = std::max(span.begin, left),
                          end = std::min(span.end, left + kBlock);
      Fractions fractions{};
      for (std::uint32_t x = begin; x < end; ++x) {
        float sum = 0;
        for (std::size_t m = 0; m < kMaterials; ++m) sum += value(m, x, span.row);
        for (std::size_t m = 0; m < kMaterials; ++m) fractions[m][x - left] = value(m, x, span.row) / sum;
      }
      std::array<std::uint8_t, kMixBlock> chosen{};
      halftoner.choose(block, begin - left, end - left, fractions, chosen.data());
      std::copy(chosen.begin() + (begin - left), chosen.begin() + (end - left), row + begin);
    }
  }

  HalftonePlan plan_;
  std::mt19937 random_;
};

TEST_P(HalftonePassTest, MixesAndChoosesForEachVoxelInside) {
  HalftonePass pass(plan_);
  for (const std::uint32_t width : {200u, 64u, 131u}) {
    const LayerLattice lattice{0, 0, 0.05, 0.05, width, 30};
    const std::vector<VoxelRun> spans = random_spans(lattice, random_);
    const LayerWindow all = window_of(lattice);
    pass.run({lattice, kLayer, kZMm, all, all}, spans, planes(all), {});
    const IndexImage image = pass.image();
    EXPECT_EQ(image.width, width);
    EXPECT_EQ(image.height, 30u);
    EXPECT_THAT(std::vector(image.palette.begin(), image.palette.end()),
                testing::ElementsAreArray(palette_of(printing())));
    const std::vector<std::uint8_t> wanted = expected(lattice, spans);
    std::size_t differ = 0;  // Where fractions are rounded in another way.
    for (std::size_t k = 0; k < wanted.size(); ++k) {
      ASSERT_EQ(image.indices[k] == 0, wanted[k] == 0) << k;
      differ += image.indices[k] != wanted[k];
    }
    EXPECT_EQ(differ, 0u) << "seed " << kSeed;
    ASSERT_EQ(pass.histogram().size(), kMaterials);
    for (std::size_t m = 1; m <= kMaterials; ++m) {
      EXPECT_EQ(pass.histogram()[m - 1], static_cast<std::uint64_t>(std::count(wanted.begin(), wanted.end(), m)));
    }
  }
}

// Error diffusion asks for whole rows from the first one on.
TEST_P(HalftonePassTest, WindowsAreCropsOfTheLayer) {
  const LayerLattice lattice{0, 0, 0.05, 0.05, 190, 40};
  const std::vector<VoxelRun> spans = random_spans(lattice, random_);
  const std::vector<std::uint8_t> wanted = expected(lattice, spans);
  const bool diffuses = GetParam() == HalftoneMethod::kErrorDiffusion;
  const LayerWindow window = diffuses ? LayerWindow{0, 0, 190, 33} : LayerWindow{37, 8, 101, 17};
  const LayerWindow counted{50, 10, 70, 12};
  HalftonePass pass(plan_);
  pass.run({lattice, kLayer, kZMm, window, counted}, spans, planes(window), {});
  std::vector<std::uint64_t> histogram(kMaterials);
  for (std::uint32_t y = window.first_row; y < window.end_row(); ++y) {
    for (std::uint32_t x = window.first_column; x < window.end_column(); ++x) {
      const std::uint8_t material = wanted[std::size_t{lattice.width} * y + x];
      ASSERT_EQ(pass.image().indices[window.index(x, y)], material) << x << ' ' << y;
      const bool counts = x >= 50 && x < 120 && y >= 10 && y < 22;
      if (counts && material != 0) ++histogram[material - 1u];
    }
  }
  EXPECT_EQ(pass.histogram(), histogram);
}

// Of the counted voxels alone, each by its own map.
TEST_P(HalftonePassTest, CountsVoxelsThatTheirMapsDoNotTake) {
  const LayerLattice lattice{0, 0, 0.05, 0.05, 190, 40};
  const std::vector<VoxelRun> spans = random_spans(lattice, random_);
  std::vector<RegionRun> runs;
  for (const VoxelRun& span : spans) runs.push_back({span, static_cast<std::uint8_t>(span.row % 2)});
  Printing by_region = printing();
  by_region.cell_region_maps = {{1, {BlendMap{"2", {{0.4, 1}, {0.8, 2}}}}}};
  const HalftonePlan plan(by_region, 0.05, 0.05, 0.05);
  const LayerWindow all = window_of(lattice);
  HalftonePass pass(plan);
  for (const LayerWindow& counted : {all, LayerWindow{50, 10, 70, 12}}) {
    pass.run({lattice, kLayer, kZMm, all, counted}, runs, planes(all), {});
    std::uint64_t off_map = 0, scaled_up = 0;
    double least = 1;
    for (const VoxelRun& span : spans) {
      const VoxelRun part = counted.clipped(span);
      for (std::uint32_t x = part.begin; x < part.end; ++x) {
        const double sum = double{value(0, x, span.row)} + value(1, x, span.row) + value(2, x, span.row);
        if (span.row % 2 == 0) {
          off_map += sum > 1 + 1.0 / 128 || value(0, x, span.row) > 1.01 || value(1, x, span.row) > 1.01 ||
                     value(2, x, span.row) > 1.01;
          scaled_up += sum < 1 - 1.0 / 128;
          least = std::min(least, sum);
        } else {
          off_map += value(2, x, span.row) < 0.39 || value(2, x, span.row) > 0.81;
        }
      }
    }
    EXPECT_EQ(pass.misfits().off_map, off_map);
    EXPECT_EQ(pass.misfits().scaled_up, scaled_up);
    EXPECT_GT(scaled_up, 0u);
    EXPECT_NEAR(pass.misfits().least_sum, least, 1e-6);
  }
}

/// The spans, cut at random.
std::vector<RegionRun> random_regions(const std::vector<VoxelRun>& spans, std::uint8_t regions, std::mt19937& random) {
  std::vector<RegionRun> runs;
  for (const VoxelRun& span : spans) {
    for (std::uint32_t x = span.begin; x < span.end;) {
      const std::uint32_t end = std::min(span.end, x + 1 + static_cast<std::uint32_t>(random() % 50));
      runs.push_back({{span.row, x, end}, static_cast<std::uint8_t>(random() % regions)});
      x = end;
    }
  }
  return runs;
}

TEST_P(HalftonePassTest, RegionsOfOneMapAreAsThoughThereWereNone) {
  const LayerLattice lattice{0, 0, 0.05, 0.05, 190, 40};
  const std::vector<VoxelRun> spans = random_spans(lattice, random_);
  Printing by_region = printing();
  by_region.cell_region_maps = {{2, by_region.map}, {0, by_region.map}};
  const HalftonePlan plan(by_region, 0.05, 0.05, 0.05);
  const LayerWindow all = window_of(lattice);
  HalftonePass pass(plan);
  const std::vector<RegionRun> runs = random_regions(spans, 3, random_);
  pass.run({lattice, kLayer, kZMm, all, all}, runs, planes(all), {});
  const std::vector<std::uint8_t> wanted = expected(lattice, spans);
  EXPECT_TRUE(std::ranges::equal(pass.image().indices, wanted)) << "seed " << kSeed;
}

// Each voxel is chosen from what its own region's map mixes: with methods that carry no errors it is as in a layer
// that has this map alone; with all of them a region has materials of its map only.
TEST_P(HalftonePassTest, RegionsAreMixedByTheirOwnMaps) {
  const LayerLattice lattice{0, 0, 0.05, 0.05, 190, 40};
  const std::vector<VoxelRun> spans = random_spans(lattice, random_);
  const std::vector<RegionRun> runs = random_regions(spans, 3, random_);
  const LayerWindow all = window_of(lattice);
  const HalftonePass::Place place{lattice, kLayer, kZMm, all, all};
  Printing by_region = printing();
  by_region.cell_region_maps = {{1, {PureMap{3}}}, {0, {BlendMap{"2", {{0.2, 1}, {1.2, 2}}}}}};
  const HalftonePlan plan(by_region, 0.05, 0.05, 0.05);
  HalftonePass pass(plan);
  pass.run(place, runs, planes(all), {});
  const std::array<MaterialMap, 3> maps = {by_region.cell_region_maps[1].map, by_region.cell_region_maps[0].map,
                                           by_region.map};
  for (std::uint8_t region = 0; region < 3; ++region) {
    Printing alone = printing();
    alone.map = maps[region];
    const HalftonePlan plan_alone(alone, 0.05, 0.05, 0.05);
    std::vector<ContonePlane> own;
    for (const std::string& channel : channels_of(alone)) own.push_back(planes(all)[std::stoul(channel)]);
    HalftonePass pass_alone(plan_alone);
    pass_alone.run(place, spans, own, {});
    for (const RegionRun& run : runs) {
      if (run.region != region) continue;
      for (std::uint32_t x = run.begin; x < run.end; ++x) {
        const std::uint8_t material = pass.image().indices[all.index(x, run.row)];
        if (GetParam() != HalftoneMethod::kErrorDiffusion) {
          ASSERT_EQ(material, pass_alone.image().indices[all.index(x, run.row)]) << x << ' ' << run.row;
        } else if (region < 2) {
          ASSERT_TRUE(region == 1 ? material == 3 : material <= 2) << x << ' ' << run.row;
        }
      }
    }
  }
}

TEST_P(HalftonePassTest, LayersCanBeCancelled) {
  const LayerLattice lattice{0, 0, 0.05, 0.05, 70, 4};
  const LayerWindow all = window_of(lattice);
  const CancellationToken cancel = CancellationToken::make();
  cancel.cancel();
  HalftonePass pass(plan_);
  EXPECT_THROW(pass.run({lattice, kLayer, kZMm, all, all}, std::span<const VoxelRun>(), planes(all), cancel), Error);
}

INSTANTIATE_TEST_SUITE_P(Methods, HalftonePassTest,
                         testing::Values(HalftoneMethod::kBlueNoise, HalftoneMethod::kErrorDiffusion,
                                         HalftoneMethod::kLargestFraction, HalftoneMethod::kWhiteNoise));

TEST(StrictHalftonePass, SaysWhereValuesGiveNoFractions) {
  Printing printing = shares_of(2, HalftoneMethod::kLargestFraction);
  printing.map.strict = true;
  const HalftonePlan plan(printing, 0.05, 0.05, 0.05);
  const LayerLattice lattice{1, 2, 0.5, 0.25, 150, 3};
  const LayerWindow all = window_of(lattice);
  PlaneSpec spec;
  spec.content = PlaneContent::kChannel;
  spec.sample_type = SampleType::kFloat32;
  std::vector<ContonePlane> planes;
  for (const std::uint32_t channel : {0u, 1u}) {
    planes.emplace_back(spec, ChannelRange{"", 0, 1}, channel);
    planes.back().clear(all.columns, all.rows);
    for (std::size_t k = 0; k < std::size_t{150} * 3; ++k) planes.back().set(k, std::array{0.25, 0.75});
    planes.back().set(all.index(100, 1), std::array{0.25, 0.5});
  }
  HalftonePass pass(plan);
  const HalftonePass::Place place{lattice, 7, 3.5, all, all};
  const std::vector<VoxelRun> good = {{0, 0, 150}, {1, 0, 100}, {1, 101, 150}}, bad = {{1, 70, 150}};
  pass.run(place, good, planes, {});
  EXPECT_EQ(pass.histogram()[1], 299u);
  try {
    pass.run(place, bad, planes, {});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kFractionsOutOfRange);
    // Voxel (100, 1) of layer 7.
    EXPECT_THAT(error.what(), testing::HasSubstr("layer 7 at (51.25, 2.375, 3.5) mm"));
    EXPECT_THAT(error.what(), testing::HasSubstr("0.25, 0.5;"));
  }
}

}  // namespace
}  // namespace ccslice
