// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Jobs that show materials, from the solid to the packed numbers.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/job/validate_job.h"
#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "core/slicer/layer_slicer.h"
#include "tests/core/slicer/test_jobs.h"
#include "tests/support/slice_range.h"

namespace ccslice {
namespace {

PlaneSpec materials(SampleType type = SampleType::kUint8) {
  PlaneSpec plane;
  plane.content = PlaneContent::kMaterials;
  plane.sample_type = type;
  plane.encoding = Encoding::kRaw;
  return plane;
}

PlaneSpec mask(std::uint32_t material) {
  PlaneSpec plane = occupancy();
  plane.content = PlaneContent::kMaterialMask;
  plane.material = material;
  return plane;
}

/// The box set upright, with its channel from 0 at the bottom to 1 at the top, blended over three materials.
class HalftonedBox : public testing::TestWithParam<HalftoneMethod> {
 protected:
  HalftonedBox() : solid_(prepare_solid(make_box())) {
    Placement upright = Placement::Identity();
    upright.rotate(Eigen::AngleAxisd(-std::numbers::pi / 2, Vec3::UnitY()));
    job_ = job_of(solid_, {0.21, 0.33, 0.25}, upright);
    Printing printing;
    printing.materials = {{"soft", 0xff0000ff}, {"middle", 0x00ff00ff}, {"hard", 0x0000ffff}};
    printing.map.kind = BlendMap{"gradient", {{0, 1}, {0.5, 2}, {1, 3}}};
    printing.halftone = {GetParam(), 11};
    job_.printing = printing;
    job_.planes = {occupancy(), materials(), materials(SampleType::kUint2), mask(1), mask(2), mask(3)};
    validate_job(*solid_, job_);
  }

  std::vector<Layer> slice(std::uint32_t first, std::uint32_t count, int threads = 1) const {
    std::vector<Layer> layers;
    SliceRangeOptions options;
    options.threads = threads;
    slice_range(
        solid_, job_, first, count, [&](Layer&& layer) { layers.push_back(std::move(layer)); }, options);
    return layers;
  }

