// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The values of options as text: sizes, counts, times, choices, addresses. Parsers throw std::invalid_argument whose
// text says what would have been right ("a size of at least 1MiB, such as 512MiB").

#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace ccslice::server {

inline constexpr std::uint64_t kAnySize = INT64_MAX;

std::uint64_t parse_size(const std::string& text, std::uint64_t least, std::uint64_t most = kAnySize);
std::uint64_t parse_count(const std::string& text, std::uint64_t least, std::uint64_t most);
std::chrono::milliseconds parse_duration(const std::string& text);
/// Index of the choice.
std::size_t parse_choice(const std::string& text, const std::vector<std::string>& choices);
/// HOST:PORT, [IPV6]:PORT or unix:PATH.
std::string parse_address(const std::string& text);

std::string show_size(std::uint64_t bytes);
std::string show_duration(std::chrono::milliseconds duration);

/// Whether only this machine reaches an address.
[[nodiscard]] bool is_local(const std::string& address);

/// The address under which this machine reaches a server that listens on `listen_address`.
std::string local_address(const std::string& listen_address);

std::string join(const std::vector<std::string>& parts, std::string_view separator);
/// Lines of at most `width` characters, each with the indent in front and a line end.
std::string wrap(const std::string& text, std::size_t width, const std::string& indent);

}  // namespace ccslice::server
