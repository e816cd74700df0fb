// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/surface_rings.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

TEST(SurfaceRings, OfTheBoundaryAreSeenFromOutside) {
  const ControlMesh mesh = oracle::tiny_mesh("hex_wedge_tet");
  Vec3 flux = Vec3::Zero();
  double six_volumes = 0;
  std::size_t triangles = 0;
  const SurfaceRings rings = surface_rings(mesh, make_cell_complex(mesh));
  EXPECT_TRUE(rings.interfaces.empty());
  for (const FaceVertices& ring : rings.boundary) {
    triangles += ring[3] == kNone;
    const auto at = [&](std::size_t i) { return mesh.positions[ring[i]]; };
    for (std::size_t i = 1; i < (ring[3] == kNone ? 2u : 3u); ++i) {
      flux += (at(i) - at(0)).cross(at(i + 1) - at(0));
      six_volumes += at(0).dot(at(i).cross(at(i + 1)));
    }
  }
  EXPECT_GT(triangles, 0u);
  EXPECT_LT(flux.norm(), 1e-9) << "closed";
  EXPECT_GT(six_volumes, 0);
}

/// Whichever half-face comes first: seen from the lower region a closed interface faces outwards.
TEST(SurfaceRings, OfInterfacesAreSeenFromTheLowerRegion) {
  for (const std::uint8_t inside : {0, 1}) {
    ControlMesh mesh = oracle::box_mesh(3, 3, 3);
    mesh.cell_region_names = {"a", "b"};
    mesh.cell_regions.assign(27, static_cast<std::uint8_t>(1 - inside));
    mesh.cell_regions[13] = inside;
    const SurfaceRings rings = surface_rings(mesh, make_cell_complex(mesh));
    ASSERT_EQ(rings.boundary.size(), 54u);
    ASSERT_EQ(rings.interfaces.size(), 6u);
    for (const FaceVertices& ring : rings.interfaces) {
      const auto at = [&](std::size_t i) { return mesh.positions[ring[i]]; };
      const Vec3 normal = (at(1) - at(0)).cross(at(2) - at(0)), out = (at(0) + at(2)) / 2 - Vec3(15, 15, 15);
      EXPECT_GT(normal.dot(out) * (inside == 0 ? 1 : -1), 0);
    }
    const auto turns = surface_turns(
        rings, [&](std::uint32_t vertex) { return mesh.positions[vertex]; }, 45);
    EXPECT_EQ(turns.size(), 36u + 12) << "of the box, and of the cube in it";
    for (const SurfaceTurn& turn : turns) EXPECT_NEAR(turn.deg, turn.on_interface && inside == 1 ? -90 : 90, 1e-9);
  }
}

/// Two interfaces and two faces of the boundary meet there.
TEST(SurfaceTurns, PassOverEdgesWhereInterfacesEnd) {
  ControlMesh mesh = oracle::box_mesh(2, 1, 1);
  const auto count = [&] {
    return surface_turns(
               surface_rings(mesh, make_cell_complex(mesh)),
               [&](std::uint32_t vertex) { return mesh.positions[vertex]; }, 0)
        .size();
  };
  EXPECT_EQ(count(), 20u);
  mesh.cell_region_names = {"a", "b"};
  mesh.cell_regions = {0, 1};
  EXPECT_EQ(count(), 16u);
}

/// A strip of squares that is folded by 30, -60 and 90 degrees. Its other sides have one face each.
TEST(SurfaceTurns, TellTheAngleAndTheWay) {
  std::vector<Vec3> points;
  Vec3 at = Vec3::Zero();
  double heading_deg = 0;
  for (const double turn_deg : {0.0, 30.0, -60.0, 90.0, 0.0}) {
    points.push_back(at);
    points.push_back(at + Vec3(0, 0, 1));
    // Going round counter-clockwise with the outside on the right.
    heading_deg += turn_deg;
    const double heading = heading_deg * EIGEN_PI / 180;
    at += Vec3(std::cos(heading), std::sin(heading), 0);
  }
  SurfaceRings rings;
  for (std::uint32_t i = 0; i < 4; ++i) rings.boundary.push_back({2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1});
  const auto turns = surface_turns(
      rings, [&](std::uint32_t vertex) { return points[vertex]; }, 0);
  ASSERT_EQ(turns.size(), 3u);
  EXPECT_EQ(turns[0].edge, (std::array<std::uint32_t, 2>{2, 3}));
  EXPECT_NEAR(turns[0].deg, 30, 1e-9);
  EXPECT_NEAR(turns[1].deg, -60, 1e-9);
  EXPECT_NEAR(turns[2].deg, 90, 1e-9);
  EXPECT_EQ(surface_turns(
                rings, [&](std::uint32_t vertex) { return points[vertex]; }, 60)
                .size(),
            2u);
  EXPECT_EQ(surface_turns(
                rings, [&](std::uint32_t vertex) { return points[vertex]; }, 60.1)
                .size(),
            1u);
}

}  // namespace
}  // namespace ccslice
