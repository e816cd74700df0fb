// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/pixel_font.h"

#include <array>
#include <cstddef>
#include <cstdint>

namespace ccslice::cli {
namespace {

constexpr std::uint8_t kInk = 60;

/// Rows from the top; the highest of the 5 bits is the dot on the left.
using Glyph = std::array<std::uint8_t, kGlyphHeight>;

constexpr std::string_view kCharacters = "0123456789.-+em";
constexpr std::array<Glyph, kCharacters.size()> kGlyphs = {{
    {0b01110, 0b10001, 0b10011, 0b10101, 0b11001, 0b10001, 0b01110},
    {0b00100, 0b01100, 0b00100, 0b00100, 0b00100, 0b00100, 0b01110},
    {0b01110, 0b10001, 0b00001, 0b00110, 0b01000, 0b10000, 0b11111},
    {0b01110, 0b10001, 0b00001, 0b00110, 0b00001, 0b10001, 0b01110},
    {0b00010, 0b00110, 0b01010, 0b10010, 0b11111, 0b00010, 0b00010},
    {0b11111, 0b10000, 0b11110, 0b00001, 0b00001, 0b10001, 0b01110},
    {0b00110, 0b01000, 0b10000, 0b11110, 0b10001, 0b10001, 0b01110},
    {0b11111, 0b00001, 0b00010, 0b00100, 0b01000, 0b01000, 0b01000},
    {0b01110, 0b10001, 0b10001, 0b01110, 0b10001, 0b10001, 0b01110},
    {0b01110, 0b10001, 0b10001, 0b01111, 0b00001, 0b00010, 0b01100},
    {0b00000, 0b00000, 0b00000, 0b00000, 0b00000, 0b01100, 0b01100},
    {0b00000, 0b00000, 0b00000, 0b01110, 0b00000, 0b00000, 0b00000},
    {0b00000, 0b00100, 0b00100, 0b11111, 0b00100, 0b00100, 0b00000},
    {0b00000, 0b00000, 0b01110, 0b10001, 0b11111, 0b10000, 0b01110},
    {0b00000, 0b00000, 0b11010, 0b10101, 0b10101, 0b10101, 0b10101},
}};

void draw_dot(int column, int row, Picture& picture) {
  if (column < 0 || row < 0 || column >= picture.width || row >= picture.height) return;
  const auto place = static_cast<std::size_t>(row) * static_cast<std::size_t>(picture.width);
  for (std::size_t i = 0; i < 3; ++i) picture.rgb[3 * (place + static_cast<std::size_t>(column)) + i] = kInk;
}

}  // namespace

int text_width(std::string_view text) { return static_cast<int>(text.size()) * kGlyphAdvance - 1; }

void draw_text(std::string_view text, int left, int top, Picture& picture) {
  for (const char c : text) {
    const std::size_t at = kCharacters.find(c);
    for (int row = 0; row < kGlyphHeight && at != std::string_view::npos; ++row) {
      for (int column = 0; column < kGlyphWidth; ++column) {
        if (kGlyphs[at][static_cast<std::size_t>(row)] >> (kGlyphWidth - 1 - column) & 1) {
          draw_dot(left + column, top + row, picture);
        }
      }
    }
    left += kGlyphAdvance;
  }
}

}  // namespace ccslice::cli
