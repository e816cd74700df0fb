// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Values of options as text. Parsers throw UsageError, whose text says what would have been right.

#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace ccslice::cli {

/// The command line is wrong.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

std::vector<std::string> split(std::string_view text, char separator);

/// A finite number; `option` names it in the error.
double parse_number(const std::string& option, std::string_view text);

/// "1,2,3": between `least` and `most` finite numbers.
std::vector<double> parse_numbers(const std::string& option, std::string_view text, std::size_t least,
                                  std::size_t most);

struct LayerRange {
  std::uint32_t first = 0, last = 0;  // Both included.
};

/// "10..19" or "10".
LayerRange parse_layer_range(const std::string& option, std::string_view text);

struct Share {
  std::uint32_t number = 1, count = 1;  // One of `count`, from 1.
};

/// "2/8".
Share parse_share(const std::string& option, std::string_view text);

/// Counts separated by commas, as many as there are `names`: "800,600,20" for columns,rows,layers.
std::vector<std::uint32_t> parse_counts(const std::string& option, std::string_view text, const std::string& names);

}  // namespace ccslice::cli
