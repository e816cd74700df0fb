// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/base/colour_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace ccslice {
namespace {

using testing::ElementsAre;

double lightness(const Srgb& c) { return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]; }

TEST(ColourMap, HasTheColoursOfTheOriginals) {
  // The first, the middle and the last of Matplotlib's 256.
  EXPECT_THAT(map_colour(ColourMapName::kViridis, 0), ElementsAre(68, 1, 84));
  EXPECT_THAT(map_colour(ColourMapName::kViridis, 1), ElementsAre(253, 231, 37));
  EXPECT_THAT(map_colour(ColourMapName::kViridis, 125 / 255.0), ElementsAre(33, 142, 141));
  EXPECT_THAT(map_colour(ColourMapName::kCividis, 0), ElementsAre(0, 34, 78));
  EXPECT_THAT(map_colour(ColourMapName::kCividis, 1), ElementsAre(254, 232, 56));
  EXPECT_THAT(map_colour(ColourMapName::kGrey, 0.5), ElementsAre(128, 128, 128));
}

TEST(ColourMap, RisesInLightness) {
  for (const ColourMapTraits& traits : kColourMaps) {
    double last = -1;
    for (int i = 0; i <= 64; ++i) {
      const double here = lightness(map_colour(traits.map, i / 64.0));
      EXPECT_GT(here, last) << traits.name << " at " << i;
      last = here;
    }
  }
}

TEST(ColourMap, HoldsItsEndsAndTakesNoNumberForTheLowest) {
  for (const ColourMapTraits& traits : kColourMaps) {
    EXPECT_EQ(map_colour(traits.map, -3), map_colour(traits.map, 0)) << traits.name;
    EXPECT_EQ(map_colour(traits.map, 1e300), map_colour(traits.map, 1)) << traits.name;
    EXPECT_EQ(map_colour(traits.map, std::numeric_limits<double>::quiet_NaN()), map_colour(traits.map, 0));
  }
}

}  // namespace
}  // namespace ccslice
