// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/region_values.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

#include "core/mesh/cell_regions.h"
#include "core/mesh/validate.h"
#include "core/mesh_import/channels.h"
#include "tests/core/mesh/expect_error.h"
#include "tests/support/cell_regions.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

/// Two cubes of a region each. One channel, the region's number.
ControlMesh two_numbered_cubes() {
  return oracle::with_jumping_channels(
      oracle::with_regions(oracle::box_mesh(2, 1, 1), 2, [](const Vec3& p) { return p.x() < 10 ? 0 : 1; }), {"number"},
      [](std::uint32_t, std::uint8_t region) { return std::vector<float>{static_cast<float>(region)}; });
}

template <class Change>
void expect_refused(Change change, ErrorCode code, const char* text) {
  ControlMesh mesh = two_numbered_cubes();
  change(mesh);
  expect_error([&] { validate(mesh); }, code, text);
}

TEST(RegionValues, HoldInTheirRegionAlone) {
  const ControlMesh mesh = two_numbered_cubes();
  ASSERT_EQ(region_value_count(mesh), 4u);
  const std::uint32_t vertex = mesh.region_value_vertices[2];
  EXPECT_THAT(values_in_region(mesh, vertex, 0), ElementsAre(0));
  EXPECT_THAT(values_in_region(mesh, vertex, 1), ElementsAre(1));
  EXPECT_EQ(region_value_row(mesh, vertex, 1), 2u);
  EXPECT_FALSE(region_value_row(mesh, vertex, 0));
  EXPECT_THAT(channel_range(mesh, 0), ElementsAre(0, 1));
}

TEST(RegionValues, GoToTheCopiesOfVertices) {
  ControlMesh mesh = two_numbered_cubes();
  const ConnectedMesh checked = validate_and_connect(mesh, {}, {});
  const SplitMesh split = split_cell_regions(mesh, checked.complex);
  EXPECT_EQ(region_value_count(split.mesh), 0u);
  ASSERT_EQ(split.mesh.channel_values.size(), 16u);
  for (std::size_t i = 0; i < 16; ++i) {
    EXPECT_EQ(split.mesh.channel_values[split.mesh.cell_vertices[i]], i < 8 ? 0 : 1) << i;
  }
}

TEST(RegionValues, MayBeTheFirstRegionsToo) {
  ControlMesh mesh = two_numbered_cubes();
  for (std::uint8_t& region : mesh.cell_regions) region = 1 - region;
  const ConnectedMesh checked = validate_and_connect(mesh, {}, {});
  const SplitMesh split = split_cell_regions(mesh, checked.complex);
  std::multiset<float> first, second;
  for (std::size_t i = 0; i < 8; ++i) {
    first.insert(split.mesh.channel_values[split.mesh.cell_vertices[i]]);
    second.insert(split.mesh.channel_values[split.mesh.cell_vertices[8 + i]]);
  }
  EXPECT_EQ(first, std::multiset<float>({0, 0, 0, 0, 1, 1, 1, 1}));
  EXPECT_EQ(second, std::multiset<float>({0, 0, 0, 0, 1, 1, 1, 1}));
}

TEST(RegionValues, AreTakenFromCopies) {
  ControlMesh mesh = two_numbered_cubes();
  const ConnectedMesh checked = validate_and_connect(mesh, {}, {});
  const SplitMesh split = split_cell_regions(mesh, checked.complex);
  ControlMesh copies = split.mesh;
  for (float& value : copies.channel_values) value = 5 + 2 * value;
  for (Vec3& position : copies.positions) position *= 3;
  ControlMesh taken = mesh;
  take_from_copies(split, copies, taken);
  EXPECT_EQ(taken.positions[7], 3 * mesh.positions[7]);
  EXPECT_THAT(taken.region_values, ElementsAre(7, 7, 7, 7));
  EXPECT_THAT(values_in_region(taken, taken.region_value_vertices[0], 0), ElementsAre(5));
}

TEST(RegionValues, TakeOnFurtherChannels) {
  ControlMesh mesh = two_numbered_cubes();
  NamedChannel other{"other", {}};
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v) other.values.push_back(static_cast<float>(v));
  append_channels({&other, 1}, mesh);
  const std::uint32_t vertex = mesh.region_value_vertices[1];
  EXPECT_THAT(values_in_region(mesh, vertex, 1), ElementsAre(1, static_cast<float>(vertex)));
  EXPECT_THAT(values_in_region(mesh, vertex, 0), ElementsAre(0, static_cast<float>(vertex)));
  validate(mesh);
  clear_region_values(mesh);
  EXPECT_THAT(mesh.region_values, IsEmpty());
  validate(mesh);
}

TEST(RegionValues, RefuseWhatDoesNotFit) {
  expect_refused([](ControlMesh& m) { m.region_value_regions.pop_back(); }, ErrorCode::kMeshArrayMismatch,
                 "region_value_regions holds 3 numbers, but the 4 vertices of region_value_vertices need 4");
  expect_refused([](ControlMesh& m) { m.region_values.push_back(1); }, ErrorCode::kMeshArrayMismatch,
                 "region_values holds 5 numbers");
  expect_refused([](ControlMesh& m) { m.region_value_vertices.clear(); }, ErrorCode::kMeshArrayMismatch, "need 0");
  expect_refused([](ControlMesh& m) { m.region_value_vertices[3] = 12; }, ErrorCode::kMeshIndexOutOfRange,
                 "vertex 12: the mesh has 12 vertices");
  expect_refused([](ControlMesh& m) { m.region_value_regions[0] = 2; }, ErrorCode::kMeshBadCellRegion,
                 "no such cell region: region 2: cell_region_names holds 2 names");
  expect_refused([](ControlMesh& m) { std::swap(m.region_value_vertices[0], m.region_value_vertices[1]); },
                 ErrorCode::kMeshBadCellRegion, "comes again or too late");
  expect_refused([](ControlMesh& m) { m.region_value_vertices[1] = m.region_value_vertices[0]; },
                 ErrorCode::kMeshBadCellRegion, "region_value_vertices[1]: vertex 1 comes again");
  expect_refused([](ControlMesh& m) { m.region_value_vertices[0] = 0; }, ErrorCode::kMeshBadCellRegion,
                 "values of a region that hasn't an interface at vertex 0");
  expect_refused([](ControlMesh& m) { m.region_values[2] = std::nanf(""); }, ErrorCode::kMeshNonFinite,
                 "NaN or infinite value of a region at vertex");
  expect_refused(
      [](ControlMesh& m) {
        m.cell_region_names.clear();
        m.cell_regions.clear();
      },
      ErrorCode::kMeshBadCellRegion, "no such cell region");
}

}  // namespace
}  // namespace ccslice
