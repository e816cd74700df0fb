// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The boxes of the literal Algorithm 1's cell lists, read off the core's rings, against brute force.

#include <gtest/gtest.h>

#include "tests/oracle/slicing.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::oracle {
namespace {

class CellBoxesOf : public testing::TestWithParam<std::size_t> {};

TEST_P(CellBoxesOf, LimitCellsAreThoseOfTheirControlPoints) {
  const Subject subject(tiny_meshes()[GetParam()].mesh);
  const CellBoxes expected = brute_force_boxes(subject), boxes = cell_boxes(subject.solid());
  ASSERT_EQ(boxes.rings.size(), expected.rings.size());
  const double rounding_mm = 1e-12 * subject.diagonal_mm();
  for (std::size_t cell = 0; cell < boxes.rings.size(); ++cell) {
    EXPECT_TRUE(boxes.rings[cell].isApprox(expected.rings[cell], rounding_mm)) << "cell " << cell;
    EXPECT_TRUE(boxes.corners[cell].isApprox(expected.corners[cell], rounding_mm)) << "cell " << cell;
  }
}

INSTANTIATE_TEST_SUITE_P(TinyMeshes, CellBoxesOf, testing::Range<std::size_t>(0, tiny_meshes().size()),
                         [](const auto& info) { return tiny_meshes()[info.param].name; });

}  // namespace
}  // namespace ccslice::oracle
