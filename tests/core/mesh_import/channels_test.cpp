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

}  // namespace
}  // namespace ccslice
