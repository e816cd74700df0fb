// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Pieces of the text of --map and its like: names, pairs, cell regions.

#pragma once

#include <string>
#include <string_view>
#include <utility>

namespace ccslice::cli {

/// Returns the texts before and after the last '='. `taken` says what the option takes, with its name. Throws
/// UsageError.
std::pair<std::string, std::string> parse_pair(const std::string& taken, const std::string& text);

/// A name, without the quotation marks that it may stand between.
std::string unquoted(std::string_view text);

bool is_number(std::string_view text);

/// Returns the name and the map of NAME=MAP or "NAME"=MAP, the text behind "region:". `taken` says what the option
/// takes. Throws UsageError.
std::pair<std::string, std::string> parse_region(const std::string& taken, const std::string& piece);

}  // namespace ccslice::cli
