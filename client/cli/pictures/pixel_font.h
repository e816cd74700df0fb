// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Text in pictures: a font of 5 x 7 dots that has the printable characters of ASCII. A dot may be several places wide.
// It is here, and no library, because a font of a library is a file that would have to be found at run time.

#pragma once

#include <string>
#include <string_view>

#include "client/cli/pictures/picture.h"

namespace ccslice::cli {

inline constexpr int kGlyphWidth = 5, kGlyphHeight = 7, kGlyphAdvance = 6;

/// How many characters of a UTF-8 text are drawn.
int character_count(std::string_view text);

/// Width of a text, without the gap behind its last character.
int text_width(std::string_view text, int scale = 1);

/// The text, or as much of its beginning as fits into `width` with ".." behind it; nothing if not even that fits.
std::string fitting_text(std::string_view text, int width, int scale = 1);

/// Writes in dark grey from the upper left, dots of scale x scale places. A character that isn't ASCII is a box; what
/// lies beyond the picture is left out. REQUIRES: scale > 0.
void draw_text(std::string_view text, int left, int top, Picture& picture, int scale = 1);

}  // namespace ccslice::cli