  Solid solid_;
  SliceJob job_;
};

TEST_P(HalftonedBox, HasOneMaterialInEachVoxelInside) {
  for (const Layer& layer : slice(0, job_.grid.extent.layers)) {
    const std::uint64_t counted =
        std::accumulate(layer.stats.material_voxels.begin(), layer.stats.material_voxels.end(), std::uint64_t{0});
    EXPECT_EQ(counted, layer.stats.voxels_inside);
    const std::uint32_t width = job_.grid.extent.columns, row_bytes = (width + 7) / 8;
    std::vector<std::uint64_t> histogram(4);
    for (std::uint32_t i = 0; i < width * job_.grid.extent.rows; ++i) {
      const std::uint8_t material = layer.planes[1].bytes[i];
      ASSERT_LE(material, 3);
      ++histogram[material];
      const auto bit = [&](std::size_t plane) {
        return layer.planes[plane].bytes[i / width * row_bytes + i % width / 8] >> (7 - i % width % 8) & 1;
      };
      ASSERT_EQ(bit(0), material != 0);
      for (std::uint8_t m = 1; m <= 3; ++m) ASSERT_EQ(bit(2u + m), material == m);
    }
    EXPECT_THAT(layer.stats.material_voxels, testing::ElementsAre(histogram[1], histogram[2], histogram[3]));
  }
}

TEST_P(HalftonedBox, LeavesVoxelsOfNothingEmpty) {
  const std::vector<Layer> full = slice(0, job_.grid.extent.layers);
  job_.printing->materials[1] = {"void", job_.printing->background_rgba, true};
  validate_job(*solid_, job_);
  const std::vector<Layer> layers = slice(0, job_.grid.extent.layers);
  std::uint64_t empty = 0;
  for (std::size_t k = 0; k < layers.size(); ++k) {
    const LayerStats& stats = layers[k].stats;
    EXPECT_EQ(stats.material_voxels, full[k].stats.material_voxels);
    EXPECT_EQ(stats.voxels_inside, full[k].stats.voxels_inside - stats.material_voxels[1]);
    for (std::size_t p = 1; p < layers[k].planes.size(); ++p) {
      EXPECT_TRUE(layers[k].planes[p].bytes == full[k].planes[p].bytes) << "plane " << p;
    }
    // What the mask of the void has, the occupancy lacks.
    const auto &occupied = layers[k].planes[0].bytes, &inside = full[k].planes[0].bytes;
    const auto& empties = layers[k].planes[4].bytes;
    for (std::size_t i = 0; i < occupied.size(); ++i) ASSERT_EQ(occupied[i], inside[i] & ~empties[i]);
    empty += stats.material_voxels[1];
  }
  EXPECT_GT(empty, 0u);
  job_.planes = {occupancy()};
  const std::vector<Layer> alone = slice(0, job_.grid.extent.layers, 2);
  for (std::size_t k = 0; k < alone.size(); ++k) {
    EXPECT_TRUE(alone[k].planes[0].bytes == layers[k].planes[0].bytes) << "no plane shows materials";
    EXPECT_EQ(alone[k].stats.material_voxels, layers[k].stats.material_voxels);
  }
}

TEST_P(HalftonedBox, KeepsAMaterialOut) {
  job_.printing->map.overrides = {{"gradient", 0.25, 1}, {"gradient", 0.5, 3, 1}, {"gradient", 0.75, 3, 2}};
  validate_job(*solid_, job_);
  for (const Layer& layer : slice(0, job_.grid.extent.layers)) {
    const double value = (layer.index + 0.5) / job_.grid.extent.layers;
    EXPECT_TRUE(value >= 0.5 || layer.stats.material_voxels[0] == 0) << "layer " << layer.index;
    EXPECT_TRUE(value >= 0.75 || layer.stats.material_voxels[1] == 0) << "layer " << layer.index;
    const bool has_mix = GetParam() != HalftoneMethod::kLargestFraction && value > 0.76 && value < 0.95;
    EXPECT_TRUE(!has_mix || layer.stats.material_voxels[1] > 0) << "layer " << layer.index;
  }
}

TEST_P(HalftonedBox, FollowsTheGradientFromLayerToLayer) {
  const std::vector<Layer> layers = slice(0, job_.grid.extent.layers);
  const double bar = GetParam() == HalftoneMethod::kWhiteNoise ? 0.05 : 0.015;
  if (GetParam() == HalftoneMethod::kLargestFraction) return;
  for (const Layer& layer : layers) {
    const double value = (layer.index + 0.5) / static_cast<double>(layers.size());
    const std::vector<std::uint64_t>& voxels = layer.stats.material_voxels;
    const double mean = static_cast<double>(voxels[1]) * 0.5 + static_cast<double>(voxels[2]);
    EXPECT_NEAR(mean / static_cast<double>(layer.stats.voxels_inside), value, bar) << "layer " << layer.index;
  }
}

TEST_P(HalftonedBox, GivesTheSameBytesForAnySplit) {
  const std::vector<Layer> whole = slice(0, job_.grid.extent.layers);
  const auto expect_same = [&](const std::vector<Layer>& part) {
    for (const Layer& layer : part) {
      for (std::size_t p = 0; p < layer.planes.size(); ++p) {
        EXPECT_TRUE(layer.planes[p].bytes == whole[layer.index].planes[p].bytes) << "layer " << layer.index;
      }
      EXPECT_EQ(layer.stats.material_voxels, whole[layer.index].stats.material_voxels);
      EXPECT_EQ(layer.stats.voxels_off_map, whole[layer.index].stats.voxels_off_map);
    }
  };
  expect_same(slice(0, job_.grid.extent.layers, 3));
  expect_same(slice(5, 1));
  expect_same(slice(9, 14));
}

TEST_P(HalftonedBox, CountsVoxelsOffTheMap) {
  std::get<BlendMap>(job_.printing->map.kind).stops = {{0.2, 1}, {0.8, 3}};
  std::uint64_t off_map = 0, inside = 0;
  for (const Layer& layer : slice(0, job_.grid.extent.layers, 2)) {
    const double value = (layer.index + 0.5) / job_.grid.extent.layers;
    const bool off = value < 0.2 - 0.6 / 128 || value > 0.8 + 0.6 / 128;
    EXPECT_EQ(layer.stats.voxels_off_map, off ? layer.stats.voxels_inside : 0) << "layer " << layer.index;
    off_map += layer.stats.voxels_off_map;
    inside += layer.stats.voxels_inside;
  }
  EXPECT_NEAR(static_cast<double>(off_map) / static_cast<double>(inside), 0.4, 0.03);
}

TEST_P(HalftonedBox, CountsVoxelsWhoseFractionsAreScaledUp) {
  job_.printing->map.kind = DirectMap{{{"gradient", 3}}};
  const std::vector<Layer> layers = slice(0, job_.grid.extent.layers);
  EXPECT_EQ(layers.front().stats.voxels_scaled_up, layers.front().stats.voxels_inside);
  EXPECT_NEAR(layers[1].stats.least_fraction_sum, 1.5 / job_.grid.extent.layers, 1e-3);
  EXPECT_EQ(layers.back().stats.voxels_scaled_up, 0u);
  EXPECT_EQ(layers.back().stats.least_fraction_sum, 0);
}

INSTANTIATE_TEST_SUITE_P(All, HalftonedBox,
                         testing::Values(HalftoneMethod::kBlueNoise, HalftoneMethod::kErrorDiffusion,
                                         HalftoneMethod::kLargestFraction, HalftoneMethod::kWhiteNoise));

using StrictBox = HalftonedBox;

TEST_P(StrictBox, RefusesWhatTheMapDoesNotCoverWithLayerAndPlace) {
  std::get<BlendMap>(job_.printing->map.kind).stops = {{0, 1}, {0.8, 3}};
  EXPECT_NO_THROW(slice(0, job_.grid.extent.layers));
  job_.printing->map.strict = true;
  const auto bad = static_cast<std::uint32_t>(0.9 * job_.grid.extent.layers);
  EXPECT_NO_THROW(slice(0, bad / 2));
  try {
    slice(bad, 1);
    FAIL() << "passed";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kFractionsOutOfRange);
    EXPECT_THAT(error.what(), testing::HasSubstr("in layer " + std::to_string(bad) + " at ("));
    EXPECT_THAT(error.what(), testing::HasSubstr(") mm"));
  }
}

INSTANTIATE_TEST_SUITE_P(BlueNoise, StrictBox, testing::Values(HalftoneMethod::kBlueNoise));

TEST(HalftonedJob, OfOneMaterialNeedsNoChannel) {
  ControlMesh mesh = make_box();
  mesh.channel_names.clear();
  mesh.channel_values.clear();
  const Solid solid = prepare_solid(mesh);
  SliceJob job;
  GridRequest request;
  request.pitch = {0.5, 0.5, 0.5};
  job.grid = plan_grid(*solid, job.placement, request);
  job.printing = Printing{.materials = {{"resin", 0xffffffff}}, .map = {}, .halftone = {}};
  job.planes = {materials(SampleType::kBit)};
  validate_job(*solid, job);
  LayerSlicer slicer(solid, job);
  const Layer layer = slicer.slice(3, {});
  EXPECT_THAT(layer.stats.material_voxels, testing::ElementsAre(layer.stats.voxels_inside));
}

}  // namespace
}  // namespace ccslice
