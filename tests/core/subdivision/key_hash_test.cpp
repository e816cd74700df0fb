// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/subdivision/key_hash.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <set>
#include <utility>

namespace ccslice {
namespace {

TEST(KeyHash, TellsKeysApartThatAreNearlyAlike) {
  NumberKey key;
  for (std::uint32_t i = 0; i < 64; ++i) key.push_back(i);
  std::set<std::size_t> hashes = {NumberKeyHash()(key), NumberKeyHash()({})};
  for (std::size_t i = 0; i < key.size(); ++i) {
    NumberKey other = key;
    ++other[i];
    hashes.insert(NumberKeyHash()(other));
    other.resize(i);
    other.push_back(1000);
    hashes.insert(NumberKeyHash()(other));
  }
  for (std::size_t i = 1; i < key.size(); ++i) {
    NumberKey swapped = key;
    std::swap(swapped[i - 1], swapped[i]);
    hashes.insert(NumberKeyHash()(swapped));
  }
  EXPECT_EQ(hashes.size(), 2 + 2 * key.size() + key.size() - 1);
}

TEST(KeyHash, TablesFindEqualKeysAndNoOthers) {
  TableByKey<std::size_t> table;
  for (std::uint32_t i = 0; i < 1000; ++i) table.emplace(NumberKey{7, i / 10, i % 10}, i);
  EXPECT_EQ(table.size(), 1000u);
  EXPECT_EQ(table.at({7, 12, 3}), 123u);
  EXPECT_FALSE(table.contains({7, 3, 12}));
  EXPECT_FALSE(table.contains({7, 12}));
}

}  // namespace
}  // namespace ccslice
