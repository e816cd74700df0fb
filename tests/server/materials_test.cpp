// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "tests/server/test_meshes.h"
#include "tests/server/test_server.h"
#include "tests/support/job_parts.h"

namespace ccslice::server {
namespace {

/// A block of 10 mm whose channel x goes from 0 to 10, blended from soft to hard.
class Materials : public ::testing::Test {
 protected:
  Materials() {
    request_.mutable_job()->clear_planes();
    request_.mutable_job()->add_planes()->mutable_materials();
    request_.mutable_job()->mutable_planes(0)->set_encoding(v1::PLANE_ENCODING_RAW);
    v1::Printing& printing = *request_.mutable_job()->mutable_printing();
    add_material("soft", 0xff0000ff);
    add_material("hard", 0x00ff00ff);
    v1::BlendMap& blend = *printing.mutable_map()->mutable_blend();
    blend.set_channel("x");
    add_stop(0, "soft");
    add_stop(10, "hard");
  }

  void add_material(const std::string& name, std::uint32_t rgba) {
    v1::PrintMaterial& material = *request_.mutable_job()->mutable_printing()->add_materials();
    material.set_name(name);
    material.set_rgba(rgba);
  }
  v1::BlendMap& blend() { return *request_.mutable_job()->mutable_printing()->mutable_map()->mutable_blend(); }
  void add_stop(double value, const std::string& material) {
    v1::BlendStop& stop = *blend().add_stops();
    stop.set_value(value);
    stop.set_material(material);
  }

  void expect(const std::string& reason, const std::string& field) {
    const Failure failure = server_.slice_failure(request_);
    EXPECT_EQ(failure.code, grpc::StatusCode::INVALID_ARGUMENT) << failure.message;
    EXPECT_EQ(failure.reason, reason) << failure.message;
    EXPECT_EQ(failure.field, field) << failure.message;
  }

