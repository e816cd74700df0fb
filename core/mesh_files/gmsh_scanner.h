// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The numbers of a Gmsh file, ASCII or binary alike. In a binary file the numbers of a section follow the line of its
// name, in the byte order that the number one behind the format's line tells. It trusts no count.

#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/mesh_import/text_scanner.h"

namespace ccslice {

class GmshScanner {
 public:
  /// `bytes` must outlive the scanner.
  explicit GmshScanner(std::string_view bytes) : text_(bytes, TextScanner::Comments::kNone) {}

  TextScanner& text() noexcept { return text_; }
  bool binary() const noexcept { return binary_; }

  /// Behind the line of the format: takes the number one.
  void set_binary();
  /// Behind the name of a section whose numbers follow at once.
  void open_section();
  void close_section(const std::string& name);

  /// An integer of four bytes in a binary file.
  std::uint64_t integer(std::string_view expected);
  /// An integer of four bytes in a binary file, which may be negative.
  std::int64_t signed_integer(std::string_view expected);
  /// An integer of eight bytes in a binary file.
  std::uint64_t size(std::string_view expected);
  /// A double, which may be nan or inf.
  double any_real(std::string_view expected);
  /// Passes over an integer of four bytes, which may be negative.
  void skip_integer(std::string_view expected);

 private:
  std::uint64_t raw(std::size_t size_bytes, std::string_view expected);

  TextScanner text_;
  bool binary_ = false, big_endian_ = false;
};

}  // namespace ccslice
