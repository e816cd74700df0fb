// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/node_numbers.h"

#include <gtest/gtest.h>

namespace ccslice {
namespace {

TEST(NodeNumbers, AreFoundInAnyOrderAndWithGaps) {
  NodeNumbers nodes;
  for (const std::uint64_t number : {40u, 7u, 1000u, 8u}) nodes.add(number, 0);
  EXPECT_FALSE(nodes.sort());
  EXPECT_EQ(nodes.index_of(40), 0u);
  EXPECT_EQ(nodes.index_of(7), 1u);
  EXPECT_EQ(nodes.index_of(1000), 2u);
  EXPECT_EQ(nodes.index_of(8), 3u);
  for (const std::uint64_t number : {0u, 9u, 1001u}) EXPECT_FALSE(nodes.index_of(number)) << number;
}

TEST(NodeNumbers, NameTheLaterOfTwins) {
  NodeNumbers nodes;
  nodes.add(5, 100);
  nodes.add(3, 101);
  nodes.add(5, 102);
  const auto twin = nodes.sort();
  ASSERT_TRUE(twin);
  EXPECT_EQ(twin->number, 5u);
  EXPECT_EQ(twin->mark, 102u);
}

}  // namespace
}  // namespace ccslice
