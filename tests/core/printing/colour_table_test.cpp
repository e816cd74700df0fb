// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/printing/colour_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/base/error.h"
#include "core/printing/colour_gamut.h"

namespace ccslice {
namespace {

const std::vector<PrintMaterial> kPalette = {{"cyan", 0x00a0e0ff},
                                             {"magenta", 0xe0007aff},
                                             {"yellow", 0xf0e000ff},
                                             {"white", 0xf8f8f8ff},
                                             {"black", 0x101010ff}};

TEST(ColourTable, HasTheGamutsMixesAtItsNodes) {
  const ColourTable table(kPalette);
  std::vector<Vec3> colours;
  for (const PrintMaterial& material : kPalette) colours.push_back(linear_colour(material.rgba));
  const ColourGamut gamut(colours);
  constexpr std::size_t kStep = 8, kLast = ColourTable::kNodes - 1;
  std::size_t reached = 0, nodes = 0;
  for (std::size_t blue = 0; blue <= kLast; blue += kStep) {
    for (std::size_t green = 0; green <= kLast; green += kStep) {
      for (std::size_t red = 0; red <= kLast; red += kStep, ++nodes) {
        const std::array<double, 3> at = {double(red), double(green), double(blue)};
        Vec3 colour;
        for (int axis = 0; axis < 3; ++axis) colour[axis] = linear_intensity(at[std::size_t(axis)] / kLast);
        const ColourMix mix = gamut.mix(colour);
        const ColourTable::Weights weights = table.weights({float(red), float(green), float(blue)});
        for (std::size_t m = 0; m < weights.size(); ++m) EXPECT_NEAR(weights[m], mix.weights[m], 1e-6);
        EXPECT_EQ(table.is_reached(at), mix.distance <= kStrictSlack);
        reached += table.is_reached(at);
      }
    }
  }
  EXPECT_GT(reached, 0u);
  EXPECT_LT(reached, nodes);
}

TEST(ColourTable, MixesNothingOfWhatLeavesVoxelsEmpty) {
  std::vector<PrintMaterial> with_void = kPalette;
  with_void.insert(with_void.begin() + 2, {"void", 0x000000ff, true});
  const ColourTable table(with_void), without(kPalette);
  for (const float along : {0.0f, 7.0f, 15.5f, 32.0f}) {
    ColourTable::Weights weights = table.weights({along, 0.25f * along, 32 - along});
    EXPECT_EQ(weights[2], 0);
    std::rotate(weights.begin() + 2, weights.begin() + 3, weights.end());
    EXPECT_EQ(weights, without.weights({along, 0.25f * along, 32 - along}));
  }
}

TEST(ColourTable, MixesMixesBetweenItsNodes) {
  const ColourTable table(kPalette);
  for (const float along : {0.0f, 0.25f, 15.5f, 31.999f, 32.0f}) {
    const ColourTable::Weights weights = table.weights({along, 32 - along, 0.5f * along});
    float sum = 0;
    for (const float weight : weights) {
      EXPECT_GE(weight, 0);
      sum += weight;
    }
    EXPECT_NEAR(sum, 1, 1e-5);
  }
}

TEST(ColourTable, IsMadeWhereAMapTakesColoursAndCanBeCancelled) {
  Printing printing;
  printing.materials = kPalette;
  printing.map = {BlendMap{"x", {{0, 1}, {1, 2}}}};
  EXPECT_EQ(colour_table_of(printing), nullptr);
  printing.cell_region_maps.push_back({7, {ColourMap{"r", "g", "b", 1}}});
  EXPECT_NE(colour_table_of(printing), nullptr);
  const CancellationToken cancel = CancellationToken::make();
  cancel.cancel();
  try {
    (void)colour_table_of(printing, cancel);
    FAIL() << "not cancelled";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kCancelled);
  }
}

}  // namespace
}  // namespace ccslice
