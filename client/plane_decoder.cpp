// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/plane_decoder.h"

#include <libdeflate.h>
#include <zstd.h>

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>

#include "client/client_error.h"

namespace ccslice::client {
namespace {

[[noreturn]] void corrupt(const std::string& message) {
  throw ClientError(grpc::StatusCode::DATA_LOSS, local_reason::kAnswerCorrupt, message);
}

std::string inflate_frame(const std::string& frame, std::uint64_t expected_bytes) {
  const auto announced = ZSTD_getFrameContentSize(frame.data(), frame.size());
  if (announced != ZSTD_CONTENTSIZE_UNKNOWN && announced != expected_bytes) {
    corrupt("a zstd plane doesn't hold the " + std::to_string(expected_bytes) + " bytes of its grid");
  }
  std::string samples(expected_bytes, '\0');
  const std::size_t size = ZSTD_decompress(samples.data(), samples.size(), frame.data(), frame.size());
  if (ZSTD_isError(size)) corrupt(std::string("a zstd plane can't be decoded: ") + ZSTD_getErrorName(size));
  if (size != expected_bytes) corrupt("a zstd plane is shorter than its grid");
  return samples;
}

void check_png(const std::string& bytes) {
  constexpr std::string_view kSignature("\x89PNG\r\n\x1a\n", 8);
  constexpr std::string_view kEnd("\0\0\0\0IEND\xae\x42\x60\x82", 12);
  const std::string_view view(bytes);
  const bool whole = view.size() > kSignature.size() + kEnd.size() && view.substr(0, kSignature.size()) == kSignature &&
                     view.substr(view.size() - kEnd.size()) == kEnd;
  if (!whole) corrupt("a PNG plane is not a whole PNG file");
}

void check_start(const std::string& bytes, std::string_view signature, const char* format) {
  if (!bytes.starts_with(signature)) corrupt("a plane is no " + std::string(format) + " file");
}

}  // namespace

std::uint64_t sample_bytes(const v1::PlaneSpec& spec, const v1::GridExtent& extent) {
  const std::uint64_t columns =
      extent.columns() * std::uint64_t(spec.has_channels() ? spec.channels().names_size() : 1);
  const std::uint64_t rows = extent.rows();
  switch (spec.sample_type()) {
    case v1::SAMPLE_TYPE_BIT: return (columns + 7) / 8 * rows;
    case v1::SAMPLE_TYPE_UINT8: return columns * rows;
    case v1::SAMPLE_TYPE_UINT16: return 2 * columns * rows;
    case v1::SAMPLE_TYPE_FLOAT32: return 4 * columns * rows;
    case v1::SAMPLE_TYPE_UINT2: return (columns + 3) / 4 * rows;
    case v1::SAMPLE_TYPE_UINT4: return (columns + 1) / 2 * rows;
    default: corrupt("the server reports a plane without a known sample type");
  }
}

void decode_plane(const v1::GridExtent& extent, Plane& plane) {
  const std::uint64_t expected_bytes = sample_bytes(plane.spec, extent);
  if (plane.result.raw_bytes() != expected_bytes) {
    corrupt("a plane is reported to have " + std::to_string(plane.result.raw_bytes()) +
            " bytes of samples, its grid has " + std::to_string(expected_bytes));
  }
  switch (plane.spec.encoding()) {
    case v1::PLANE_ENCODING_PNG:
    case v1::PLANE_ENCODING_PNG_RGBA: return check_png(plane.encoded);
    case v1::PLANE_ENCODING_TIFF: return check_start(plane.encoded, std::string_view("II*\0", 4), "TIFF");
    case v1::PLANE_ENCODING_EXR: return check_start(plane.encoded, "\x76\x2f\x31\x01", "OpenEXR");
    case v1::PLANE_ENCODING_RAW: plane.samples = plane.encoded; break;
    case v1::PLANE_ENCODING_RAW_ZSTD: plane.samples = inflate_frame(plane.encoded, expected_bytes); break;
    default: corrupt("the server reports a plane without a known encoding");
  }
  if (plane.samples.size() != expected_bytes) corrupt("a raw plane has another size than its grid");
  if (libdeflate_crc32(0, plane.samples.data(), plane.samples.size()) != plane.result.crc32())
    corrupt("the checksum of a plane is wrong");
}

}  // namespace ccslice::client
