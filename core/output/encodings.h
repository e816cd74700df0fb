// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The table of encodings: all that the rest of core and server ask of one. A new encoding is a value of Encoding
// (plane.h), a row of this table, a value of the contract and a row of the client's table.

#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string_view>
#include <vector>

#include "core/base/cancellation.h"
#include "core/output/plane.h"
#include "core/output/png.h"
#include "core/output/runs_frame.h"
#include "core/output/zstd_frame.h"

namespace ccslice {

/// One thread's codecs, with what they keep from plane to plane.
struct PlaneCodecs {
  ZstdEncoder zstd;
  PngEncoder png;
  RunsEncoder runs;
};

/// What an encoding takes at most, and what to ask for instead of more.
struct EncodingLimit {
  std::size_t most = std::numeric_limits<std::size_t>::max();
  std::string_view remedy = {};
};

struct EncodingTraits {
  using Bytes = std::vector<std::uint8_t>;
  using Samples = Bytes(PlaneCodecs& codecs, const SampleImage& image, const CancellationToken& cancel);
  /// `packed`: the same picture as samples.
  using Indices = Bytes(PlaneCodecs& codecs, const IndexImage& image, const SampleImage& packed,
                        const CancellationToken& cancel);

  Encoding encoding;
  std::string_view name;      // Of the contract's value, without PLANE_ENCODING_.
  bool compressed = true;     // Typical parts take fewer bytes than their samples.
  bool widens_bits = false;   // kBit takes 8 bits a voxel.
  bool has_alpha = false;     // Takes SampleImage::inside, and that of kChannel alone.
  bool takes_window = false;  // Of pictures, and doesn't need the samples outside.

  /// Samples of occupancies, masks and channels, and what to ask for instead of other types.
  bool (*takes)(SampleType type) noexcept;
  std::string_view type_remedy = {};
  EncodingLimit channels = {};   // Of one plane.
  EncodingLimit materials = {};  // Whose numbers a plane shows.
  bool (*is_built)() noexcept;   // Into this program.

  Samples* encode_samples = nullptr;  // Of occupancies and channels. Null if it takes no type.
  Samples* encode_mask = nullptr;     // Of one material, as kBit. Null if it doesn't take that.
  Indices* encode_indices = nullptr;  // Of materials' numbers. Null if it takes no materials.
};

/// All of them, in the order in which messages name them.
std::span<const EncodingTraits> encodings() noexcept;

/// Null for a number that is no encoding.
[[nodiscard]] const EncodingTraits* find_encoding(Encoding encoding) noexcept;

}  // namespace ccslice
