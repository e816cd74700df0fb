// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/base/ids.h"

#include <gtest/gtest.h>

#include <concepts>

namespace ccslice {
namespace {

template <typename A, typename B>
concept Comparable = requires(A a, B b) {
  a == b;
};

TEST(Ids, AreNotMadeOfNumbersOrOtherIdsUnasked) {
  EXPECT_FALSE((std::convertible_to<std::uint32_t, CellId>));
  EXPECT_FALSE((std::convertible_to<VertexId, CellId>));
  EXPECT_FALSE((std::assignable_from<CellId&, std::uint32_t>));
  EXPECT_FALSE((std::assignable_from<CellId&, VertexId>));
  EXPECT_TRUE((std::convertible_to<CellId, std::uint32_t>));
  EXPECT_FALSE((std::convertible_to<ControlCellId, LimitCellId>));
  EXPECT_FALSE((std::convertible_to<FaceId, BoundaryFaceId>));
}

TEST(Ids, CompareWithTheirOwnKindOnly) {
  EXPECT_TRUE((Comparable<CellId, CellId>));
  EXPECT_FALSE((Comparable<CellId, VertexId>));
  EXPECT_FALSE((Comparable<FaceId, HalfFaceId>));
  EXPECT_FALSE((Comparable<LimitCellId, ControlCellId>));
  EXPECT_LT(CellId{1}, CellId{2});
}

TEST(Ids, AreNoLargerThanTheirNumbers) {
  EXPECT_EQ(sizeof(CellId), sizeof(std::uint32_t));
  EXPECT_TRUE(std::is_trivially_copyable_v<CellId>);
}

TEST(IdRange, CountsFromZero) {
  EXPECT_EQ(IdRange<EdgeId>{3}.to_vector(), (std::vector<EdgeId>{EdgeId{0}, EdgeId{1}, EdgeId{2}}));
  EXPECT_TRUE(IdRange<EdgeId>{0}.to_vector().empty());
}

TEST(IdRange, CountsFromItsFirstId) {
  const IdRange<LimitCellId> cells(LimitCellId{5}, LimitCellId{7});
  EXPECT_EQ(cells.size(), 2u);
  EXPECT_EQ(cells.to_vector(), (std::vector<LimitCellId>{LimitCellId{5}, LimitCellId{6}}));
}

TEST(Ids, AreSkippedInSteps) {
  LimitCellId cell{2};
  cell += 3;
  EXPECT_EQ(cell, LimitCellId{5});
}

}  // namespace
}  // namespace ccslice
