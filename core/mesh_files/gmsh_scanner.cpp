// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/gmsh_scanner.h"

#include "core/mesh_import/byte_order.h"

#include <bit>

namespace ccslice {
namespace {

constexpr std::size_t kIntBytes = 4, kSizeBytes = 8;

}  // namespace

void GmshScanner::set_binary() {
  binary_ = true;
  text_.name_byte_offsets();
  text_.end_line();
  const std::uint64_t one = raw(kIntBytes, "the number 1");
  big_endian_ = one == 0x01000000;
  if (one != 1 && !big_endian_) text_.fail("the number 1 in four bytes", std::to_string(one));
}

void GmshScanner::open_section() {
  if (binary_) text_.end_line();
}

void GmshScanner::close_section(const std::string& name) {
  const std::string_view end = text_.next(in_quotes("$End" + name));
  if (end != "$End" + name) text_.fail(in_quotes("$End" + name), end);
}

std::uint64_t GmshScanner::integer(std::string_view expected) {
  return binary_ ? raw(kIntBytes, expected) : text_.count(expected);
}

std::int64_t GmshScanner::signed_integer(std::string_view expected) {
  return binary_ ? static_cast<std::int32_t>(raw(kIntBytes, expected)) : text_.integer(expected);
}

std::uint64_t GmshScanner::size(std::string_view expected) {
  return binary_ ? raw(kSizeBytes, expected) : text_.count(expected);
}

double GmshScanner::any_real(std::string_view expected) {
  return binary_ ? std::bit_cast<double>(raw(sizeof(double), expected)) : text_.any_real(expected);
}

void GmshScanner::skip_integer(std::string_view expected) {
  if (binary_) {
    (void)raw(kIntBytes, expected);
  } else {
    text_.skip(1, expected);
  }
}

std::uint64_t GmshScanner::raw(std::size_t size_bytes, std::string_view expected) {
  return number_in_bytes(text_.bytes(size_bytes, expected), big_endian_);
}

}  // namespace ccslice
