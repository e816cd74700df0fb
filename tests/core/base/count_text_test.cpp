// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/base/count_text.h"

#include <gtest/gtest.h>

namespace ccslice {
namespace {

TEST(CountText, HasTheNounInTheRightNumber) {
  EXPECT_EQ(count_text(1, "control cell"), "1 control cell");
  EXPECT_EQ(count_text(0, "control cell"), "0 control cells");
  EXPECT_EQ(count_text(2, "limit vertex"), "2 limit vertices");
  EXPECT_EQ(count_text(3, "tetrahedron"), "3 tetrahedra");
  EXPECT_EQ(count_text(1, "hexahedron"), "1 hexahedron");
  EXPECT_EQ(plural_of("node"), "nodes");
}

}  // namespace
}  // namespace ccslice
