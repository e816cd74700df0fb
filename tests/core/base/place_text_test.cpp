// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/base/place_text.h"

#include <gtest/gtest.h>

namespace ccslice {
namespace {

TEST(PlaceText, HasSoManyDigitsOfEachCoordinateAndTheUnit) {
  EXPECT_EQ(place_text(Vec3(1.5, 0, 20), 4), "(1.5, 0, 20) mm");
  EXPECT_EQ(place_text(Vec3(-1.23456, 2.0 / 3, 1e-7), 3), "(-1.23, 0.667, 1e-07) mm");
}

}  // namespace
}  // namespace ccslice
