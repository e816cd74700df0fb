// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/volume_files/read_npy.h"

#include <algorithm>
#include <vector>

#include "core/base/echo.h"
#include "core/base/error.h"
#include "core/mesh_import/byte_order.h"
#include "core/mesh_import/text_scanner.h"
#include "core/volume_files/header_lines.h"
#include "core/volume_files/raw_samples.h"

namespace ccslice {
namespace {

using Kind = RawFormat::Kind;

[[noreturn]] void malformed() {
  throw Error(ErrorCode::kFileSyntax, "the header isn't that of one array; write the file with numpy.save");
}

/// The text behind 'key': in the header's dictionary, up to its comma or parenthesis.
std::string_view value_of(std::string_view header, std::string_view key) {
  const std::size_t at = header.find("'" + std::string(key) + "':");
  if (at == std::string_view::npos) malformed();
  const std::string_view rest = trimmed(header.substr(at + key.size() + 3));
  const char end = rest.starts_with('(') ? ')' : ',';
  return trimmed(rest.substr(0, std::min(rest.find(end), rest.size())));
}

RawFormat numpy_format(std::string_view descr) {
  const auto refuse = [&]() {
    throw Error(ErrorCode::kFileUnsupported, "an array of " + echoed(std::string(descr)) +
                                                 " isn't read; save array.astype('float32'), or of whole numbers");
  };
  if (descr.size() < 2 || descr.front() != '\'' || descr.back() != '\'') refuse();
  const std::string_view name = descr.substr(1, descr.size() - 2);
  if (name.size() != 3 || std::string_view("<>|=").find(name[0]) == std::string_view::npos) refuse();
  RawFormat format{.big_endian = name[0] == '>'};
  switch (name[1]) {
    case 'b':
    case 'u': format.kind = Kind::kUnsigned; break;
    case 'i': format.kind = Kind::kSigned; break;
    case 'f': format.kind = Kind::kFloat; break;
    default: refuse();
  }
  const int bytes = name[2] - '0';
  const bool is_size = bytes == 1 || bytes == 2 || bytes == 4 || bytes == 8;
  if (!is_size || (format.kind == Kind::kFloat && bytes < 4)) refuse();
  format.bytes = static_cast<std::uint8_t>(bytes);
  return format;
}

std::vector<std::uint32_t> shape_of(std::string_view text) {
  if (!text.starts_with('(')) malformed();
  std::string numbers(text.substr(1));
  std::ranges::replace(numbers, ',', ' ');
  HeaderLines lines(text);
  (void)lines.next();  // The header is one line.
  return numbers.find_first_not_of(' ') == std::string::npos ? std::vector<std::uint32_t>{}
                                                             : counts_of(numbers, 0, lines);
}

}  // namespace

VolumeFile read_npy(std::string_view bytes, bool axes_are_xyz) {
  constexpr std::size_t kPreamble = 10;  // Magic, version, length.
  if (!bytes.starts_with("\x93NUMPY") || bytes.size() < kPreamble + 2) malformed();
  const bool is_first_version = bytes[6] == 1;
  const std::size_t length_bytes = is_first_version ? 2 : 4, header_at = 8 + length_bytes;
  const std::uint64_t header_bytes = little_endian(bytes.substr(8, length_bytes));
  if (bytes.size() < header_at || header_bytes > bytes.size() - header_at) malformed();
  const std::string_view header = bytes.substr(header_at, header_bytes);
  const RawFormat format = numpy_format(value_of(header, "descr"));
  const std::string_view order = value_of(header, "fortran_order");
  if (!order.starts_with("True") && !order.starts_with("False")) malformed();
  const bool is_fortran = order.starts_with("True");
  std::vector<std::uint32_t> shape = shape_of(value_of(header, "shape"));
  if (shape.size() < 2 || shape.size() > 4) {
    throw Error(ErrorCode::kFileUnsupported,
                "an array of " + std::to_string(shape.size()) + " axes; a volume has 2, 3, or 4 with channels");
  }
  VolumeFile file;
  const std::size_t axes = std::min<std::size_t>(shape.size(), 3);
  if (shape.size() == 4) file.shape.channels = shape[3];
  for (std::size_t axis = 0; axis < axes; ++axis) {
    file.shape.samples[axes_are_xyz ? axis : axes - 1 - axis] = shape[axis];
  }
  // In C's order the last axis is the fastest, and channels follow each other; in Fortran's the first one is.
  const RawOrder raw{.channels_last = is_fortran && shape.size() == 4, .k_fastest = is_fortran != axes_are_xyz};
  const std::uint64_t wanted = raw_bytes(file.shape, format);
  const std::string_view data = bytes.substr(header_at + header_bytes);
  take_samples(whole_samples(data, wanted), format, raw, file);
  return file;
}

}  // namespace ccslice
