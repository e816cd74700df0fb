// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Numbers in pictures: a font of 5 x 7 dots that has the digits, '.', '-', '+', 'e' and 'm'.

#pragma once

#include <string_view>

#include "client/cli/picture.h"

namespace ccslice::cli {

inline constexpr int kGlyphWidth = 5, kGlyphHeight = 7, kGlyphAdvance = 6;

/// Width of a text, without the gap behind its last character.
int text_width(std::string_view text);

/// Writes in dark grey from the upper left. Other characters are blank; what lies beyond the picture is left out.
void draw_text(std::string_view text, int left, int top, Picture& picture);

}  // namespace ccslice::cli
