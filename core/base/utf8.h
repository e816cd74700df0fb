// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Texts in UTF-8: which bytes are, and which characters a terminal shows.

#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace ccslice {

/// Bytes of the UTF-8 sequence at the start of `text`; 0 if there is none: overlong forms and surrogates are none.
/// REQUIRES: text isn't empty.
std::size_t utf8_sequence_length(std::string_view text) noexcept;

bool is_utf8(std::string_view text) noexcept;

/// `text` in UTF-8, of ISO 8859-1 (Latin-1), whose bytes are the code points.
std::string utf8_of_latin1(std::string_view text);

/// REQUIRES: `sequence` is one sequence of UTF-8.
std::uint32_t utf8_code_point(std::string_view sequence) noexcept;

/// Characters that terminals obey instead of showing them, or that change how others are shown: C0, DEL and C1, the
/// separators of lines and paragraphs, and what turns the direction of writing.
bool is_control(std::uint32_t code_point) noexcept;

}  // namespace ccslice
