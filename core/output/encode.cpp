// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/output/encode.h"

#include <libdeflate.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <string>

#include "core/base/error.h"
#include "core/output/encodings.h"
#include "core/output/pack_indices.h"
#include "core/output/polling.h"
#include "core/output/sample_rows.h"

namespace ccslice {
namespace {

static_assert(std::endian::native == std::endian::little, "samples are written in native order");

std::uint32_t crc32_by_pieces(std::span<const std::uint8_t> bytes, const CancellationToken& cancel) {
  std::uint32_t crc = libdeflate_crc32(0, nullptr, 0);
  while (!bytes.empty()) {
    cancel.throw_if_cancelled();
    const std::size_t piece = std::min(bytes.size(), kBytesPerPoll);
    crc = libdeflate_crc32(crc, bytes.data(), piece);
    bytes = bytes.subspan(piece);
  }
  return crc;
}

constexpr std::string_view kNotBuilt =
    "TIFF and EXR aren't built in (CCSLICE_WITH_OPENIMAGEIO=OFF); ask for PNG or raw zstd, or use a build with "
    "OpenImageIO";
constexpr std::string_view kUnknown = "unknown encoding; ask for raw, raw zstd, PNG, TIFF or EXR";

void refuse(const std::optional<std::string_view>& obstacle) {
  if (obstacle) throw Error(ErrorCode::kEncodingUnsupported, std::string(*obstacle), "encoding");
}

/// Goes on with so many equal rows: with 1, 2, 4 ... of them, as many as the number's bits say.
std::uint32_t crc32_of_rows(std::uint32_t crc, std::span<const std::uint8_t> row, std::uint32_t count) {
  std::uint32_t of_rows = libdeflate_crc32(0, row.data(), row.size());
  for (std::uint64_t bytes = row.size(); count > 0; count >>= 1, bytes *= 2) {
    const auto length = static_cast<z_off_t>(bytes);
    if (count & 1) crc = static_cast<std::uint32_t>(crc32_combine(crc, of_rows, length));
    of_rows = static_cast<std::uint32_t>(crc32_combine(of_rows, of_rows, length));
  }
  return crc;
}

/// The CRC-32 of the whole picture, of which there is a window.
std::uint32_t crc32_of_window(const SampleImage& image, const CancellationToken& cancel) {
  const LayerWindow window = image_window(image);
  SampleRows rows(image);
  std::uint32_t crc = crc32_of_rows(libdeflate_crc32(0, nullptr, 0), rows.outside(), window.first_row);
  for (std::uint32_t y = window.first_row; y < window.end_row(); ++y) {
    if (y % kRowsPerPoll == 0) cancel.throw_if_cancelled();
    const std::span<const std::uint8_t> row = rows(y);
    crc = libdeflate_crc32(crc, row.data(), row.size());
  }
  return crc32_of_rows(crc, rows.outside(), image.height - window.end_row());
}

/// `bytes_of`: makes the encoded bytes.
template <class BytesOf>
EncodedPlane checked_plane(const SampleImage& image, const CancellationToken& cancel, const BytesOf& bytes_of) {
  const std::uint32_t channels = channel_count(image);
  const LayerWindow window = image_window(image);
  EncodedPlane plane;
  plane.raw_bytes = sample_bytes(image.type, image.width, image.height, channels);
  if (image.samples.size() != sample_bytes(image.type, window.columns, window.rows, channels) || plane.raw_bytes == 0) {
    throw Error(ErrorCode::kInternal, "a plane's samples don't fit its size");
  }
  plane.crc32 = image.window ? crc32_of_window(image, cancel) : crc32_by_pieces(image.samples, cancel);
  plane.bytes = bytes_of();
  return plane;
}

SampleImage packed_image(const IndexImage& image, SampleType type, std::span<const std::uint8_t> packed) {
  return {.type = type,
          .width = image.width,
          .height = image.height,
          .samples = packed,
          .pitch = image.pitch,
          .spans = image.spans,
          .window = image.window};
}

}  // namespace

struct PlaneEncoder::State {
  PlaneCodecs codecs;
  std::vector<std::uint8_t> packed;
};

PlaneEncoder::PlaneEncoder() : state_(std::make_unique<State>()) {}
PlaneEncoder::~PlaneEncoder() = default;
PlaneEncoder::PlaneEncoder(PlaneEncoder&&) noexcept = default;
PlaneEncoder& PlaneEncoder::operator=(PlaneEncoder&&) noexcept = default;

std::optional<std::string_view> encoding_obstacle(SampleType type, Encoding encoding, std::uint32_t channels) {
  const EncodingTraits* traits = find_encoding(encoding);
  if (traits == nullptr) return kUnknown;
  if (!traits->takes(type)) return traits->type_remedy;
  if (channels > traits->channels.most) return traits->channels.remedy;
  if (!traits->is_built()) return kNotBuilt;
  return std::nullopt;
}

std::optional<std::string_view> index_encoding_obstacle(SampleType type, Encoding encoding, std::size_t materials) {
  const std::uint32_t bits = bits_per_index(type);
  if (bits == 0) return "materials are numbers of 1, 2, 4 or 8 bits; ask for BIT, UINT2, UINT4 or UINT8";
  if (materials >> bits != 0) return "too few bits for so many materials; leave it out for as many as it takes";
  const EncodingTraits* traits = find_encoding(encoding);
  if (traits == nullptr) return kUnknown;
  if (materials > traits->materials.most || traits->materials.most == 0) return traits->materials.remedy;
  return std::nullopt;
}

std::uint32_t crc32_of(std::span<const std::uint8_t> bytes) { return crc32_by_pieces(bytes, {}); }

EncodedPlane PlaneEncoder::encode(const SampleImage& image, Encoding encoding, const CancellationToken& cancel) {
  refuse(encoding_obstacle(image.type, encoding, channel_count(image)));
  if (find_encoding(encoding)->has_alpha &&
      image.inside.size() != sample_bytes(SampleType::kBit, image.width, image.height)) {
    throw Error(ErrorCode::kInternal, "a plane with alpha doesn't know what is inside");
  }
  return checked_plane(image, cancel,
                       [&] { return find_encoding(encoding)->encode_samples(state_->codecs, image, cancel); });
}

EncodedPlane PlaneEncoder::encode(const IndexImage& image, SampleType type, Encoding encoding,
                                  const CancellationToken& cancel) {
  refuse(index_encoding_obstacle(type, encoding, image.palette.size() - 1));
  require_known_materials(image);
  pack_indices(image, bits_per_index(type), state_->packed, cancel);
  const SampleImage packed = packed_image(image, type, state_->packed);
  return checked_plane(packed, cancel,
                       [&] { return find_encoding(encoding)->encode_indices(state_->codecs, image, packed, cancel); });
}

EncodedPlane PlaneEncoder::encode_mask(const IndexImage& image, MaterialSet materials, Encoding encoding,
                                       const CancellationToken& cancel) {
  refuse(encoding_obstacle(SampleType::kBit, encoding));
  pack_mask(image, materials, state_->packed, cancel);
  const SampleImage packed = packed_image(image, SampleType::kBit, state_->packed);
  return checked_plane(packed, cancel,
                       [&] { return find_encoding(encoding)->encode_mask(state_->codecs, packed, cancel); });
}

}  // namespace ccslice
