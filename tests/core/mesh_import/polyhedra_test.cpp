// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/polyhedra.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>
#include <set>

#include "core/mesh/cell_kind.h"

namespace ccslice {
namespace {

constexpr std::uint32_t kSeed = 20261123;

/// The faces of a cell with these corners (VTK order), from outside.
std::vector<FaceRing> faces_of(CellKind kind, const std::vector<std::uint32_t>& corners) {
  std::vector<FaceRing> rings;
  for (const LocalFace& face : cell_topology(kind).faces) {
    FaceRing& ring = rings.emplace_back();
    for (std::size_t k = 0; k < face.size; ++k) {
      const std::uint8_t corner = face.corners[k];
      ring.push_back(corners[kind == CellKind::kHex ? vtk_to_bits(corner) : corner]);
    }
  }
  return rings;
}

/// Faces as sets of directed edges: whatever they start from, in whatever order.
std::multiset<std::set<std::pair<std::uint32_t, std::uint32_t>>> directed(const std::vector<FaceRing>& rings) {
  std::multiset<std::set<std::pair<std::uint32_t, std::uint32_t>>> result;
  for (const FaceRing& ring : rings) {
    std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (std::size_t k = 0; k < ring.size(); ++k) edges.insert({ring[k], ring[(k + 1) % ring.size()]});
    result.insert(edges);
  }
  return result;
}

// Corners of any numbers, faces in any order, each starting anywhere.
TEST(Polyhedra, CornersGiveTheFacesBack) {
  std::mt19937 random(kSeed);
  for (const CellKind kind : {CellKind::kHex, CellKind::kTet, CellKind::kWedge}) {
    for (int trial = 0; trial < 200; ++trial) {
      std::vector<std::uint32_t> corners(corner_count(kind));
      std::iota(corners.begin(), corners.end(), static_cast<std::uint32_t>(random() % 100));
      std::shuffle(corners.begin(), corners.end(), random);
      std::vector<FaceRing> rings = faces_of(kind, corners);
      std::shuffle(rings.begin(), rings.end(), random);
      for (FaceRing& ring : rings) std::rotate(ring.begin(), ring.begin() + random() % ring.size(), ring.end());
      const auto found = corners_of_polyhedron(rings);
      ASSERT_TRUE(found) << "seed " << kSeed << ", trial " << trial;
      EXPECT_EQ(found->kind, kind);
      ASSERT_EQ(found->corners.size(), corners.size());
      EXPECT_EQ(directed(faces_of(kind, found->corners)), directed(rings)) << "seed " << kSeed << ", trial " << trial;
    }
  }
}

TEST(Polyhedra, SeenFromInsideGiveCornersTurnedRound) {
  for (const CellKind kind : {CellKind::kHex, CellKind::kTet, CellKind::kWedge}) {
    std::vector<std::uint32_t> corners(corner_count(kind));
    std::iota(corners.begin(), corners.end(), 0u);
    std::vector<FaceRing> rings = faces_of(kind, corners);
    for (FaceRing& ring : rings) std::reverse(ring.begin(), ring.end());
    const auto found = corners_of_polyhedron(rings);
    ASSERT_TRUE(found);
    EXPECT_EQ(directed(faces_of(kind, found->corners)), directed(rings));
  }
}

const std::vector<FaceRing> kPyramid = {{0, 3, 2, 1}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};

// Every face seen from whichever side.
TEST(Polyhedra, AreFoundFromFacesSeenFromEitherSide) {
  for (const CellKind kind : {CellKind::kHex, CellKind::kTet, CellKind::kWedge}) {
    std::vector<std::uint32_t> corners(corner_count(kind));
    std::iota(corners.begin(), corners.end(), 0u);
    const std::vector<FaceRing> rings = faces_of(kind, corners);
    for (std::size_t turned = 0; turned < (std::size_t{1} << rings.size()); ++turned) {
      std::vector<FaceRing> seen = rings;
      for (std::size_t i = 0; i < seen.size(); ++i) {
        if (turned >> i & 1) std::reverse(seen[i].begin(), seen[i].end());
      }
      const auto found = corners_of_polyhedron(seen);
      ASSERT_TRUE(found) << turned;
      EXPECT_EQ(found->kind, kind);
    }
  }
}

TEST(Polyhedra, PyramidsAreHexahedraWithFourCornersInOne) {
  std::vector<FaceRing> rings = kPyramid;
  for (std::size_t first = 0; first < rings.size(); ++first) {
    std::rotate(rings.begin(), rings.begin() + 1, rings.end());
    const auto found = corners_of_polyhedron(rings);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->kind, CellKind::kHex);
    EXPECT_THAT(found->corners, testing::ElementsAre(1, 2, 3, 0, 4, 4, 4, 4));
  }
  std::vector<FaceRing> open = kPyramid, pinched = kPyramid;
  open[1] = open[2];
  for (FaceRing& ring : pinched) std::ranges::replace(ring, 3u, 1u);
  EXPECT_FALSE(corners_of_polyhedron(open));
  EXPECT_FALSE(corners_of_polyhedron(pinched));
}

TEST(Polyhedra, OthersHaveNoCorners) {
  std::vector<std::uint32_t> corners(8);
  std::iota(corners.begin(), corners.end(), 0u);
  const std::vector<FaceRing> hex = faces_of(CellKind::kHex, corners);
  std::vector<FaceRing> open(hex.begin(), hex.end() - 1), repeated = hex, pinched = hex;
  repeated[5] = repeated[4];
  std::ranges::replace(pinched[5], pinched[5][0], pinched[4][0]);
  for (const std::vector<FaceRing>& rings : {open, repeated, pinched, std::vector<FaceRing>{}}) {
    EXPECT_FALSE(corners_of_polyhedron(rings));
    EXPECT_FALSE(describe_polyhedron(rings).empty());
  }
}

}  // namespace
}  // namespace ccslice
