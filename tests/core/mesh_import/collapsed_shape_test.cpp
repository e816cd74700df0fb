// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/collapsed_shape.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace ccslice {
namespace {

using testing::ElementsAre;
using testing::UnorderedElementsAre;

using Corners = std::vector<std::uint32_t>;

TEST(CollapsedShape, IsAWedgeWhereTwoEdgesAreGone) {
  const Corners corners = {10, 11, 12, 12, 14, 15, 16, 16};
  EXPECT_TRUE(has_repeated_corner(corners));
  const std::optional<CollapsedCell> found = what_is_left(CellKind::kHex, corners);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->shape, CollapsedShape::kCell);
  EXPECT_EQ(found->kind, CellKind::kWedge);
  EXPECT_THAT(found->corners, UnorderedElementsAre(10, 11, 12, 14, 15, 16));
}

TEST(CollapsedShape, IsAPyramidWhereAFaceIsGone) {
  for (const auto& [kind, corners] : {std::pair(CellKind::kHex, Corners{0, 1, 2, 3, 4, 4, 4, 4}),
                                      std::pair(CellKind::kWedge, Corners{0, 3, 4, 1, 2, 4})}) {
    const std::optional<CollapsedCell> found = what_is_left(kind, corners);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->shape, CollapsedShape::kPyramid);
    ASSERT_EQ(found->corners.size(), 5u);
    EXPECT_EQ(found->corners[4], 4u);
    EXPECT_THAT(found->base, UnorderedElementsAre(0, 1, 2, 3));
    EXPECT_NE(found->base[0] % 2, found->base[1] % 2) << "in cyclic order";
  }
}

TEST(CollapsedShape, IsATetrahedronOverAQuadrilateralWhereOnlyTwoTrianglesAreLeft) {
  const std::optional<CollapsedCell> found = what_is_left(CellKind::kHex, Corners{0, 1, 2, 3, 3, 3, 3, 3});
  ASSERT_TRUE(found);
  EXPECT_EQ(found->shape, CollapsedShape::kTetOverQuadrilateral);
  EXPECT_EQ(found->kind, CellKind::kTet);
  EXPECT_THAT(found->corners, UnorderedElementsAre(0, 1, 2, 3));
  EXPECT_THAT(found->diagonal_of_tet, ElementsAre(0, 2));
}

TEST(CollapsedShape, IsNothingWhereCornersAcrossFacesAreOne) {
  EXPECT_FALSE(has_repeated_corner(Corners{0, 1, 2, 3}));
  for (const Corners& corners : {Corners{0, 1, 0, 3, 4, 5, 6, 7}, Corners{0, 1, 2, 3, 4, 5, 0, 7},
                                 Corners{0, 0, 0, 0, 0, 0, 0, 0}, Corners{0, 1, 2, 3, 0, 1, 2, 3}}) {
    EXPECT_FALSE(what_is_left(CellKind::kHex, corners));
  }
}

}  // namespace
}  // namespace ccslice
