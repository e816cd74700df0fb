// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/cell_kind.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <set>
#include <utility>
#include <vector>

#include "core/base/types.h"

namespace ccslice {
namespace {

using Edge = std::pair<std::uint8_t, std::uint8_t>;

/// Corners of a positively oriented cell. Hexahedra: by bits.
std::vector<Vec3> corners_of(CellKind kind) {
  switch (kind) {
    case CellKind::kTet: return {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    case CellKind::kWedge: return {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}};
    case CellKind::kHex: break;
  }
  std::vector<Vec3> corners;
  for (int bits = 0; bits < 8; ++bits) corners.emplace_back(bits & 1, bits >> 1 & 1, bits >> 2 & 1);
  return corners;
}

class CellTopologyTest : public testing::TestWithParam<CellKind> {
 protected:
  const CellTopology topology_ = cell_topology(GetParam());
  const std::vector<Vec3> corners_ = corners_of(GetParam());
};

TEST_P(CellTopologyTest, FacesRunCounterClockwiseSeenFromOutside) {
  Vec3 middle = Vec3::Zero();
  for (const Vec3& corner : corners_) middle += corner / static_cast<double>(corners_.size());
  for (const LocalFace& face : topology_.faces) {
    for (std::size_t k = 0; k < face.size; ++k) {
      const Vec3& before = corners_[face.corners[(k + face.size - 1u) % face.size]];
      const Vec3& at = corners_[face.corners[k]];
      const Vec3& after = corners_[face.corners[(k + 1u) % face.size]];
      const Vec3 normal = (after - at).cross(before - at);
      EXPECT_GT(normal.dot(at - middle), 0);
      for (std::size_t n = 0; n < face.size; ++n) EXPECT_EQ(normal.dot(corners_[face.corners[n]] - at), 0);
    }
  }
}

TEST_P(CellTopologyTest, EachEdgeIsOnTwoFacesInOppositeDirections) {
  std::set<Edge> directed, undirected;
  for (const LocalFace& face : topology_.faces) {
    for (std::size_t k = 0; k < face.size; ++k) {
      const std::uint8_t from = face.corners[k], to = face.corners[(k + 1u) % face.size];
      EXPECT_TRUE(directed.insert({from, to}).second);
      undirected.insert(std::minmax(from, to));
    }
  }
  for (const auto& [from, to] : directed) EXPECT_TRUE(directed.contains({to, from}));
  std::set<Edge> edges;
  for (const auto& [a, b] : topology_.edges) edges.insert(std::minmax(a, b));
  EXPECT_EQ(edges.size(), topology_.edges.size());
  EXPECT_EQ(edges, undirected);
}

TEST_P(CellTopologyTest, NeighboursOfCornersAreThoseAlongItsEdges) {
  ASSERT_EQ(topology_.corner_neighbours.size(), corners_.size());
  for (std::uint8_t corner = 0; corner < corners_.size(); ++corner) {
    const auto& neighbours = topology_.corner_neighbours[corner];
    Mat3 edges;
    for (int k = 0; k < 3; ++k) {
      const std::uint8_t other = neighbours[static_cast<std::size_t>(k)];
      edges.col(k) = corners_[other] - corners_[corner];
      const bool is_edge = std::ranges::any_of(topology_.edges, [&](const auto& edge) {
        return (edge[0] == corner && edge[1] == other) || (edge[1] == corner && edge[0] == other);
      });
      EXPECT_TRUE(is_edge);
      if (GetParam() == CellKind::kHex) {
        EXPECT_EQ(other, corner ^ (1 << k));
      }
    }
    if (GetParam() == CellKind::kHex) continue;
    EXPECT_GT(edges.determinant(), 0);
    EXPECT_EQ(neighbours[0], *std::ranges::min_element(neighbours));
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, CellTopologyTest, testing::Values(CellKind::kHex, CellKind::kTet, CellKind::kWedge));

TEST(CellKind, FacesAndEdgesOfHexahedraAreNumberedByTheirAxis) {
  const CellTopology hex = cell_topology(CellKind::kHex);
  for (std::size_t f = 0; f < 6; ++f) {
    for (const std::uint8_t corner : hex.faces[f].corners) EXPECT_EQ(corner >> f / 2 & 1, static_cast<int>(f % 2));
  }
  for (std::size_t e = 0; e < 12; ++e) EXPECT_EQ(hex.edges[e][0] ^ hex.edges[e][1], 1 << e / 4);
}

// VTK's hexahedron: round the bottom, then round the top.
TEST(CellKind, VtkCornersAreTurnedIntoBitsAndBack) {
  const std::array<std::array<int, 3>, 8> vtk = {
      {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}}};
  for (std::uint8_t k = 0; k < 8; ++k) {
    EXPECT_EQ(vtk_to_bits(k), vtk[k][0] + 2 * vtk[k][1] + 4 * vtk[k][2]);
    EXPECT_EQ(vtk_to_bits(vtk_to_bits(k)), k);
  }
}

}  // namespace
}  // namespace ccslice
