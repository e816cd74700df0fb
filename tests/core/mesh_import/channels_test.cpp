// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/channels.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/error.h"

namespace ccslice {
namespace {

using testing::ElementsAre;

TEST(Channels, OfOneComponentHaveTheArraysName) {
  const std::vector<NamedChannel> one = open_channels("hardness", 1);
  ASSERT_EQ(one.size(), 1u);
  EXPECT_EQ(one[0].name, "hardness");
  EXPECT_TRUE(one[0].values.empty());
}

TEST(Channels, OfSeveralComponentsAreNumbered) {
  const std::vector<NamedChannel> three = open_channels("colour", 3);
  ASSERT_EQ(three.size(), 3u);
  EXPECT_EQ(three[0].name, "colour.0");
  EXPECT_EQ(three[2].name, "colour.2");
  EXPECT_TRUE(open_channels("none", 0).empty());
}

TEST(Channels, AreAppendedVertexByVertex) {
  ControlMesh mesh;
  mesh.positions.resize(2);
  append_channels(std::vector<NamedChannel>{{"a", {1, 2}}}, mesh);
  EXPECT_THAT(mesh.channel_values, ElementsAre(1, 2));
  append_channels(std::vector<NamedChannel>{{"b", {3, 4}}, {"c", {5, 6}}}, mesh);
  EXPECT_THAT(mesh.channel_names, ElementsAre("a", "b", "c"));
  EXPECT_THAT(mesh.channel_values, ElementsAre(1, 3, 5, 2, 4, 6));
  append_channels({}, mesh);
  EXPECT_THAT(mesh.channel_values, ElementsAre(1, 3, 5, 2, 4, 6));
}

TEST(Channels, WithoutAValueForEachVertexChangeNothing) {
  ControlMesh mesh;
  mesh.positions.resize(2);
  try {
    append_channels(std::vector<NamedChannel>{{"a", {1, 2}}, {"b", {3}}}, mesh);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kFileSyntax);
    EXPECT_THAT(error.what(), testing::HasSubstr("'b' has 1 values for 2 points"));
  }
  EXPECT_TRUE(mesh.channel_names.empty());
  EXPECT_TRUE(mesh.channel_values.empty());
}

ControlMesh with_channels(const std::vector<std::string>& names) {
  ControlMesh mesh;
  mesh.positions.resize(2);
  for (std::size_t c = 0; c < names.size(); ++c) {
    const float value = static_cast<float>(c);
    append_channels(std::vector<NamedChannel>{{names[c], {value, value + 10}}}, mesh);
  }
  return mesh;
}

TEST(Channels, AreLeftOutByName) {
  ControlMesh mesh = with_channels({"a", "b", "c"});
  mesh.region_value_vertices = {1};
  mesh.region_value_regions = {0};
  mesh.region_values = {5, 6, 7};
  mesh.mid_nodes.values = {20, 21, 22};
  leave_out_channel("b", mesh);
  EXPECT_THAT(mesh.channel_names, ElementsAre("a", "c"));
  EXPECT_THAT(mesh.channel_values, ElementsAre(0, 2, 10, 12));
  EXPECT_THAT(mesh.region_values, ElementsAre(5, 7));
  EXPECT_THAT(mesh.mid_nodes.values, ElementsAre(20, 22));
  leave_out_channel("a", mesh);
  leave_out_channel("c", mesh);
  EXPECT_TRUE(mesh.channel_values.empty());
  EXPECT_TRUE(mesh.region_value_vertices.empty());
}

TEST(Channels, OfAnArrayAreLeftOutTogether) {
  ControlMesh mesh = with_channels({"u.0", "u.1", "u.x", "u.", "uu.0"});
  leave_out_channel("u", mesh);
  EXPECT_THAT(mesh.channel_names, ElementsAre("u.x", "u.", "uu.0"));
  EXPECT_THAT(mesh.channel_values, ElementsAre(2, 3, 4, 12, 13, 14));
  ControlMesh both = with_channels({"u", "u.0"});
  leave_out_channel("u", both);
  EXPECT_THAT(both.channel_names, ElementsAre("u.0"));
}

TEST(Channels, ThatAreNotThereCannotBeLeftOut) {
  ControlMesh mesh = with_channels({"owner", "u"});
  try {
    leave_out_channel("rank", mesh);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kMeshBadChannel);
    EXPECT_THAT(error.what(), testing::HasSubstr("no channel 'rank' to leave out; it has 'owner', 'u'"));
  }
  EXPECT_EQ(mesh.channel_count(), 2u);
}

}  // namespace
}  // namespace ccslice
