// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/vtk_scanner.h"

#include <algorithm>
#include <bit>
#include <iterator>
#include <string>

#include "core/base/error.h"
#include "core/base/similar_name.h"
#include "core/mesh_import/byte_order.h"

namespace ccslice {
namespace {

/// The two's complement number in the low bytes.
std::int64_t sign_extended(std::uint64_t bits, unsigned size_bytes) {
  const unsigned unused = 64 - 8 * size_bytes;
  return static_cast<std::int64_t>(bits << unused) >> unused;
}

}  // namespace

constexpr VtkScanner::Type VtkScanner::kTypes[] = {
    {"float", Kind::kFloat, 4},
    {"double", Kind::kFloat, 8},
    {"int", Kind::kSigned, 4},
    {"unsigned_int", Kind::kUnsigned, 4},
    {"short", Kind::kSigned, 2},
    {"unsigned_short", Kind::kUnsigned, 2},
    {"char", Kind::kSigned, 1},
    {"signed_char", Kind::kSigned, 1},
    {"unsigned_char", Kind::kUnsigned, 1},
    {"long", Kind::kSigned, 8},
    {"unsigned_long", Kind::kUnsigned, 8},
    {"vtkIdType", Kind::kSigned, 4},
    {"vtktypeint64", Kind::kSigned, 8},
    {"vtktypeuint64", Kind::kUnsigned, 8},
    {"vtktypeint32", Kind::kSigned, 4},
    {"vtktypeuint32", Kind::kUnsigned, 4},
    {"vtktypeint16", Kind::kSigned, 2},
    {"vtktypeuint16", Kind::kUnsigned, 2},
    {"vtktypeint8", Kind::kSigned, 1},
    {"vtktypeuint8", Kind::kUnsigned, 1},
    {"bit", Kind::kBit, 1},
};

constexpr VtkScanner::Type VtkScanner::kBlockTypes[] = {
    {"Int8", Kind::kSigned, 1},     {"UInt8", Kind::kUnsigned, 1},  {"Int16", Kind::kSigned, 2},
    {"UInt16", Kind::kUnsigned, 2}, {"Int32", Kind::kSigned, 4},    {"UInt32", Kind::kUnsigned, 4},
    {"Int64", Kind::kSigned, 8},    {"UInt64", Kind::kUnsigned, 8}, {"Float32", Kind::kFloat, 4},
    {"Float64", Kind::kFloat, 8},
};

std::size_t VtkScanner::block_value_bytes(std::string_view type) {
  const Type* known = std::ranges::find(kBlockTypes, type, &Type::name);
  return known == std::end(kBlockTypes) ? 0 : known->size_bytes;
}

void VtkScanner::open_block(std::string_view type, bool big_endian) {
  binary_ = true;
  big_endian_ = big_endian;
  const Type* known = std::ranges::find(kBlockTypes, type, &Type::name);
  if (known != std::end(kBlockTypes)) type_ = *known;
}

void VtkScanner::set_binary() noexcept {
  binary_ = true;
  text_.name_byte_offsets();
}

void VtkScanner::open_array(std::string_view type) {
  if (!binary_) return;
  const Type* known = std::find_if(std::begin(kTypes), std::end(kTypes),
                                   [&](const Type& known) { return equals_ignoring_case(type, known.name); });
  if (known == std::end(kTypes)) {
    text_.fail_with(ErrorCode::kFileUnsupported,
                    "data type " + in_quotes(printable(type)) +
                        " is not known; arrays of int, float and double are read, and of other whole numbers");
  }
  type_ = *known;
  bits_left_ = 0;
  text_.end_line();
}

std::uint64_t VtkScanner::next_packed_bit(std::string_view expected) {
  if (bits_left_ == 0) {
    bits_ = static_cast<std::uint8_t>(text_.bytes(1, expected).front());
    bits_left_ = 8;
  }
  const std::uint64_t bit = bits_ >> 7;
  bits_ = static_cast<std::uint8_t>(bits_ << 1);
  --bits_left_;
  return bit;
}

std::uint64_t VtkScanner::next_bits(std::string_view expected) {
  if (type_.kind == Kind::kBit) return next_packed_bit(expected);
  const std::string_view bytes = text_.bytes(type_.size_bytes, expected);
  return number_in_bytes(bytes, big_endian_);
}

double VtkScanner::next_value(std::string_view expected) {
  const std::uint64_t bits = next_bits(expected);
  switch (type_.kind) {
    case Kind::kFloat:
      return type_.size_bytes == 8 ? std::bit_cast<double>(bits)
                                   : double{std::bit_cast<float>(static_cast<std::uint32_t>(bits))};
    case Kind::kSigned: return static_cast<double>(sign_extended(bits, type_.size_bytes));
    default: return static_cast<double>(bits);
  }
}

double VtkScanner::any_real(std::string_view expected) {
  return binary_ ? next_value(expected) : text_.any_real(expected);
}

std::uint64_t VtkScanner::count(std::string_view expected) {
  if (!binary_) return text_.count(expected);
  if (type_.kind == Kind::kFloat) text_.fail("integers", type_.name);
  const std::uint64_t bits = next_bits(expected);
  const bool negative = type_.kind == Kind::kSigned && sign_extended(bits, type_.size_bytes) < 0;
  if (negative || bits > (std::uint64_t{1} << 53)) {
    text_.fail(expected, negative ? std::to_string(sign_extended(bits, type_.size_bytes)) : std::to_string(bits));
  }
  return bits;
}

void VtkScanner::skip(std::uint64_t values, std::string_view expected) {
  if (!binary_) return text_.skip(values, expected);
  if (type_.kind == Kind::kBit) values = values / 8 + (values % 8 != 0);
  for (int i = 0; i < type_.size_bytes; ++i) text_.bytes(values, expected);
}

void VtkScanner::skip_binary_strings(std::uint64_t values) {
  text_.end_line();
  for (std::uint64_t i = 0; i < values; ++i) {
    // The two highest bits of a length say how many bytes it takes: 11 one, 10 two, 01 four, 00 eight.
    const auto first = static_cast<std::uint8_t>(text_.bytes(1, "a string").front());
    const std::uint64_t more_bytes = (std::uint64_t{1} << (3 - (first >> 6))) - 1;
    const std::uint64_t high = first & 0x3f;
    const std::uint64_t length = high << (8 * more_bytes) | big_endian(text_.bytes(more_bytes, "a string"));
    text_.bytes(length, "a string");
  }
}

}  // namespace ccslice
