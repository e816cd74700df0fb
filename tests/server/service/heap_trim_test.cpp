// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/heap_trim.h"

#include <gtest/gtest.h>

namespace ccslice::server {
namespace {

TEST(HeapTrim, IsWorthItAfterMuchWasFreedAndOnceMore) {
  std::uint64_t freed_bytes = 0;
  HeapTrim trim([&] { return freed_bytes; });
  EXPECT_FALSE(trim.sweep());
  freed_bytes += 1 << 20;
  EXPECT_FALSE(trim.sweep());
  freed_bytes += 100 << 20;
  EXPECT_TRUE(trim.sweep());
  EXPECT_TRUE(trim.sweep()) << "what was counted just before it was freed";
  EXPECT_FALSE(trim.sweep());
  freed_bytes += 1 << 20;
  EXPECT_FALSE(trim.sweep());
}

}  // namespace
}  // namespace ccslice::server
