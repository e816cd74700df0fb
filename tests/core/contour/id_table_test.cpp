// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/id_table.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

namespace ccslice {
namespace {

TEST(IdTable, NumbersKeysInTheOrderOfTheirFirstInsertion) {
  IdTable<SurfaceKey> table;
  std::map<SurfaceKey, std::uint32_t> expected;
  std::mt19937 random(5);
  for (int round = 0; round < 2; ++round) {
    table.clear();
    expected.clear();
    EXPECT_EQ(table.find({}), IdTable<SurfaceKey>::kNone);
    for (int k = 0; k < 20'000; ++k) {
      const SurfaceKey key{static_cast<SurfaceKey::Kind>(random() % 3), static_cast<std::uint32_t>(random() % 50),
                           static_cast<std::uint32_t>(random() % 16) << 27, static_cast<std::uint32_t>(random() % 16)};
      const auto [entry, is_new] = expected.emplace(key, static_cast<std::uint32_t>(expected.size()));
      EXPECT_EQ(table.find(key), is_new ? IdTable<SurfaceKey>::kNone : entry->second);
      EXPECT_EQ(table.insert(key), std::pair(entry->second, is_new));
    }
    EXPECT_EQ(table.size(), expected.size());
    for (const auto& [key, id] : expected) EXPECT_EQ(table.key(id), key);
  }
}

}  // namespace
}  // namespace ccslice
