// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output/tar.h"

#include <tar.h>

#include <cstddef>
#include <string_view>

namespace ccslice::cli {
namespace {

constexpr std::size_t kBlock = 512;

/// A header's fields by offset and length, as <tar.h> lists them.
struct Field {
  std::size_t at, length;
};
constexpr Field kName{0, 100}, kMode{100, 8}, kOwner{108, 8}, kGroup{116, 8}, kSize{124, 12}, kTime{136, 12},
    kChecksum{148, 8}, kType{156, 1}, kMagic{257, TMAGLEN}, kVersion{263, TVERSLEN};

void put_text(const Field& field, std::string_view text, std::string& header) {
  header.replace(field.at, text.size(), text);
}

/// Octal digits, with a NUL behind them.
void put_number(const Field& field, std::uint64_t number, std::string& header) {
  for (std::size_t i = field.length - 1; i-- > 0; number >>= 3) {
    header[field.at + i] = static_cast<char>('0' + (number & 7));
  }
}

}  // namespace

std::string tar_header(const std::string& name, std::uint64_t size) {
  std::string header(kBlock, '\0');
  put_text(kName, name, header);
  put_number(kMode, TUREAD | TUWRITE | TGREAD | TOREAD, header);
  put_number(kOwner, 0, header);
  put_number(kGroup, 0, header);
  put_number(kSize, size, header);
  put_number(kTime, 0, header);
  header[kType.at] = REGTYPE;
  put_text(kMagic, TMAGIC, header);
  put_text(kVersion, TVERSION, header);
  std::uint64_t sum = kChecksum.length * ' ';  // The checksum's own field counts as blanks.
  for (const char c : header) sum += static_cast<unsigned char>(c);
  put_number(kChecksum, sum, header);
  return header;
}

std::string tar_padding(std::uint64_t size) { return std::string((kBlock - size % kBlock) % kBlock, '\0'); }

std::string tar_end() { return std::string(2 * kBlock, '\0'); }

}  // namespace ccslice::cli
