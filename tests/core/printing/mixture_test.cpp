// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/printing/mixture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "core/printing/colour_gamut.h"

namespace ccslice {
namespace {

using testing::ElementsAre;
using testing::FloatNear;

Printing printing_with(std::size_t materials, MaterialMap map) {
  Printing printing;
  for (std::uint32_t m = 0; m < materials; ++m) {
    printing.materials.push_back({std::string(1, static_cast<char>('a' + m)), 0x11000000u * m + 0xff01ff});
  }
  printing.map = std::move(map);
  return printing;
}

/// Fractions of a voxel with these values of the map's channels.
std::vector<float> mix(const Mixture& mixture, const std::vector<float>& values) {
  std::vector<MixRow> rows(values.size());
  for (std::size_t c = 0; c < values.size(); ++c) rows[c].fill(values[c]);
  Fractions fractions{};
  mixture.evaluate(rows, fractions);
  std::vector<float> result;
  for (std::size_t m = 0; m < mixture.material_count(); ++m) result.push_back(fractions[m][17]);
  return result;
}

Mixture mixture_of(const Printing& printing) { return {printing, printing.map, colour_table_of(printing)}; }

bool fits(const Mixture& mixture, const std::vector<float>& values) {
  std::vector<MixRow> rows(values.size());
  for (std::size_t c = 0; c < values.size(); ++c) rows[c].fill(values[c]);
  return !mixture.first_misfit(rows, 3, 20);
}

auto near(float value) { return FloatNear(value, 1e-5f); }

TEST(Mixture, OfABlendIsLinearBetweenStopsAndHeldAtItsEnds) {
  const Mixture mixture = mixture_of(printing_with(3, {BlendMap{"0", {{10, 1}, {20, 3}, {40, 2}}}}));
  EXPECT_THAT(mix(mixture, {10}), ElementsAre(1, 0, 0));
  EXPECT_THAT(mix(mixture, {12.5f}), ElementsAre(near(0.75f), 0, near(0.25f)));
  EXPECT_THAT(mix(mixture, {20}), ElementsAre(0, 0, 1));
  EXPECT_THAT(mix(mixture, {35}), ElementsAre(0, near(0.75f), near(0.25f)));
  EXPECT_THAT(mix(mixture, {-1e9f}), ElementsAre(1, 0, 0));
  EXPECT_THAT(mix(mixture, {1e9f}), ElementsAre(0, 1, 0));
}

TEST(Mixture, OfACurveFollowsTheTableHoweverLongItIs) {
  for (const std::size_t points : {2, 5, 9, 10, 200}) {
    CalibrationMap curve{"0", 2, 1, {}};
    for (std::size_t i = 0; i < points; ++i) {
      const double x = static_cast<double>(i) / static_cast<double>(points - 1);
      curve.points.push_back({1000 * x, x * x});
    }
    const Mixture mixture = mixture_of(printing_with(2, {curve}));
    for (double property = 0; property <= 1000; property += 7.3) {
      const double at = property / 1000 * static_cast<double>(points - 1), low = std::floor(at);
      const double step = static_cast<double>(points - 1);
      const double expected = (low * low + (at - low) * (2 * low + 1)) / (step * step);
      const std::vector<float> fractions = mix(mixture, {static_cast<float>(property)});
      ASSERT_NEAR(fractions[1], expected, 1e-5) << points << " points, " << property;
      ASSERT_NEAR(fractions[0], 1 - expected, 1e-5);
    }
  }
}

TEST(Mixture, OfSharesIsScaledToMakeOne) {
  DirectMap direct;
  direct.shares = {{"4", 2}, {"7", 1}};
  const Mixture mixture = mixture_of(printing_with(3, {direct}));
  EXPECT_THAT(mixture.channels(), ElementsAre("4", "7"));
  EXPECT_THAT(mix(mixture, {0.25f, 0.75f}), ElementsAre(0.75f, 0.25f, 0));
  EXPECT_THAT(mix(mixture, {0.2f, 0.2f}), ElementsAre(0.5f, 0.5f, 0));
  EXPECT_THAT(mix(mixture, {3, 1}), ElementsAre(0.25f, 0.75f, 0));
  EXPECT_THAT(mix(mixture, {-5, 0.1f}), ElementsAre(1, 0, 0));
  EXPECT_THAT(mix(mixture, {0, 0}), ElementsAre(0, 1, 0));
  EXPECT_THAT(mix(mixture, {std::numeric_limits<float>::quiet_NaN(), 0.5f}), ElementsAre(1, 0, 0));
  EXPECT_THAT(mix(mixture, {std::numeric_limits<float>::infinity(), 1}), ElementsAre(near(0), near(1), 0));
}

TEST(Mixture, LeavesTheRestToAMaterialOfItsOwn) {
  DirectMap direct;
  direct.shares = {{"0", 1}, {"1", 2}};
  direct.rest_material = 3;
  const Mixture mixture = mixture_of(printing_with(3, {direct}));
  EXPECT_THAT(mix(mixture, {0.2f, 0.3f}), ElementsAre(near(0.2f), near(0.3f), near(0.5f)));
  EXPECT_THAT(mix(mixture, {1, 1}), ElementsAre(0.5f, 0.5f, 0));
  EXPECT_THAT(mix(mixture, {0, 0}), ElementsAre(0, 0, 1));
}

TEST(Mixture, OfOneMaterialNeedsNoMap) {
  const Mixture mixture = mixture_of(printing_with(1, {}));
  EXPECT_TRUE(mixture.channels().empty());
  EXPECT_THAT(mix(mixture, {}), ElementsAre(1));
}

TEST(Mixture, OfAMaterialIsAllOfIt) {
  const Mixture mixture = mixture_of(printing_with(3, {PureMap{2}}));
  EXPECT_TRUE(mixture.channels().empty());
  EXPECT_THAT(mix(mixture, {}), testing::ElementsAre(0, 1, 0));
}

TEST(Mixture, IsOfTheFirstOverrideThatHolds) {
  MaterialMap map{BlendMap{"share", {{0, 1}, {1, 2}}}};
  map.overrides = {{"depth", 0.5, 3}, {"share", 0.25, 4}, {"depth", 2, 2}};
  const Mixture mixture = mixture_of(printing_with(4, map));
  EXPECT_THAT(mixture.channels(), ElementsAre("share", "depth"));
  EXPECT_THAT(mix(mixture, {0.75f, 0.49f}), ElementsAre(0, 0, 1, 0));
  EXPECT_THAT(mix(mixture, {0.1f, 0.49f}), ElementsAre(0, 0, 1, 0)) << "both hold";
  EXPECT_THAT(mix(mixture, {0.1f, 0.5f}), ElementsAre(0, 0, 0, 1)) << "0.5 isn't below 0.5";
  EXPECT_THAT(mix(mixture, {0.75f, 1.5f}), ElementsAre(0, 1, 0, 0));
  EXPECT_THAT(mix(mixture, {0.75f, 2}), ElementsAre(near(0.25f), near(0.75f), 0, 0));
  EXPECT_THAT(mix(mixture, {0.75f, std::nanf("")}), ElementsAre(near(0.25f), near(0.75f), 0, 0)) << "isn't below";
  map.kind = PureMap{1};
  EXPECT_THAT(mix(mixture_of(printing_with(4, map)), {3, 0.3f}), ElementsAre(1, 0, 0, 0))
      << "channels come in the order of the overrides: 3 is the depth";
}

TEST(Mixture, TakesTheFractionOfWhatIsKeptOut) {
  MaterialMap map{BlendMap{"share", {{0, 1}, {1, 2}}}};
  map.overrides = {{"depth", 1, 3, 1}, {"depth", 0.5, 1}, {"share", 0.9, 3, 2}};
  const Mixture mixture = mixture_of(printing_with(3, map));
  EXPECT_THAT(mix(mixture, {0.75f, 2}), ElementsAre(near(0.25f), 0, near(0.75f)));
  EXPECT_THAT(mix(mixture, {0.95f, 2}), ElementsAre(near(0.05f), near(0.95f), 0));
  EXPECT_THAT(mix(mixture, {0.95f, 0.7f}), ElementsAre(0, near(0.95f), near(0.05f)));
  EXPECT_THAT(mix(mixture, {0.75f, 0.7f}), ElementsAre(0, 0, near(1)));
  EXPECT_THAT(mix(mixture, {0.95f, 0.4f}), ElementsAre(0, 0, 1)) << "what another override gives is kept out, too";
  EXPECT_FALSE(fits(mixture, {7, 0.7f})) << "the map's own rule decides what fits";
}

TEST(Mixture, TellsWhatAStrictMapRefuses) {
  const Mixture blend = mixture_of(printing_with(2, {BlendMap{"0", {{10, 1}, {20, 2}}}}));
  EXPECT_TRUE(fits(blend, {10}));
  EXPECT_TRUE(fits(blend, {20.05f}));
  EXPECT_FALSE(fits(blend, {9.9f}));
  EXPECT_FALSE(fits(blend, {std::numeric_limits<float>::quiet_NaN()}));
  DirectMap direct;
  direct.shares = {{"0", 1}, {"1", 2}};
  EXPECT_TRUE(fits(mixture_of(printing_with(2, {direct})), {0.4f, 0.6f}));
  EXPECT_FALSE(fits(mixture_of(printing_with(2, {direct})), {0.4f, 0.5f}));
  EXPECT_FALSE(fits(mixture_of(printing_with(2, {direct})), {-0.1f, 1}));
  direct.rest_material = 3;
  EXPECT_TRUE(fits(mixture_of(printing_with(3, {direct})), {0.4f, 0.5f}));
  EXPECT_FALSE(fits(mixture_of(printing_with(3, {direct})), {0.6f, 0.5f}));
}

Printing coloured(const std::vector<std::uint32_t>& colours) {
  Printing printing = printing_with(colours.size(), {ColourMap{"0", "1", "2", 1}});
  for (std::size_t m = 0; m < colours.size(); ++m) printing.materials[m].rgba = colours[m];
  return printing;
}

/// Of voxels [3, 20) of a block, the first of which have these values, and the others those of the last one.
MapMisfits misfits_of(const MaterialMap& map, const std::vector<std::vector<float>>& voxels) {
  const Mixture mixture = mixture_of(printing_with(3, map));
  std::vector<MixRow> rows(mixture.channels().size());
  for (std::size_t c = 0; c < rows.size(); ++c) {
    for (std::size_t k = 0; k < kMixBlock; ++k) {
      rows[c][k] = k < 3 ? 1e6f : voxels[std::min(k - 3, voxels.size() - 1)][c];  // Those before are no matter.
    }
  }
  MapMisfits misfits;
  mixture.count_misfits(rows, 3, 20, misfits);
  return misfits;
}

TEST(Mixture, ValuesOfVoxelsThatAreOverriddenAreNotMisfits) {
  MaterialMap map{BlendMap{"share", {{0, 1}, {1, 2}}}};
  map.overrides = {{"depth", 0.5, 3}};
  EXPECT_EQ(misfits_of(map, {{7, 0.4f}, {7, 0.6f}, {-7, 0.1f}, {0.5f, 1}}).off_map, 1u);
  EXPECT_TRUE(fits(mixture_of(printing_with(3, map)), {7, 0.4f}));
  EXPECT_FALSE(fits(mixture_of(printing_with(3, map)), {7, 0.6f}));
  MaterialMap direct{DirectMap{{{"share", 1}}}};
  direct.overrides = map.overrides;
  const MapMisfits misfits = misfits_of(direct, {{0.1f, 0.4f}, {0.25f, 0.6f}, {1, 1}});
  EXPECT_EQ(misfits.scaled_up, 1u);
  EXPECT_EQ(misfits.least_sum, 0.25);
}

TEST(Mixture, CountsValuesOffTheMap) {
  const MapMisfits blend = misfits_of({BlendMap{"0", {{10, 1}, {20, 2}}}}, {{9.9f}, {9.95f}, {20.05f}, {20.1f}, {15}});
  EXPECT_EQ(blend.off_map, 2u) << "beyond 1/128 of the map";
  EXPECT_EQ(blend.scaled_up, 0u);
  EXPECT_EQ(misfits_of({CalibrationMap{"0", 1, 2, {{0, 0}, {1, 1}}}}, {{std::nanf("")}, {2}, {0.5f}}).off_map, 2u);
  const MapMisfits direct =
      misfits_of({DirectMap{{{"0", 1}, {"1", 2}}, 3}}, {{-0.1f, 0.5f}, {1.1f, 0}, {0.7f, 0.7f}, {0.2f, 0.2f}});
  EXPECT_EQ(direct.off_map, 3u);
  EXPECT_EQ(direct.scaled_up, 0u) << "a material takes the rest";
  EXPECT_EQ(misfits_of({ColourMap{"0", "1", "2", 255}}, {{0, 100, 257.5f}, {-3, -3, -3}, {0, 255, 254}}).off_map, 2u);
  EXPECT_EQ(misfits_of({PureMap{2}}, {{}}).off_map, 0u);
}

TEST(Mixture, CountsFractionsThatAreScaledUp) {
  const MapMisfits misfits = misfits_of({DirectMap{{{"0", 1}, {"1", 2}}}},
                                        {{0.1f, 0.25f}, {0.5f, 0.499f}, {0.9f, 0}, {-0.5f, 0.75f}, {0.4f, 0.6f}});
  EXPECT_EQ(misfits.scaled_up, 3u);
  EXPECT_FLOAT_EQ(static_cast<float>(misfits.least_sum), 0.35f);
  EXPECT_EQ(misfits.off_map, 1u) << "the negative one";
  EXPECT_EQ(misfits_of({DirectMap{{{"0", 1}}}}, {{0}, {1}}).least_sum, 0);
  EXPECT_EQ(misfits_of({DirectMap{{{"0", 1}}}}, {{1}}).least_sum, 1);
}

// What a strict map refuses is what is counted, colours that no mix gives aside.
TEST(Mixture, CountsWhatAStrictMapRefuses) {
  std::mt19937 random(20261128);
  std::uniform_real_distribution<float> value(-0.1f, 1.1f);
  for (const MaterialMap& map :
       {MaterialMap{BlendMap{"0", {{0, 1}, {1, 2}}}}, MaterialMap{DirectMap{{{"0", 1}, {"1", 2}}}},
        MaterialMap{DirectMap{{{"0", 1}, {"1", 2}}, 3}}}) {
    const Mixture mixture = mixture_of(printing_with(3, map));
    for (int i = 0; i < 1000; ++i) {
      const std::vector<float> values = {value(random), value(random)};
      const MapMisfits misfits = misfits_of(map, {values});
      const bool counted = misfits.off_map + misfits.scaled_up > 0;
      ASSERT_EQ(counted, !fits(mixture, {values.begin(), values.begin() + std::ssize(mixture.channels())}))
          << values[0] << ' ' << values[1];
    }
  }
}

TEST(Mixture, OfAColourLooksLikeIt) {
  const std::vector<std::uint32_t> palette = {0x000000ff, 0xffffffff, 0x00ffffff, 0xff00ffff,
                                              0xffff00ff, 0xff0000ff, 0x00ff00ff, 0x0000ffff};
  const Mixture mixture = mixture_of(coloured(palette));
  std::mt19937 random(3);
  std::uniform_real_distribution<float> unit(0, 1);
  for (int i = 0; i < 500; ++i) {
    const std::vector<float> colour = {unit(random), unit(random), unit(random)};
    Vec3 mixed = Vec3::Zero();
    const std::vector<float> fractions = mix(mixture, colour);
    float sum = 0;
    for (std::size_t m = 0; m < palette.size(); ++m) {
      mixed += static_cast<double>(fractions[m]) * linear_colour(palette[m]);
      sum += fractions[m];
      EXPECT_GE(fractions[m], 0);
    }
    EXPECT_NEAR(sum, 1, 1e-5);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(mixed[axis], linear_intensity(static_cast<double>(colour[static_cast<std::size_t>(axis)])), 2e-3);
    }
  }
}

TEST(Mixture, OfAColourOutsideTakesTheNearestInside) {
  const Mixture mixture = mixture_of(coloured({0x000000ff, 0xffffffff}));
  EXPECT_THAT(mix(mixture, {0, 0, 0}), ElementsAre(near(1), near(0)));
  EXPECT_THAT(mix(mixture, {1, 1, 1}), ElementsAre(near(0), near(1)));
  const std::vector<float> red = mix(mixture, {1, 0, 0});
  EXPECT_NEAR(red[1], 1.0 / 3, 1e-3);  // The foot of the perpendicular onto the greys.
  EXPECT_TRUE(fits(mixture, {0.5f, 0.5f, 0.5f}));
  EXPECT_FALSE(fits(mixture, {1, 0, 0}));
  EXPECT_FALSE(fits(mixture, {1.1f, 1.1f, 1.1f}));
}

TEST(ColourGamut, TakesTheNearestOfManyColours) {
  const std::vector<Vec3> line = {Vec3(0, 0, 0), Vec3(1, 1, 1), Vec3(0.4, 0.4, 0.4)};
  const ColourMix mix = ColourGamut(line).mix(Vec3(0.2, 0.2, 0.2));
  EXPECT_NEAR(mix.weights[0], 0.5, 1e-9);
  EXPECT_NEAR(mix.weights[1], 0, 1e-9);
  EXPECT_NEAR(mix.weights[2], 0.5, 1e-9);
  EXPECT_NEAR(mix.distance, 0, 1e-9);
}

TEST(Mixture, FindsItsChannelsAmongOthers) {
  DirectMap direct;
  direct.shares = {{"7", 1}, {"2", 2}};
  const Mixture mixture = mixture_of(printing_with(3, {direct}));
  EXPECT_EQ(places_among(std::vector<std::string>{"2", "5", "7"}, mixture), (std::vector<std::size_t>{2, 0}));
  EXPECT_TRUE(places_among(std::vector<std::string>{"2", "5"}, mixture_of(printing_with(3, {PureMap{2}}))).empty());
}

}  // namespace
}  // namespace ccslice
