// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/printing/values_off_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "core/prepare/prepare_solid.h"
#include "tests/support/cell_regions.h"
#include "tests/support/channel_functions.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

/// A block of 4 x 4 x 4 sharp cells whose channel is z, from 0 to 40.
ControlMesh block() {
  ControlMesh mesh = oracle::box_mesh(4, 4, 4);
  oracle::sharpen_by_cells(mesh, 1);
  mesh.channel_names = {"z"};
  mesh.channel_values.clear();
  for (const Vec3& p : mesh.positions) mesh.channel_values.push_back(static_cast<float>(p.z()));
  return mesh;
}

Printing printing_with(MaterialMap map) {
  Printing printing;
  printing.materials = {{"soft", 0xff0000ff}, {"hard", 0x00ff00ff}, {"clear", 0x0000ffff}};
  printing.map = std::move(map);
  return printing;
}

TEST(ValuesOffMap, AreThoseOfSourcesToo) {
  const auto solid = prepare_solid(block());
  const double high = solid->summary().channels[0].max;
  const ChannelSources sources = {
      std::make_shared<ChannelFunction>(ChannelRange{"raised", -1000, 1000}, std::vector<std::string>{"z"},
                                        [high](const Vec3& world, const Vec3&, std::span<const float> inputs) {
                                          return inputs[0] + (world.x() < 100 ? 0 : static_cast<float>(high));
                                        })};
  const Printing printing = printing_with({BlendMap{"raised", {{0, 1}, {high, 2}}}});
  EXPECT_THAT(find_values_off_maps(printing, *solid, sources), IsEmpty()) << "its range is wider than its values are";
  Placement moved = Placement::Identity();
  moved.translation().x() = 1000;
  const auto found = find_values_off_maps(printing, *solid, sources, moved);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].channel.name, "raised");
  EXPECT_NEAR(found[0].share, 1, 0.02);
}

TEST(ValuesOffMap, AreMeasuredInVolume) {
  const auto solid = prepare_solid(block());
  const double high = solid->summary().channels[0].max;
  const auto found = find_values_off_maps(printing_with({BlendMap{"z", {{0, 1}, {high / 4, 2}}}}), *solid);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].channel.name, "z");
  EXPECT_THAT(found[0].covered, ElementsAre(0, high / 4));
  EXPECT_NEAR(found[0].share, 0.75, 0.03);
  const auto all = find_values_off_maps(printing_with({ColourMap{"z", "z", "z", high / 1000}}), *solid);
  ASSERT_EQ(all.size(), 1u) << "a channel once";
  EXPECT_NEAR(all[0].share, 1, 0.01);
}

TEST(ValuesOffMap, AreNotFoundWhereTheMapCoversThem) {
  const auto solid = prepare_solid(block());
  const double high = solid->summary().channels[0].max;
  for (const MaterialMap& map :
       {MaterialMap{BlendMap{"z", {{0, 1}, {high, 2}}}}, MaterialMap{BlendMap{"z", {{7, 1}}}}, MaterialMap{PureMap{2}},
        MaterialMap{CalibrationMap{"z", 1, 2, {{-1, 0}, {0.995 * high, 1}}}},
        MaterialMap{ColourMap{"z", "z", "z", high}}}) {
    EXPECT_THAT(find_values_off_maps(printing_with(map), *solid), IsEmpty());
  }
}

TEST(ValuesOffMap, AreThoseOfTheMapsOwnRegion) {
  ControlMesh mesh = block();
  const double middle = 0.5 * (mesh.positions.front().z() + mesh.positions.back().z());
  mesh = oracle::with_regions(mesh, 2, [=](const Vec3& p) { return p.z() < middle ? 0 : 1; });
  const auto solid = prepare_solid(mesh);
  const double high = solid->summary().channels[0].max;
  Printing printing = printing_with({BlendMap{"z", {{0, 1}, {high / 2, 2}}}});  // Covers the lower region.
  printing.cell_region_maps.push_back({1, {DirectMap{{{"z", 1}}, 2}}});
  const auto found = find_values_off_maps(printing, *solid);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].map, &printing.cell_region_maps[0].map);
  EXPECT_NEAR(found[0].share, 1, 1e-9);
}

TEST(FractionsBelowOne, AreMeasuredInVolume) {
  ControlMesh mesh = block();
  double top = 0;
  for (const Vec3& p : mesh.positions) top = std::max(top, p.z());
  mesh.channel_names = {"density", "other"};
  mesh.channel_values.clear();
  for (const Vec3& p : mesh.positions) {
    const auto density = static_cast<float>(0.25 + 1.5 * p.z() / top);  // 1 in the middle.
    mesh.channel_values.insert(mesh.channel_values.end(), {density, 0.75f});
  }
  const auto solid = prepare_solid(mesh);
  const auto found = find_fractions_below_one(printing_with({DirectMap{{{"density", 1}}}}), *solid);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(found[0].share, 0.5, 0.03);
  EXPECT_NEAR(found[0].least_sum, 0.25, 0.1);
  const Printing two = printing_with({DirectMap{{{"density", 1}, {"other", 2}}}});
  EXPECT_THAT(find_fractions_below_one(two, *solid), IsEmpty()) << "at least 1 in all";
  EXPECT_THAT(find_fractions_below_one(printing_with({DirectMap{{{"density", 1}}, 2}}), *solid), IsEmpty()) << "rest";
  EXPECT_THAT(find_fractions_below_one(printing_with({BlendMap{"density", {{0, 1}, {1, 2}}}}), *solid), IsEmpty());
}

TEST(ValuesOffMap, OfLargeMeshesAreSampled) {
  ControlMesh mesh = oracle::box_mesh(20, 20, 20);
  oracle::sharpen_by_cells(mesh, 1);
  mesh.channel_names = {"z"};
  mesh.channel_values.clear();
  for (const Vec3& p : mesh.positions) mesh.channel_values.push_back(static_cast<float>(p.z()));
  const auto solid = prepare_solid(mesh);
  const double high = solid->summary().channels[0].max;
  const auto found = find_values_off_maps(printing_with({BlendMap{"z", {{0, 1}, {high / 2, 2}}}}), *solid);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(found[0].share, 0.5, 0.05);
}

}  // namespace
}  // namespace ccslice
