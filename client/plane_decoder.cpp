// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/plane_decoder.h"

#include <libdeflate.h>

#include <algorithm>
#include <limits>
#include <string>

#include "client/client_error.h"
#include "client/plane_encodings.h"

namespace ccslice::client {
namespace {

const PlaneEncoding& encoding_of(const v1::PlaneSpec& spec) {
  const PlaneEncoding* const encoding = find_encoding(spec.encoding());
  if (encoding == nullptr) answer_corrupt("the server reports a plane without a known encoding");
  return *encoding;
}

}  // namespace

std::uint64_t sample_bytes(const v1::PlaneSpec& spec, const v1::GridExtent& extent) {
  const std::uint64_t columns =
      extent.columns() * std::uint64_t(spec.has_channels() ? spec.channels().names_size() : 1);
  const std::uint64_t rows = extent.rows();
  constexpr std::uint64_t kLargestSample = 4;
  if (rows > 0 && columns > std::numeric_limits<std::uint64_t>::max() / kLargestSample / rows) {
    answer_corrupt("the server reports a grid of more samples than there can be");
  }
  switch (spec.sample_type()) {
    case v1::SAMPLE_TYPE_BIT: return (columns + 7) / 8 * rows;
    case v1::SAMPLE_TYPE_UINT8: return columns * rows;
    case v1::SAMPLE_TYPE_UINT16: return 2 * columns * rows;
    case v1::SAMPLE_TYPE_FLOAT32: return 4 * columns * rows;
    case v1::SAMPLE_TYPE_UINT2: return (columns + 3) / 4 * rows;
    case v1::SAMPLE_TYPE_UINT4: return (columns + 1) / 2 * rows;
    default: answer_corrupt("the server reports a plane without a known sample type");
  }
}

void require_possible_size(const v1::PlaneSpec& spec, const v1::GridExtent& extent, std::uint64_t encoded_bytes) {
  // Rows and blocks have marks of their own, which weigh most in pictures of one column. Head, palette and names of
  // channels come once.
  constexpr std::uint64_t kMostForItself = 2, kHeadBytes = 256 << 10;
  const PlaneEncoding& encoding = encoding_of(spec);
  std::uint64_t content_bytes = sample_bytes(spec, extent);
  if (encoding.widens) {
    const std::uint64_t channels = spec.has_channels() ? std::uint64_t(spec.channels().names_size()) : 1;
    content_bytes = std::max(content_bytes, channels * extent.columns() * extent.rows());
  }
  if (encoded_bytes <= kHeadBytes) return;
  // 64 bits may not count the product.
  if ((encoded_bytes - kHeadBytes) / (kMostForItself * encoding.numbers_a_sample) < content_bytes) return;
  answer_corrupt("a plane of impossible size: " + std::to_string(encoded_bytes) + " bytes");
}

void decode_plane(const v1::GridExtent& extent, Plane& plane) {
  const std::uint64_t expected_bytes = sample_bytes(plane.spec, extent);
  if (plane.result.raw_bytes() != expected_bytes) {
    answer_corrupt("a plane is reported to have " + std::to_string(plane.result.raw_bytes()) +
                   " bytes of samples, its grid has " + std::to_string(expected_bytes));
  }
  const PlaneEncoding& encoding = encoding_of(plane.spec);
  if (encoding.check != nullptr) return encoding.check(plane.encoded);
  plane.samples = encoding.decode(plane.encoded, plane.spec, extent, expected_bytes);
  if (plane.samples.size() != expected_bytes) answer_corrupt("a plane has another size than its grid");
  if (libdeflate_crc32(0, plane.samples.data(), plane.samples.size()) != plane.result.crc32())
    answer_corrupt("the checksum of a plane is wrong");
}

}  // namespace ccslice::client
