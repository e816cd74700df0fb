// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output/job_costs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <vector>

namespace ccslice::cli {
namespace {

TEST(JobCosts, SamplesStandForEveryLayerOnce) {
  for (const std::uint32_t layers : {1u, 2u, 15u, 16u, 17u, 63u, 64u, 100u, 1023u, 7407u, 1000000u}) {
    std::uint32_t begin = 5, sampled = 0;
    for (const LayerSample& sample : layers_to_sample(5, layers)) {
      EXPECT_GE(sample.first_layer, begin) << layers;
      begin += sample.stands_for;
      EXPECT_GE(sample.layer_count, 1u) << layers;
      EXPECT_LE(sample.first_layer + sample.layer_count, begin) << layers;
      sampled += sample.layer_count;
    }
    EXPECT_EQ(begin, 5 + layers);
    EXPECT_LE(sampled, 256u);
    EXPECT_LE(sampled, layers <= 16 ? layers : std::max(16u, layers / 4));
    EXPECT_GE(sampled, std::min(layers, 16u));
  }
}

client::SliceOutcome outcome(std::uint64_t voxels) {
  client::SliceOutcome outcome;
  v1::VoxelPitch& pitch = *outcome.header.mutable_grid()->mutable_pitch();
  pitch.set_x_mm(0.1);
  pitch.set_y_mm(0.1);
  pitch.set_z_mm(0.1);
  for (const char* name : {"hard", "soft"}) outcome.header.mutable_printing()->add_materials()->set_name(name);
  outcome.voxel_count = voxels;
  outcome.material_voxels = {voxels / 4, voxels - voxels / 4};
  outcome.encoded_bytes = 10 * voxels;
  return outcome;
}

TEST(JobCosts, CountSamplesAsOftenAsLayersThatTheyStandFor) {
  JobCosts costs;
  costs.add({0, 2, 10}, outcome(400));
  costs.add({10, 5, 5}, outcome(1000));
  const v1::JobCosts document = costs.document({});
  EXPECT_EQ(document.sampled_layers(), 7u);
  EXPECT_EQ(document.voxel_count(), 3000u);
  EXPECT_DOUBLE_EQ(document.volume_cm3(), 0.003);
  EXPECT_EQ(document.encoded_bytes(), 30000u);
  ASSERT_EQ(document.materials_size(), 2);
  EXPECT_EQ(document.materials(0).name(), "hard");
  EXPECT_EQ(document.materials(0).voxel_count(), 750u);
  EXPECT_DOUBLE_EQ(document.materials(1).volume_cm3(), 0.00225);
  EXPECT_EQ(costs.text({}),
            "\n  costs      about 0.003 cm3 and 30.0 kB, from 7 of 15 layers"
            "\n  materials  hard 0.00075 cm3 (25 %), soft 0.00225 cm3 (75 %)");
}

TEST(JobCosts, WeighMaterialsWhoseDensityIsKnown) {
  JobCosts costs;
  client::SliceOutcome sliced = outcome(400'000);
  sliced.header.mutable_printing()->mutable_materials(0)->set_density_g_per_cm3(1.2);
  costs.add({0, 1, 1}, sliced);
  EXPECT_DOUBLE_EQ(costs.document({}).materials(0).grams(), 0.12);
  EXPECT_FALSE(costs.document({}).materials(1).has_grams());
  EXPECT_THAT(costs.text({}), testing::HasSubstr("hard 0.1 cm3 (25 %) 0.12 g, soft 0.3 cm3 (75 %)"));
  JobCosts both;
  sliced.header.mutable_printing()->mutable_materials(1)->set_density_g_per_cm3(1);
  both.add({0, 1, 1}, sliced);
  EXPECT_THAT(both.text({}), testing::EndsWith("soft 0.3 cm3 (75 %) 0.3 g, in all 0.42 g"));
}

}  // namespace
}  // namespace ccslice::cli
