// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/base/message_json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "ccslice/v1/mesh.pb.h"
#include "ccslice/v1/plan.pb.h"
#include "core/base/error.h"

namespace ccslice::cli {
namespace {

using testing::HasSubstr;

TEST(MessageJson, WritesFieldsInTheirOrderAndZerosToo) {
  v1::MaterialVoxels material;
  material.set_name("soft");
  EXPECT_EQ(json_of(material), R"({"name":"soft","rgba":"","voxel_count":0})");
}

TEST(MessageJson, NumbersOf64BitsAreNumbers) {
  v1::PackageFile file;
  file.set_size_bytes(std::numeric_limits<std::uint64_t>::max());
  EXPECT_THAT(json_of(file), HasSubstr("\"size_bytes\":18446744073709551615}"));
  v1::PackageFile read;
  ASSERT_TRUE(read_json(json_of(file), read));
  EXPECT_EQ(read.size_bytes(), file.size_bytes());
}

TEST(MessageJson, LeavesOutWhatIsNotSet) {
  v1::PointAnswer outside;
  outside.set_location("outside");
  EXPECT_EQ(json_of(outside), R"({"location":"outside"})");
  v1::PlanDocument plan;
  EXPECT_THAT(json_of(plan), HasSubstr(R"("warnings":[],"notes":[])"));
}

TEST(MessageJson, VectorsAreArraysAndMapsAreSorted) {
  v1::PointAnswer answer;
  answer.mutable_point_mm()->set_y(0.1);
  answer.set_location("inside");
  for (const char* name : {"z", "a", "\"m\""}) (*answer.mutable_channel_values())[name] = 0.5;
  EXPECT_EQ(json_of(answer),
            R"({"point_mm":[0,0.1,0],"location":"inside","channel_values":{"\"m\"":0.5,"a":0.5,"z":0.5}})");
}

TEST(MessageJson, NaNIsNullButWhereAFieldTakesIt) {
  v1::Plane plane;
  plane.set_outside_sample(std::numeric_limits<double>::quiet_NaN());
  EXPECT_THAT(json_of(plane), HasSubstr(R"("outside_sample":"NaN")"));
  v1::Plane read;
  ASSERT_TRUE(read_json(json_of(plane), read));
  EXPECT_TRUE(std::isnan(read.outside_sample()));
  v1::BoundaryFile file;
  file.set_volume_mm3(plane.outside_sample());
  EXPECT_THAT(json_of(file), HasSubstr(R"("volume_mm3":null)"));
}

TEST(MessageJson, ListsAreArrays) {
  EXPECT_EQ(json_list_of(std::vector<v1::JournalHead>()), "[]");
  EXPECT_EQ(json_list_of(std::vector<v1::JournalHead>(2)), R"([{"format":"","job":""},{"format":"","job":""}])");
}

TEST(MessageJson, DoublesAreReadAsTheyWereWritten) {
  v1::LayerEntry entry;
  for (const double number : {0.1, -1e-300, 1.7976931348623157e308, 5e-324, 0.30000000000000004}) {
    entry.set_z_mm(number);
    v1::LayerEntry read;
    ASSERT_TRUE(read_json(json_of(entry), read));
    EXPECT_EQ(read.z_mm(), number);
  }
}

TEST(MessageJson, WhatDoesNotFitIsRefused) {
  v1::StoredFile file;
  EXPECT_TRUE(read_json(R"({"file":"a","unknown":{"deep":[1,null]}})", file));
  EXPECT_EQ(file.file(), "a");
  for (const char* text : {"", "[]", "{", "1", R"({"file":1})", R"({"file_bytes":-1})", R"({"file_bytes":1.5})",
                           R"({"file_bytes":18446744073709551616})", R"({"crc32":4294967296})", R"({"file_bytes":[1]})",
                           R"({"file":{"a":1}})"}) {
    EXPECT_FALSE(read_json(text, file)) << text;
  }
  EXPECT_FALSE(read_json(std::string(100'000, '['), file));
}

TEST(MessageJson, TakesFieldsOfTheSameName) {
  v1::MeshSummary mesh;
  mesh.set_mesh_id("id");
  mesh.set_limit_cells(7);
  mesh.mutable_bounding_box()->mutable_max_mm()->set_z(3);
  mesh.add_folds()->set_determinant(-1);
  const auto taken = with_fields_of<v1::ServerMesh>(mesh);
  EXPECT_EQ(taken.mesh_id(), "id");
  EXPECT_EQ(taken.limit_cells(), 7u);
  EXPECT_EQ(taken.bounding_box().max_mm().z(), 3);
  EXPECT_EQ(taken.folds(0).determinant(), -1);
  EXPECT_FALSE(taken.has_deviation());
  v1::PlanSlicesResponse plan;
  plan.mutable_grid()->mutable_origin_mm()->set_x(1);
  EXPECT_THROW((void)with_fields_of<v1::PlanDocument>(plan), Error) << "an object is no array";
}

TEST(MessageJson, ColoursAreReadAsTheyWereWritten) {
  EXPECT_EQ(colour_text(0xc8d2dcff), "#c8d2dcff");
  EXPECT_EQ(colour_of_text("#c8d2dcff"), 0xc8d2dcffu);
  for (const char* text : {"", "#c8d2dc", "c8d2dcff0", "#c8d2dcf", "#c8d2dcfg", "#c8d2dcff0"}) {
    EXPECT_FALSE(colour_of_text(text)) << text;
  }
}

}  // namespace
}  // namespace ccslice::cli
