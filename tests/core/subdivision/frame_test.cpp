// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/subdivision/frame.h"

#include <gtest/gtest.h>

#include <set>

namespace ccslice {
namespace {

TEST(Frame, EveryCornerAndAxisHasOneProperFrame) {
  std::set<std::array<int, 4>> seen;
  for (std::uint8_t corner = 0; corner < 8; ++corner) {
    for (std::uint8_t along = 0; along < 3; ++along) {
      const Frame frame = frame_at(corner, along);
      EXPECT_TRUE(frame.proper());
      EXPECT_EQ(frame.corner(0), corner);
      EXPECT_EQ(frame.corner(4), corner ^ 1 << along);
      seen.insert({frame.axis[0], frame.axis[1], frame.axis[2], frame.origin});
    }
  }
  EXPECT_EQ(seen.size(), 24u);
}

TEST(Frame, MapsParametersAsItMapsCorners) {
  for (std::uint8_t corner = 0; corner < 8; ++corner) {
    for (std::uint8_t along = 0; along < 3; ++along) {
      const Frame frame = frame_at(corner, along);
      for (unsigned j = 0; j < 8; ++j) {
        const unsigned c = frame.corner(j);
        const Vec3 framed = frame.to_framed(Vec3(c & 1, c >> 1 & 1, c >> 2));
        EXPECT_EQ(framed, Vec3(j & 1, j >> 1 & 1, j >> 2));
      }
    }
  }
}

}  // namespace
}  // namespace ccslice
