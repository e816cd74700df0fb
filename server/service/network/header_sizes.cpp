// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/network/header_sizes.h"

#include <algorithm>
#include <array>

namespace ccslice::server {
namespace {

constexpr std::size_t kTableBytes = 4096, kEntryBytes = 32;           // RFC 7541, 4.1; RFC 9113, 6.5.2.
constexpr std::size_t kStaticEntries = 61;                            // RFC 7541, appendix A,
constexpr std::size_t kStaticNameBytes = 32, kStaticValueBytes = 16;  // none of which has more.
// How many letters have a code of so many bits (RFC 7541, appendix B), and the first of these codes.
constexpr std::array<std::uint32_t, 31> kLetters = {0, 0, 0, 0, 0, 10, 26, 32, 6,  0, 5,  3,  2,  6, 2, 3,
                                                    0, 0, 0, 3, 8, 13, 26, 29, 12, 4, 15, 19, 29, 0, 4};
constexpr std::array<std::uint32_t, 31> kFirstCodes = [] {
  std::array<std::uint32_t, 31> codes{};
  for (std::size_t bits = 1; bits < codes.size(); ++bits) codes[bits] = (codes[bits - 1] + kLetters[bits - 1]) << 1;
  return codes;
}();
constexpr unsigned int kMostShift = 21;  // Four more bytes say any number that may be.

}  // namespace

HeaderSizes::HeaderSizes() : table_bytes_(kTableBytes) {}

bool HeaderSizes::take(std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    if (skipped_ == 0) {
      if (!take_byte(bytes.front())) return false;
      bytes = bytes.subspan(1);
      continue;
    }
    const std::size_t some = std::min(skipped_, bytes.size());
    skipped_ -= some;
    if (is_huffman_) count_letters(bytes.first(some));
    bytes = bytes.subspan(some);
    if (skipped_ == 0 && !end_text()) return false;
  }
  return true;
}

bool HeaderSizes::take_byte(std::uint8_t byte) {
  if (in_number_) {
    if (shift_ > kMostShift) return false;
    number_ += static_cast<std::uint32_t>(byte & 0x7f) << shift_;
    shift_ += 7;
    in_number_ = (byte & 0x80) != 0;
    return in_number_ || end_number();
  }
  if (part_ == Part::kBegin) return begin_header(byte);
  is_huffman_ = (byte & 0x80) != 0;
  return begin_number(part_, byte, 0x7f);
}

bool HeaderSizes::begin_header(std::uint8_t byte) {
  if ((byte & 0x80) != 0) return begin_number(Part::kIndex, byte, 0x7f);
  is_added_ = (byte & 0x40) != 0;
  if (is_added_) return begin_number(Part::kNameIndex, byte, 0x3f);
  if ((byte & 0x20) != 0) return begin_number(Part::kTableSize, byte, 0x1f);
  return begin_number(Part::kNameIndex, byte, 0x0f);
}

bool HeaderSizes::begin_number(Part part, std::uint8_t byte, std::uint8_t mask) {
  part_ = part;
  number_ = byte & mask;
  shift_ = 0;
  in_number_ = number_ == mask;
  return in_number_ || end_number();
}

bool HeaderSizes::end_number() {
  switch (part_) {
    case Part::kTableSize:
      if (number_ > kTableBytes) return false;
      table_bytes_ = number_;
      shrink_to(table_bytes_);
      part_ = Part::kBegin;
      return true;
    case Part::kIndex: part_ = Part::kBegin; return number_ > 0 && count(entry_at(number_));
    case Part::kNameIndex:
      part_ = number_ == 0 ? Part::kNameLength : Part::kValueLength;
      header_ = {.name_bytes = number_ == 0 ? 0 : entry_at(number_).name_bytes};
      return true;
    default: return begin_text();
  }
}

bool HeaderSizes::begin_text() {
  const bool is_name = part_ == Part::kNameLength;
  if (number_ > kMostBytes) return false;
  (is_name ? header_.name_bytes : header_.value_bytes) = is_huffman_ ? 0 : number_;
  code_ = 0;
  code_bits_ = 0;
  part_ = is_name ? Part::kName : Part::kValue;
  skipped_ = number_;
  return skipped_ > 0 || end_text();
}

void HeaderSizes::count_letters(std::span<const std::uint8_t> bytes) {
  std::size_t& letters = part_ == Part::kName ? header_.name_bytes : header_.value_bytes;
  for (const std::uint8_t byte : bytes) {
    for (int shift = 7; shift >= 0; --shift) {
      code_ = code_ << 1 | (byte >> shift & 1u);
      ++code_bits_;
      if (code_ - kFirstCodes[code_bits_] >= kLetters[code_bits_]) continue;
      ++letters;
      code_ = 0;
      code_bits_ = 0;
    }
  }
}

bool HeaderSizes::end_text() {
  if (part_ == Part::kName) {
    part_ = Part::kValueLength;
    return true;
  }
  part_ = Part::kBegin;
  if (is_added_) add(header_);
  return count(header_);
}

bool HeaderSizes::count(const Entry& header) {
  list_bytes_ += header.name_bytes + header.value_bytes + kHeaderBytes;
  return list_bytes_ <= kMostBytes;
}

/// One that is too large for the table empties it (RFC 7541, 4.4), and fills it here in case gRPC counts it as less.
void HeaderSizes::add(Entry header) {
  std::size_t bytes = header.name_bytes + header.value_bytes + kEntryBytes;
  if (bytes > table_bytes_) {
    shrink_to(0);
    if (table_bytes_ < kEntryBytes) return;
    header = {.name_bytes = table_bytes_ - kEntryBytes};
    bytes = table_bytes_;
  }
  shrink_to(table_bytes_ - bytes);
  entries_.push_back(header);
  entry_bytes_ += bytes;
}

void HeaderSizes::shrink_to(std::size_t bytes) {
  auto kept = entries_.begin();
  for (; entry_bytes_ > bytes; ++kept) entry_bytes_ -= kept->name_bytes + kept->value_bytes + kEntryBytes;
  entries_.erase(entries_.begin(), kept);
}

HeaderSizes::Entry HeaderSizes::entry_at(std::size_t index) const {
  if (index <= kStaticEntries) return {kStaticNameBytes, kStaticValueBytes};
  const std::size_t age = index - kStaticEntries;
  if (age <= entries_.size()) return entries_[entries_.size() - age];
  return {.name_bytes = kTableBytes - kEntryBytes};
}

}  // namespace ccslice::server
