// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/support/mutate.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>
#include <utility>
#include <vector>

namespace ccslice::oracle {
namespace {

using Range = std::pair<std::size_t, std::size_t>;  // Begin and end.

constexpr std::string_view kNumbers[] = {"0",
                                         "1",
                                         "-1",
                                         "2",
                                         "7",
                                         "255",
                                         "4294967295",
                                         "2147483648",
                                         "9007199254740992",
                                         "18446744073709551615",
                                         "99999999999999999999999",
                                         "15999999",
                                         "nan",
                                         "-inf",
                                         "1e999",
                                         "1e-999",
                                         "0.5",
                                         "1e30",
                                         "x",
                                         "",
                                         "0x10"};

std::size_t below(std::mt19937& random, std::size_t end) { return random() % end; }

/// The runs of bytes that `is_part` accepts.
template <typename Part>
std::vector<Range> runs(const std::string& bytes, Part is_part) {
  std::vector<Range> found;
  for (std::size_t at = 0; at < bytes.size();) {
    std::size_t end = at;
    while (end < bytes.size() && is_part(bytes[end])) ++end;
    if (end > at) found.push_back({at, end});
    at = end + 1;
  }
  return found;
}

bool is_number_part(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '-'; }

void replace_number(std::string& bytes, std::mt19937& random) {
  const std::vector<Range> numbers = runs(bytes, is_number_part);
  if (numbers.empty()) return;
  const auto [begin, end] = numbers[below(random, numbers.size())];
  bytes.replace(begin, end - begin, kNumbers[below(random, std::size(kNumbers))]);
}

void overwrite_block(std::string& bytes, std::mt19937& random) {
  constexpr std::array<unsigned char, 5> kFill = {0xff, 0x7f, 0x80, 0x00, 0x01};
  const std::size_t size = std::min(bytes.size(), std::size_t{4} << below(random, 2));
  const std::size_t at = below(random, bytes.size() - size + 1);
  const auto first = static_cast<char>(kFill[below(random, kFill.size())]);
  const auto others = static_cast<char>(kFill[below(random, kFill.size())]);
  std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(at), size, others);
  bytes[at] = first;
}

void move_line(std::string& bytes, std::mt19937& random) {
  const std::vector<Range> lines = runs(bytes, [](char c) { return c != '\n'; });
  const auto [begin, end] = lines[below(random, lines.size())];
  const std::string line = bytes.substr(begin, end - begin) + '\n';
  if (random() % 2 != 0) bytes.erase(begin, line.size());
  if (random() % 2 != 0) bytes.insert(lines[below(random, lines.size())].first % (bytes.size() + 1), line);
}

void change(std::string& bytes, std::mt19937& random) {
  switch (below(random, 8)) {
    case 0: bytes[below(random, bytes.size())] ^= static_cast<char>(1u << below(random, 8)); break;
    case 1: bytes[below(random, bytes.size())] = static_cast<char>(random()); break;
    case 2: bytes.resize(below(random, bytes.size())); break;
    case 3: overwrite_block(bytes, random); break;
    case 4: move_line(bytes, random); break;
    default: replace_number(bytes, random); break;
  }
}

}  // namespace

std::string mutated(std::string bytes, std::mt19937& random) {
  for (std::size_t changes = 1 + below(random, 3); changes > 0 && bytes.size() > 1; --changes) change(bytes, random);
  return bytes;
}

}  // namespace ccslice::oracle
