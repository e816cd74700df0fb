// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/base/similar_name.h"

#include <gtest/gtest.h>

namespace ccslice {
namespace {

TEST(EditDistance, CountsLettersThatDiffer) {
  EXPECT_EQ(edit_distance("", ""), 0u);
  EXPECT_EQ(edit_distance("", "abc"), 3u);
  EXPECT_EQ(edit_distance("slice", "slice"), 0u);
  EXPECT_EQ(edit_distance("slce", "slice"), 1u);
  EXPECT_EQ(edit_distance("silce", "slice"), 1u) << "two letters swapped";
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3u);
  EXPECT_EQ(edit_distance("sitting", "kitten"), 3u);
}

}  // namespace
}  // namespace ccslice
