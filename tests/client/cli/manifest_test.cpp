// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output/manifest.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "client/cli/base/message_json.h"

namespace ccslice::cli {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

client::SliceOutcome outcome_of_materials() {
  client::SliceOutcome outcome;
  outcome.voxel_count = 7;
  outcome.voxels_covered = 2;
  outcome.material_voxels = {3, 4};
  v1::SliceHeader& header = outcome.header;
  header.set_engine_version("1");
  v1::VoxelPitch& pitch = *header.mutable_grid()->mutable_pitch();
  pitch.set_x_mm(1);
  pitch.set_y_mm(2);
  pitch.set_z_mm(5);
  header.mutable_layout()->set_row_order(v1::ROW_ORDER_DESCENDING_Y);
  header.add_planes()->mutable_channel()->set_name("heat");
  header.mutable_planes(0)->set_outside_sample(std::numeric_limits<double>::quiet_NaN());
  for (const char* name : {"soft", "hard"}) header.mutable_printing()->add_materials()->set_name(name);
  return outcome;
}

v1::Manifest sample_manifest() {
  v1::SliceJob job;
  job.add_parts()->set_mesh_id("mesh");
  job.mutable_parts(0)->add_placements()->add_matrix(0.1);
  v1::PlanSlicesResponse plan;
  plan.add_warnings()->set_kind(v1::PLAN_WARNING_KIND_PART_CLIPPED);
  plan.mutable_warnings(0)->set_part(1);
  v1::Manifest manifest;
  manifest.add_layers()->set_z_mm(0.1);
  complete_manifest(outcome_of_materials(), job, plan, {"job", 1}, manifest);
  return manifest;
}

std::string fault_of(const std::string& text) {
  v1::Manifest manifest;
  return read_manifest(text, manifest);
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  EXPECT_NE(text.find(from), std::string::npos) << from;
  return text.replace(text.find(from), from.size(), to);
}

TEST(Manifest, IsReadAsItWasWritten) {
  const std::string text = json_of(sample_manifest());
  v1::Manifest read;
  ASSERT_EQ(read_manifest(text, read), "");
  EXPECT_EQ(json_of(read), text);
  EXPECT_THAT(text, HasSubstr(R"("slice_job":{"parts":[{"mesh_id":"mesh","placements":[{"matrix":[0.1]}]}]})"));
  EXPECT_THAT(text, HasSubstr(R"("planes":[{"content":"channel","channel":"heat",)"));
  EXPECT_THAT(text, HasSubstr(R"("outside_sample":"NaN","alpha":false}])"));
  EXPECT_THAT(text, HasSubstr(R"("materials":[{"name":"soft","rgba":"#00000000","voxel_count":3,"volume_cm3":0.03},)"));
  EXPECT_THAT(text, HasSubstr(R"("warnings":[{"kind":"part_clipped","message":"","part":1}],"voxel_count":7,)"
                              R"("voxels_covered":2,)"));
}

TEST(Manifest, WhatIsNoneOfOursIsSaid) {
  const std::string text = json_of(sample_manifest());
  for (const std::string& other : {std::string(), std::string("{}"), std::string("[1]"), text.substr(0, 100),
                                   replaced(text, "ccslice-layers", "ccslice-journal"),
                                   replaced(text, R"("format_version":3)", R"("format_version":"two")")}) {
    EXPECT_THAT(fault_of(other), StartsWith("isn't a manifest of layers")) << other;
  }
  EXPECT_THAT(fault_of(text.substr(0, 100)), HasSubstr("was it cut short?"));
  // Grids of other versions are numbers, say.
  const std::string older = replaced(text, R"("grid":{)", R"("grid":7,"older":{)");
  EXPECT_THAT(fault_of(replaced(older, R"("format_version":3)", R"("format_version":1)")),
              HasSubstr("another version of ccslice"));
  EXPECT_EQ(fault_of(older), "isn't as it was written; slice the layers again");
  EXPECT_EQ(fault_of(replaced(text, R"("slice_job":)", R"("job_of_slices":)")),
            "isn't as it was written; slice the layers again");
  EXPECT_EQ(fault_of(replaced(text, R"("layers":0,"part_box")", R"("layers":1e300,"part_box")")),
            "isn't as it was written; slice the layers again");
}

}  // namespace
}  // namespace ccslice::cli
