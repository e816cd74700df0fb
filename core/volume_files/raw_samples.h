// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Numbers as files of volumes have them, turned into a volume's own types without loss where that can be.

#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/volume_files/volume_file.h"

namespace ccslice {

struct RawFormat {
  enum class Kind : std::uint8_t { kUnsigned, kSigned, kFloat };
  Kind kind = Kind::kUnsigned;
  std::uint8_t bytes = 1;  // 1, 2, 4 or 8; of floats 4 or 8.
  bool big_endian = false;
};

/// How samples follow each other in a file.
struct RawOrder {
  bool channels_last = false;  // All places of a channel come before those of the next one.
  bool k_fastest = false;      // Places come by k, then j, then i.
};

/// Bytes of the samples in a file. Throws Error{kVolumeInvalid, kMeshTooLarge} for shapes that can't be.
std::uint64_t raw_bytes(const VolumeShape& shape, RawFormat format);

/// The first `wanted` bytes. Throws Error{kFileSyntax} if there are fewer.
std::string_view whole_samples(std::string_view data, std::uint64_t wanted);

/// Sets file.shape.type and file.samples. Whole numbers of 32 and 64 bits take the smallest type that holds them all,
/// or else float; so do floats of 64 bits. A note says if that rounds. REQUIRES: file.shape has the rest; `bytes` are
/// raw_bytes().
void take_samples(std::string_view bytes, RawFormat format, RawOrder order, VolumeFile& file);
/// Takes samples that are written as text. Throws Error{kFileSyntax} if there are fewer than file.shape tells, and
/// like raw_bytes().
void take_text(std::string_view text, RawOrder order, VolumeFile& file);

}  // namespace ccslice