  TestServer server_;
  v1::SliceRangeRequest request_ = slice_request(server_.upload_good(make_box(2, 10)), 0.25, 0, 40);
};

TEST_F(Materials, AreCountedAndAddUpToTheOccupancy) {
  const Sliced sliced = server_.slice(request_);
  ASSERT_TRUE(sliced.status.ok()) << sliced.status.error_message();
  EXPECT_EQ(sliced.header.planes(0).sample_type(), v1::SAMPLE_TYPE_UINT2);
  EXPECT_TRUE(sliced.header.planes(0).has_materials());
  EXPECT_EQ(sliced.header.printing().halftone().method(), v1::HALFTONE_METHOD_BLUE_NOISE);
  EXPECT_EQ(sliced.header.printing().background_rgba(), 0x000000ffu);
  EXPECT_EQ(sliced.header.printing().map().blend().stops(1).material(), "hard");
  ASSERT_EQ(sliced.ends.size(), 40u);
  for (const auto& [index, end] : sliced.ends) {
    ASSERT_EQ(end.statistics().material_voxels_size(), 2);
    EXPECT_EQ(end.statistics().material_voxels(0) + end.statistics().material_voxels(1), end.voxel_count());
    EXPECT_NEAR(static_cast<double>(end.statistics().material_voxels(1)), 800, 80);
    EXPECT_EQ(sliced.planes.at(index)[0].size(), 400u);
  }
}

TEST_F(Materials, OfValuesOffTheMapAreWarnedOf) {
  v1::PlanSlicesRequest request;
  part_of(*request.mutable_job()).set_mesh_id(request_.job().parts(0).mesh_id());
  *request.mutable_job()->mutable_grid() = request_.job().grid();
  *request.mutable_job()->mutable_planes() = request_.job().planes();
  *request.mutable_job()->mutable_printing() = request_.job().printing();
  const auto warnings = [&] {
    grpc::ClientContext context;
    v1::PlanSlicesResponse plan;
    EXPECT_TRUE(server_.stub().PlanSlices(&context, request, &plan).ok());
    std::string text;
    for (const v1::PlanWarning& warning : plan.warnings()) {
      if (warning.kind() == v1::PLAN_WARNING_KIND_VALUES_OFF_MAP) text += warning.message();
    }
    return text;
  };
  EXPECT_EQ(warnings(), "");
  for (auto& stop : *request.mutable_job()->mutable_printing()->mutable_map()->mutable_blend()->mutable_stops()) {
    stop.set_value(stop.value() / 100);
  }
  EXPECT_THAT(warnings(),
              testing::AllOf(testing::HasSubstr("the material map covers 0 to 0.1: about 100 % of the volume"),
                             testing::HasSubstr("takes what the nearer end gives")));
}

// The channel goes from 0 to 10, so the fraction from 0 to 10: below 1 in a tenth of the part.
TEST_F(Materials, OfFractionsBelowOneAreWarnedOfAndCounted) {
  const std::string channel = request_.job().printing().map().blend().channel();
  v1::DirectShare& share = *request_.mutable_job()->mutable_printing()->mutable_map()->mutable_direct()->add_shares();
  share.set_channel(channel);
  share.set_material("hard");
  v1::PlanSlicesRequest request;
  part_of(*request.mutable_job()).set_mesh_id(request_.job().parts(0).mesh_id());
  *request.mutable_job()->mutable_grid() = request_.job().grid();
  *request.mutable_job()->mutable_planes() = request_.job().planes();
  *request.mutable_job()->mutable_printing() = request_.job().printing();
  grpc::ClientContext context;
  v1::PlanSlicesResponse plan;
  ASSERT_TRUE(server_.stub().PlanSlices(&context, request, &plan).ok());
  std::string text;
  for (const v1::PlanWarning& warning : plan.warnings()) {
    if (warning.kind() == v1::PLAN_WARNING_KIND_FRACTIONS_BELOW_ONE) text += warning.message();
  }
  EXPECT_THAT(text, testing::AllOf(testing::HasSubstr("the fractions of the material map add up to less than 1"),
                                   testing::HasSubstr("rest=NAME")));
  const Sliced sliced = server_.slice(request_);
  ASSERT_TRUE(sliced.status.ok()) << sliced.status.error_message();
  std::uint64_t off_map = 0, scaled_up = 0, voxels = 0;
  for (const auto& [index, end] : sliced.ends) {
    off_map += end.statistics().voxels_off_map();
    scaled_up += end.statistics().voxels_scaled_up();
    voxels += end.voxel_count();
  }
  EXPECT_GT(scaled_up, 0u);
  EXPECT_LE(scaled_up + off_map, voxels);
  EXPECT_EQ(sliced.summary.voxels_off_map(), off_map);
  EXPECT_EQ(sliced.summary.voxels_scaled_up(), scaled_up);
  EXPECT_LT(sliced.summary.least_fraction_sum(), 1);
}

// Voxels of 0.25 mm: those of columns 0 to 9 are below 2.5, where x is the channel.
TEST_F(Materials, AreOfTheFirstOverrideThatHolds) {
  add_material("skin", 0x0000ffff);
  v1::MaterialMap& map = *request_.mutable_job()->mutable_printing()->mutable_map();
  for (const auto& [below, material] : {std::pair(2.5, "skin"), {5.0, "hard"}}) {
    v1::MapOverride& first = *map.add_overrides();
    first.set_channel("x");
    first.set_below(below);
    first.set_material(material);
  }
  const Sliced sliced = server_.slice(request_);
  ASSERT_TRUE(sliced.status.ok()) << sliced.status.error_message();
  ASSERT_EQ(sliced.header.printing().map().overrides_size(), 2);
  EXPECT_EQ(sliced.header.printing().map().overrides(1).material(), "hard");
  EXPECT_EQ(sliced.header.printing().map().overrides(1).below(), 5.0);
  const auto& counts = sliced.ends.at(20).statistics().material_voxels();
  EXPECT_EQ(counts[2], 400u) << "a quarter of 40 x 40";
  EXPECT_NEAR(static_cast<double>(counts[0]), 200, 60) << "a quarter of what is beyond 5";
  map.mutable_overrides(1)->set_channel("depth");
  expect("CHANNEL_UNKNOWN", "job.printing.map.overrides[1].channel");
  map.mutable_overrides(1)->set_channel("x");
  map.mutable_overrides(1)->set_material("gold");
  expect("MATERIAL_UNKNOWN", "job.printing.map.overrides[1].material");
  map.mutable_overrides(1)->set_material("hard");
  map.mutable_overrides(1)->set_below(std::numeric_limits<double>::infinity());
  expect("MATERIAL_MAP_NON_FINITE", "job.printing.map.overrides[1].below");
}

TEST_F(Materials, MayBeNothing) {
  request_.mutable_job()->add_planes()->mutable_occupancy();
  const Sliced full = server_.slice(request_);
  ASSERT_TRUE(full.status.ok()) << full.status.error_message();
  v1::PrintMaterial& hard = *request_.mutable_job()->mutable_printing()->mutable_materials(1);
  hard.set_leaves_empty(true);
  hard.set_rgba(0x000000ff);  // The background's.
  const Sliced sliced = server_.slice(request_);
  ASSERT_TRUE(sliced.status.ok()) << sliced.status.error_message();
  EXPECT_TRUE(sliced.header.printing().materials(1).leaves_empty());
  const v1::LayerEnd& end = sliced.ends.at(20);
  const auto& voxels = end.statistics().material_voxels();
  EXPECT_GT(voxels[1], 0u);
  EXPECT_EQ(end.voxel_count(), voxels[0]);
  EXPECT_EQ(full.ends.at(20).voxel_count(), voxels[0] + voxels[1]);
  EXPECT_EQ(full.summary.voxel_count() - sliced.summary.voxel_count(), [&] {
    std::uint64_t empty = 0;
    for (const auto& layer : sliced.ends) empty += layer.second.statistics().material_voxels(1);
    return empty;
  }());
  request_.mutable_job()->mutable_printing()->mutable_materials(0)->set_leaves_empty(true);
  expect("MATERIALS_MISSING", "job.printing.materials");
}

TEST_F(Materials, AreKeptOut) {
  add_material("skin", 0x0000ffff);
  v1::MaterialMap& map = *request_.mutable_job()->mutable_printing()->mutable_map();
  v1::MapOverride& own = *map.add_overrides();
  own.set_channel("x");
  own.set_below(5);
  own.set_material("skin");
  own.set_instead_of("hard");
  const Sliced sliced = server_.slice(request_);
  ASSERT_TRUE(sliced.status.ok()) << sliced.status.error_message();
  EXPECT_EQ(sliced.header.printing().map().overrides(0).instead_of(), "hard");
  const auto& counts = sliced.ends.at(20).statistics().material_voxels();
  EXPECT_NEAR(static_cast<double>(counts[2]), 200, 60) << "a quarter of what is below 5";
  EXPECT_NEAR(static_cast<double>(counts[1]), 600, 60);
  own.set_instead_of("gold");
  expect("MATERIAL_UNKNOWN", "job.printing.map.overrides[0].instead_of");
  own.set_instead_of("skin");
  expect("MATERIAL_MAP_INVALID", "job.printing.map.overrides[0].material");
}

TEST_F(Materials, HaveMasks) {
  request_.mutable_job()->add_planes()->mutable_material_mask()->set_material("hard");
  const Sliced sliced = server_.slice(request_);
  ASSERT_TRUE(sliced.status.ok()) << sliced.status.error_message();
  EXPECT_EQ(sliced.header.planes(1).material_mask().material(), "hard");
  EXPECT_EQ(sliced.header.planes(1).sample_type(), v1::SAMPLE_TYPE_BIT);
}

TEST_F(Materials, AreRefusedWithReasonsOfTheirOwn) {
  const v1::SliceRangeRequest good = request_;
  add_material("hard", 0x0000ffff);
  expect("MATERIAL_NAME_REPEATED", "job.printing.materials[2].name");
  request_.mutable_job()->mutable_printing()->mutable_materials(2)->set_name("");
  expect("MATERIAL_NAME_INVALID", "job.printing.materials[2].name");
  request_.mutable_job()->mutable_printing()->mutable_materials(2)->set_name("clear");
  request_.mutable_job()->mutable_printing()->mutable_materials(2)->set_rgba(0x00ff00ff);
  expect("MATERIAL_COLOUR_REPEATED", "job.printing.materials[2].rgba");
  for (std::uint32_t i = 3; i < 9; ++i) add_material(std::to_string(i), i);
  expect("TOO_MANY_MATERIALS", "job.printing.materials");
  request_.mutable_job()->mutable_printing()->clear_materials();
  expect("MATERIALS_MISSING", "job.printing.materials");
  request_.mutable_job()->clear_printing();
  expect("MATERIALS_MISSING", "job.printing.materials");
  request_ = good;
  request_.mutable_job()->mutable_planes(0)->mutable_material_mask()->set_material("gold");
  expect("MATERIAL_UNKNOWN", "job.planes[0].material_mask.material");
  request_ = good;
  request_.mutable_job()->mutable_printing()->mutable_halftone()->set_method(static_cast<v1::HalftoneMethod>(77));
  expect("ENUM_VALUE_UNKNOWN", "job.printing.halftone.method");
}

TEST_F(Materials, NeedAMapThatMakesSense) {
  const v1::SliceRangeRequest good = request_;
  blend().set_channel("colour");
  expect("CHANNEL_UNKNOWN", "job.printing.map.blend.channel");
  request_ = good;
  blend().mutable_stops(1)->set_material("gold");
  expect("MATERIAL_UNKNOWN", "job.printing.map.blend.stops[1].material");
  request_ = good;
  blend().mutable_stops(1)->set_value(std::numeric_limits<double>::quiet_NaN());
  expect("MATERIAL_MAP_NON_FINITE", "job.printing.map.blend.stops[1].value");
  blend().mutable_stops(1)->set_value(-1);
  expect("MATERIAL_MAP_INVALID", "job.printing.map.blend.stops[1].value");
  request_.mutable_job()->mutable_printing()->mutable_map()->Clear();
  expect("MATERIAL_MAP_INVALID", "job.printing.map");
  request_.mutable_job()->mutable_printing()->clear_map();
  expect("MATERIAL_MAP_MISSING", "job.printing.map");
}

TEST_F(Materials, OfStrictMapsFailWhereTheFractionsDo) {
  blend().mutable_stops(1)->set_value(5);
  EXPECT_TRUE(server_.slice(request_).status.ok());
  request_.mutable_job()->mutable_printing()->mutable_map()->set_strict(true);
  expect("FRACTIONS_OUT_OF_RANGE", "job.printing.map.strict");
}

}  // namespace
}  // namespace ccslice::server
