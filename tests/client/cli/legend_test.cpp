// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/pictures/legend.h"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <string>
#include <tuple>
#include <vector>

#include "client/cli/pictures/pixel_font.h"

namespace ccslice::cli {
namespace {

using Rgb = std::array<int, 3>;

constexpr int kWidth = 300, kHeight = 10;

Rgb place(const Picture& picture, int column, int row) {
  const std::size_t at =
      3 * (static_cast<std::size_t>(row) * static_cast<std::size_t>(picture.width) + static_cast<std::size_t>(column));
  return {picture.rgb[at], picture.rgb[at + 1], picture.rgb[at + 2]};
}

Rgb as_rgb(const Colour& colour) { return {to_byte(colour.x()), to_byte(colour.y()), to_byte(colour.z())}; }

Picture labelled(const Legend& legend, int scale = 1, int width = kWidth) {
  return with_legend(blank_picture(width, kHeight), legend, scale);
}

/// Whether the text is somewhere in the picture, dot for dot with nothing round it.
bool shows(const Picture& picture, const std::string& text) {
  Picture stamp = blank_picture(text_width(text), kGlyphHeight);
  draw_text(text, 0, 0, stamp);
  const auto fits_at = [&](int left, int top) {
    for (int row = 0; row < stamp.height; ++row) {
      for (int column = 0; column < stamp.width; ++column) {
        if (place(stamp, column, row) != place(picture, left + column, top + row)) return false;
      }
    }
    return true;
  };
  for (int top = 0; top + stamp.height <= picture.height; ++top) {
    for (int left = 0; left + stamp.width <= picture.width; ++left) {
      if (fits_at(left, top)) return true;
    }
  }
  return false;
}

/// The rows in which a colour is, from the first to the last.
std::array<int, 2> rows_of(const Picture& picture, const Rgb& colour) {
  std::array<int, 2> rows = {-1, -1};
  for (int row = 0; row < picture.height; ++row) {
    for (int column = 0; column < picture.width; ++column) {
      if (place(picture, column, row) != colour) continue;
      if (rows[0] < 0) rows[0] = row;
      rows[1] = row;
    }
  }
  return rows;
}

TEST(Legend, OfAChannelIsABarWithItsNameAndNumbers) {
  const Picture picture = labelled({.title = "hardness", .range = {{20, 90}}, .entries = {}});
  for (const char* text : {"hardness", "20", "40", "60", "90"}) EXPECT_TRUE(shows(picture, text)) << text;
  const auto [first, last] = rows_of(picture, as_rgb(material_colour(1 - 0.5 / 234)));
  ASSERT_GE(first, kHeight) << "below the picture";
  EXPECT_EQ(place(picture, kWidth - 5, first), as_rgb(material_colour(1 - 0.5 / 234)));
  EXPECT_GT(last, first + 4);
}

TEST(Legend, SaysTheEndsOfAnyRange) {
  for (const auto& [range, low, high] : std::vector<std::tuple<std::array<double, 2>, std::string, std::string>>{
           {{0, 1}, "0", "1"},
           {{-0.25, 1e-3}, "-0.25", "0.001"},
           {{1000.5, 1001.25}, "1000.5", "1001.25"},
           {{-1e30, 1e30}, "-1e+30", "1e+30"},
           {{1e17, 1e17 + 64}, "1e+17", "1e+17"}}) {
    const Picture picture = labelled({.title = "x", .range = range, .entries = {}});
    EXPECT_TRUE(shows(picture, low)) << low;
    EXPECT_TRUE(shows(picture, high)) << high;
  }
}

TEST(Legend, OfAConstantChannelIsOneColour) {
  const Picture picture = labelled({.title = "x", .range = {{5, 5}}, .entries = {}});
  EXPECT_TRUE(shows(picture, "5 everywhere"));
  EXPECT_GE(rows_of(picture, as_rgb(material_colour(0)))[0], kHeight);
}

TEST(Legend, NamesMaterialsBesideTheirColours) {
  const Picture picture =
      labelled({.title = "materials", .range = {}, .entries = {{"soft", Colour(1, 0, 0)}, {"white", Colour(1, 1, 1)}}});
  for (const char* text : {"materials", "soft", "white"}) EXPECT_TRUE(shows(picture, text)) << text;
  EXPECT_GE(rows_of(picture, {255, 0, 0})[0], kHeight);
}

TEST(Legend, TakesAFewRowsForManyNames) {
  Legend legend{.title = "cell regions", .range = {}, .entries = {}};
  for (int i = 0; i < 255; ++i) {
    legend.entries.push_back({std::string(static_cast<std::size_t>(i % 60), 'w'), Colour(0, 0, 1)});
  }
  const Picture picture = labelled(legend);
  EXPECT_LT(picture.height, kHeight + 80);
  EXPECT_TRUE(shows(picture, "more"));
}

TEST(Legend, WidensANarrowPictureAndKeepsIt) {
  Picture narrow = blank_picture(3, 2);
  set_colour(2, 1, Colour(1, 0, 0), narrow);
  const Picture picture = with_legend(narrow, {.title = "x", .range = {{0, 1}}, .entries = {}}, 1);
  EXPECT_GE(picture.width, 100);
  EXPECT_EQ(place(picture, 2, 1), (Rgb{255, 0, 0}));
  EXPECT_EQ(place(picture, 1, 1), (Rgb{255, 255, 255}));
  EXPECT_EQ(place(picture, 3, 1), (Rgb{255, 255, 255}));
}

TEST(Legend, IsNothingForOneColour) { EXPECT_EQ(labelled({}).height, kHeight); }

TEST(Legend, OfAnyNameStaysInThePicture) {
  for (const std::string& name :
       {std::string(), std::string("H\xc3\xa4rte"), std::string(500, 'x'), std::string("\x1b[31m\n\xff\x80")}) {
    for (const int scale : {1, 2, 5}) {
      const Picture bar = labelled({.title = name, .range = {{0, 1}}, .entries = {}}, scale, 20);
      EXPECT_EQ(bar.rgb.size(), static_cast<std::size_t>(3 * bar.width * bar.height));
      const Picture names = labelled({.title = name, .range = {}, .entries = {{name, Colour(0, 0, 0)}}}, scale, 20);
      EXPECT_EQ(names.rgb.size(), static_cast<std::size_t>(3 * names.width * names.height));
    }
  }
}

TEST(Legend, HasRoundNumbers) {
  EXPECT_EQ(round_numbers_between(0, 10, 4), (std::vector<double>{2, 4, 6, 8}));
  EXPECT_EQ(round_numbers_between(-3, 4, 3), (std::vector<double>{-2, 0, 2}));
  EXPECT_EQ(round_numbers_between(0, 0.7, 9).size(), 6u);
  const double big = 1e17;  // Where not every integer is a double.
  EXPECT_LE(round_numbers_between(big, big + 64, 5).size(), 5u);
  EXPECT_LE(round_numbers_between(0, std::numeric_limits<double>::denorm_min(), 5).size(), 5u);
}

TEST(PixelFont, CutsWhatDoesntFit) {
  EXPECT_EQ(fitting_text("stiffness", 60), "stiffness");
  EXPECT_EQ(fitting_text("stiffness", 40), "stif..");
  EXPECT_EQ(fitting_text("stiffness", 5), "");
  EXPECT_EQ(fitting_text("\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4", 17), "\xc3\xa4..");
  EXPECT_EQ(character_count("H\xc3\xa4rte"), 5);
}

}  // namespace
}  // namespace ccslice::cli
