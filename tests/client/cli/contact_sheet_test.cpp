// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/pictures/contact_sheet.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "client/cli/pictures/pixel_font.h"

namespace ccslice::cli {
namespace {

using Rgb = std::array<int, 3>;

Rgb pixel_at(const Picture& picture, int column, int row) {
  const std::size_t at =
      3 * (static_cast<std::size_t>(row) * static_cast<std::size_t>(picture.width) + static_cast<std::size_t>(column));
  return {picture.rgb[at], picture.rgb[at + 1], picture.rgb[at + 2]};
}

Rgb rgb_of(const Colour& colour) { return {to_byte(colour.x()), to_byte(colour.y()), to_byte(colour.z())}; }

TEST(ContactSheet, SpreadsLayersEvenly) {
  for (std::uint32_t count = 1; count < 2000; ++count) {
    const SpreadLayers layers = spread_layers(100, count);
    const std::uint32_t last = layers.first + (layers.count - 1) * layers.stride;
    ASSERT_GE(layers.count, std::min(count, 13u)) << count;
    ASSERT_LE(layers.count, 24u) << count;
    ASSERT_GE(layers.first, 100u) << count;
    ASSERT_LT(last, 100 + count) << count;
    const std::uint32_t below = layers.first - 100, above = 99 + count - last;
    ASSERT_TRUE(above == below || above == below + 1) << count;
    ASSERT_LT(below, layers.stride) << count;
  }
}

TEST(ContactSheet, FillsTheSheetWhateverTheShape) {
  for (const double aspect : {0.001, 0.1, 0.5, 1.0, 3.0, 40.0, 1e4}) {
    for (int count = 1; count <= 24; ++count) {
      const SheetLayout layout = lay_out_sheet(count, 10, 10 * aspect);
      const int rows = (count + layout.columns - 1) / layout.columns;
      EXPECT_LE(layout.columns * layout.tile_width, 1200);
      EXPECT_LE(rows * layout.tile_height, 900);
      EXPECT_GE(std::max(layout.tile_width, layout.tile_height), 90) << aspect << " " << count;
    }
  }
  const SheetLayout square = lay_out_sheet(12, 5, 5);
  EXPECT_EQ(square.columns, 4);
  EXPECT_EQ(square.tile_width, square.tile_height);
}

const Legend kHardness = {.title = "hardness", .range = {{0, 1}}, .entries = {}};

/// Two layers of 2 x 2: the first has its upper left voxel inside, the second all.
VoxelBlock two_layers(std::vector<std::uint8_t> value, Legend legend = {}) {
  return {{2, 2, 2}, {1, 0, 0, 0, 1, 1, 1, 1}, std::move(value), std::move(legend)};
}

/// Where a tile of 100 x 100 begins, in the only row of a sheet.
constexpr int kTileTop = 8 + kGlyphHeight + 6;

TEST(ContactSheet, ShowsLayersSideBySide) {
  const SheetLayout layout{2, 100, 100};
  const std::vector<SheetCaption> captions = {{"0", "0.5 mm"}, {"1", "1.5 mm"}};
  const Picture sheet = draw_contact_sheet(two_layers({0, 0, 0, 0, 0, 255, 0, 0}, kHardness), captions, layout);
  ASSERT_EQ(sheet.width, 8 + 2 * 108);
  const int top = kTileTop;
  const Rgb outside = pixel_at(sheet, 8 + 75, top + 25);
  EXPECT_EQ(pixel_at(sheet, 8 + 25, top + 25), rgb_of(material_colour(0)));
  EXPECT_EQ(pixel_at(sheet, 8 + 25, top + 75), outside) << "row 0 is on top";
  EXPECT_NE(outside, rgb_of(material_colour(0)));
  EXPECT_EQ(pixel_at(sheet, 116 + 75, top + 25), rgb_of(material_colour(1)));
  EXPECT_EQ(pixel_at(sheet, 116 + 75, top + 75), rgb_of(material_colour(0)));
  EXPECT_EQ(pixel_at(sheet, 4, top + 50), (Rgb{255, 255, 255}));
}

TEST(ContactSheet, WithoutValuesIsOfOneColour) {
  const Picture sheet =
      draw_contact_sheet(two_layers(std::vector<std::uint8_t>(8, 0)), {{"0", ""}, {"1", ""}}, {1, 100, 100});
  EXPECT_EQ(sheet.width, 116);
  EXPECT_EQ(pixel_at(sheet, 8 + 25, sheet.height - 25), rgb_of(kPlainMaterial));
}

TEST(ContactSheet, ShowsMaterialsInTheirOwnColours) {
  const Legend legend = {
      .title = "materials", .range = {}, .entries = {{"soft", Colour(1, 0, 0)}, {"hard", Colour(0, 0, 1)}}};
  const VoxelBlock block = two_layers({1, 0, 0, 0, 2, 1, 1, 2}, legend);
  const Picture sheet = draw_contact_sheet(block, {{"0", ""}, {"1", ""}}, {2, 100, 100});
  const int top = kTileTop;
  EXPECT_EQ(pixel_at(sheet, 8 + 25, top + 25), (Rgb{255, 0, 0}));
  EXPECT_EQ(pixel_at(sheet, 116 + 25, top + 25), (Rgb{0, 0, 255}));
  EXPECT_EQ(pixel_at(sheet, 116 + 75, top + 25), (Rgb{255, 0, 0}));
}

TEST(ContactSheet, ShowsNumbersWithoutAnEntryAsPlainMaterial) {
  const Legend legend = {.title = "materials", .range = {}, .entries = {{"soft", Colour(1, 0, 0)}}};
  const Picture sheet =
      draw_contact_sheet(two_layers({0, 0, 0, 0, 2, 255, 1, 0}, legend), {{"0", ""}, {"1", ""}}, {2, 100, 100});
  EXPECT_EQ(pixel_at(sheet, 8 + 25, kTileTop + 25), rgb_of(kPlainMaterial));
  EXPECT_EQ(pixel_at(sheet, 116 + 25, kTileTop + 25), rgb_of(kPlainMaterial));
  EXPECT_EQ(pixel_at(sheet, 116 + 25, kTileTop + 75), (Rgb{255, 0, 0}));
}

TEST(ContactSheet, HasALegendBelow) {
  const std::vector<SheetCaption> captions = {{"0", ""}, {"1", ""}};
  const VoxelBlock with = two_layers(std::vector<std::uint8_t>(8, 0), kHardness);
  const Picture plain = draw_contact_sheet(two_layers(with.value), captions, {2, 100, 100});
  const Picture sheet = draw_contact_sheet(with, captions, {2, 100, 100});
  EXPECT_GT(sheet.height, plain.height);
  EXPECT_EQ(pixel_at(sheet, 8 + 25, kTileTop + 25), rgb_of(material_colour(0)))
      << "a channel's lowest value is no blank";
}

TEST(PixelFont, WritesNumbers) {
  Picture picture{text_width("17"), kGlyphHeight, {}};
  picture.rgb.assign(static_cast<std::size_t>(3 * picture.width * picture.height), 255);
  draw_text("17", 0, 0, picture);
  std::vector<std::string> rows;
  for (int row = 0; row < picture.height; ++row) {
    rows.emplace_back();
    for (int column = 0; column < picture.width; ++column)
      rows.back() += pixel_at(picture, column, row)[0] < 128 ? '#' : ' ';
  }
  EXPECT_EQ(rows, (std::vector<std::string>{"  #   #####", " ##       #", "  #      # ", "  #     #  ", "  #    #   ",
                                            "  #    #   ", " ###   #   "}));
  EXPECT_EQ(text_width("17", 3), 3 * picture.width);
  draw_text("8", -2, -3, picture);
  draw_text("8", picture.width - 2, picture.height - 3, picture);
}

}  // namespace
}  // namespace ccslice::cli
