// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The numbers of a legacy VTK file, ASCII or binary alike. In both the headers of sections and arrays are lines of
// text; in a binary file the numbers of an array follow its header's line as one block, big-endian, of the data type
// that the header names (bits eight to a byte). Arrays of VTK's XML files are read likewise, one to a scanner. Like the
// text scanner beneath it, it trusts no count.

#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/mesh_import/text_scanner.h"

namespace ccslice {

class VtkScanner {
 public:
  /// `text` must outlive the scanner.
  explicit VtkScanner(std::string_view text) : text_(text, TextScanner::Comments::kNone) {}

  /// For the headers.
  TextScanner& text() noexcept { return text_; }
  /// The file is a binary one: what follows names byte offsets.
  void set_binary() noexcept;
  bool binary() const noexcept { return binary_; }

  /// Opens an array once its header is taken. `type` is a VTK data type, e.g. "float" or "vtktypeint64", in any case;
  /// "long" has 8 bytes. Throws kFileUnsupported for types of binary arrays that aren't known.
  void open_array(std::string_view type);
  /// All bytes are one array of an XML file. REQUIRES: `type` is one of "Int8" to "UInt64", "Float32" and "Float64".
  void open_block(std::string_view type, bool big_endian);
  /// The bytes of a value of such a type; 0 if it isn't known.
  static std::size_t block_value_bytes(std::string_view type);
  /// Values of the array in their order; as TextScanner's in what they throw.
  double any_real(std::string_view expected);
  std::uint64_t count(std::string_view expected);
  /// Passes over a whole array of `values` numbers.
  void skip(std::uint64_t values, std::string_view expected);
  /// Passes over `values` strings of a binary file, each behind its length.
  void skip_binary_strings(std::uint64_t values);

 private:
  enum class Kind : std::uint8_t { kFloat, kSigned, kUnsigned, kBit };
  struct Type {
    std::string_view name;
    Kind kind;
    std::uint8_t size_bytes;
  };
  static const Type kTypes[], kBlockTypes[];

  /// The next value of a binary array, its bits in the low end.
  std::uint64_t next_bits(std::string_view expected);
  std::uint64_t next_packed_bit(std::string_view expected);
  double next_value(std::string_view expected);

  TextScanner text_;
  bool binary_ = false, big_endian_ = true;
  Type type_{"int", Kind::kSigned, 4};
  std::uint8_t bits_ = 0;       // The byte of an array of bits that is being read, its next bit on top.
  std::uint8_t bits_left_ = 0;  // How many of its bits are left.
};

}  // namespace ccslice
