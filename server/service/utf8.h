// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Which bytes are UTF-8, as texts from clients have to be.

#pragma once

#include <cstddef>
#include <string_view>

namespace ccslice::server {

/// Bytes of the UTF-8 sequence at the start of `text`; 0 if there is none: overlong forms and surrogates are none.
/// REQUIRES: text isn't empty.
std::size_t utf8_sequence_length(std::string_view text) noexcept;

bool is_utf8(std::string_view text) noexcept;

}  // namespace ccslice::server
