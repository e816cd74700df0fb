// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What lists of headers come to once they are unpacked (HPACK, RFC 7541), without unpacking them: a byte may stand for
// an entry of 4 KiB, and a list may go on over any number of frames.
//
// Only the sizes of the dynamic table's entries are kept. Letters in Huffman's code are counted and not decoded: the
// code is canonical (RFC 7541, appendix B), so it takes no more than how many letters have codes of each length. gRPC
// counts some entries as less, binary ones, and may keep them for longer: an index of an entry that isn't here counts
// as the largest one there may be.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace ccslice::server {

class HeaderSizes {
 public:
  /// For a list, with 256 bytes for each header: about what gRPC needs to keep one besides its text.
  static constexpr std::size_t kMostBytes = 16 << 10, kHeaderBytes = 256;

  HeaderSizes();

  void begin_list() { list_bytes_ = 0; }
  /// The list's next bytes, cut anywhere. False if they aren't HPACK, or the list comes to more than it may: nothing
  /// may be asked after that.
  [[nodiscard]] bool take(std::span<const std::uint8_t> bytes);
  /// A list mustn't end within a header.
  bool is_between_headers() const noexcept { return part_ == Part::kBegin; }

 private:
  /// What comes next.
  enum class Part { kBegin, kTableSize, kIndex, kNameIndex, kNameLength, kName, kValueLength, kValue };
  struct Entry {
    std::size_t name_bytes = 0, value_bytes = 0;
  };

  bool take_byte(std::uint8_t byte);
  bool begin_header(std::uint8_t byte);
  bool begin_number(Part part, std::uint8_t byte, std::uint8_t mask);
  bool end_number();
  bool begin_text();
  void count_letters(std::span<const std::uint8_t> bytes);
  bool end_text();
  bool count(const Entry& header);
  void add(Entry header);
  void shrink_to(std::size_t bytes);
  Entry entry_at(std::size_t index) const;

  Part part_ = Part::kBegin;
  bool in_number_ = false;  // Which takes more than one byte.
  unsigned int shift_ = 0;
  std::uint32_t number_ = 0;
  bool is_huffman_ = false;
  bool is_added_ = false;        // To the table.
  std::size_t skipped_ = 0;      // Of a text, still to come.
  std::uint32_t code_ = 0;       // Of a letter, as far as it has come,
  std::size_t code_bits_ = 0;    // that is, so many bits.
  Entry header_;                 // That is being read.
  std::vector<Entry> entries_;   // The newest one is the last.
  std::size_t entry_bytes_ = 0;  // Of all.
  std::size_t table_bytes_;      // What they may have.
  std::size_t list_bytes_ = 0;
};

}  // namespace ccslice::server
