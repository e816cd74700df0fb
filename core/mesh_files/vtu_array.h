// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The bytes of a binary array in VTK's XML files [VTK XML Formats]. As they are or in base64, behind a header of whole
// numbers:
//
//   uncompressed   the number of bytes
//   compressed     the numbers of blocks, of bytes in a block, of bytes in the last one if it is shorter (or 0), then
//                  of compressed bytes in each block, which is one of zlib's streams, of LZ4's blocks or of xz's files
//
// In base64 header and data are one text, or two with padding in the middle. The header may claim anything: it has to
// agree with the number of bytes that are expected, and memory is taken as data arrive.

#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/mesh_import/text_scanner.h"

namespace ccslice {

enum class VtuCompressor : std::uint8_t { kNone, kZlib, kLz4, kLzma, kUnknown };

struct VtuCoding {
  bool big_endian = false;
  std::uint8_t header_word_bytes = 4;
  VtuCompressor compressor = VtuCompressor::kNone;
};

/// REQUIRES: the compressor is known. `text` begins with the array, which is `expected_bytes` long when decoded; more
/// may follow. Failures are those of `place` at its mark.
std::string decode_vtu_array(std::string_view text, bool base64, const VtuCoding& coding, std::uint64_t expected_bytes,
                             const TextScanner& place);

}  // namespace ccslice
