// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Text of clients on its way into the log. Nothing in it may start a line, move the cursor or fill the disk: control
// characters are escaped and the length is bounded.

#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace ccslice::server {

/// The longest message of a line. Longer ones are cut and end in "...".
inline constexpr std::size_t kMaxLogTextBytes = 2048;

/// For plain lines: control characters, and bytes that aren't UTF-8, as \xHH.
std::string to_log_line(std::string_view text);

/// For the inside of a JSON string: control characters, quotes and backslashes escaped; bytes that aren't UTF-8 as
/// U+FFFD.
std::string to_log_json(std::string_view text);

}  // namespace ccslice::server
