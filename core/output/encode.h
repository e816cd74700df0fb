// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// From samples to the bytes that travel. Encoding is serial and deterministic: the same samples give the same bytes in
// every call, on every thread and on every replica of the same build. What encodings there are: encodings.h.

#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "core/base/cancellation.h"
#include "core/base/ids.h"
#include "core/output/plane.h"

namespace ccslice {

/// Why samples of this type can't be encoded so, and what to ask for instead; nothing if they can.
[[nodiscard]] std::optional<std::string_view> encoding_obstacle(SampleType type, Encoding encoding,
                                                                std::uint32_t channels = 1);

/// Why the numbers of so many materials can't be encoded so, and what to ask for instead; nothing if they can.
[[nodiscard]] std::optional<std::string_view> index_encoding_obstacle(SampleType type, Encoding encoding,
                                                                      std::size_t materials);

/// CRC-32 (IEEE 802.3, as in PNG and zlib).
std::uint32_t crc32_of(std::span<const std::uint8_t> bytes);

/// One thread's encoder: keeps codec state and scratch memory from plane to plane.
class PlaneEncoder {
 public:
  PlaneEncoder();
  ~PlaneEncoder();
  PlaneEncoder(PlaneEncoder&&) noexcept;
  PlaneEncoder& operator=(PlaneEncoder&&) noexcept;

  /// REQUIRES: image.samples.size() == sample_bytes(of image's type, size and channels), and that not 0.
  /// Throws Error{kEncodingUnsupported, kCancelled, kInternal}. Polls `cancel` every megabyte or so.
  [[nodiscard]] EncodedPlane encode(const SampleImage& image, Encoding encoding, const CancellationToken& cancel = {});
  /// The numbers of materials as samples of `type`. REQUIRES: indices.size() == width * height, not 0. Throws as above,
  /// kInternal for a number beyond the palette too: no file is made of colours that weren't asked for.
  [[nodiscard]] EncodedPlane encode(const IndexImage& image, SampleType type, Encoding encoding,
                                    const CancellationToken& cancel = {});
  /// Which voxels are of these materials, as kBit; 1 bit a voxel in PNG. REQUIRES and throws what the one above does.
  [[nodiscard]] EncodedPlane encode_mask(const IndexImage& image, MaterialSet materials, Encoding encoding,
                                         const CancellationToken& cancel = {});

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace ccslice
