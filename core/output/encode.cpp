// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/output/encode.h"

#include <libdeflate.h>
#include <zstd.h>

#include <algorithm>
#include <bit>
#include <string>
#include <utility>

#include "core/base/error.h"
#include "core/output/image_file.h"
#include "core/output/pack_indices.h"
#include "core/output/png.h"

namespace ccslice {
namespace {

static_assert(std::endian::native == std::endian::little, "samples are written in native order");

constexpr int kZstdLevel = 1;
constexpr std::size_t kPieceBytes = 1 << 20;  // Cancellation is polled once a piece.

std::uint32_t crc32_by_pieces(std::span<const std::uint8_t> bytes, const CancellationToken& cancel) {
  std::uint32_t crc = libdeflate_crc32(0, nullptr, 0);
  while (!bytes.empty()) {
    cancel.throw_if_cancelled();
    const std::size_t piece = std::min(bytes.size(), kPieceBytes);
    crc = libdeflate_crc32(crc, bytes.data(), piece);
    bytes = bytes.subspan(piece);
  }
  return crc;
}

std::vector<std::uint8_t> copy_by_pieces(std::span<const std::uint8_t> bytes, const CancellationToken& cancel) {
  std::vector<std::uint8_t> copy;
  copy.reserve(bytes.size());
  while (!bytes.empty()) {
    cancel.throw_if_cancelled();
    const std::size_t piece = std::min(bytes.size(), kPieceBytes);
    copy.insert(copy.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(piece));
    bytes = bytes.subspan(piece);
  }
  return copy;
}

constexpr std::string_view kNotBuilt =
    "TIFF and EXR aren't built in (CCSLICE_WITH_OPENIMAGEIO=OFF); ask for PNG or raw zstd, or use a build with "
    "OpenImageIO";

}  // namespace

struct PlaneEncoder::State {
  struct FreeContext {
    void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
  };
  std::unique_ptr<ZSTD_CCtx, FreeContext> zstd;
  std::vector<std::uint8_t> scratch;
  std::vector<std::uint8_t> packed;
  PngEncoder png;

  static std::size_t checked(std::size_t zstd_result) {
    if (ZSTD_isError(zstd_result)) {
      throw Error(ErrorCode::kInternal, std::string("zstd failed: ") + ZSTD_getErrorName(zstd_result));
    }
    return zstd_result;
  }

  std::vector<std::uint8_t> compress(std::span<const std::uint8_t> samples, const CancellationToken& cancel) {
    if (!zstd) zstd.reset(ZSTD_createCCtx());
    if (!zstd) throw std::bad_alloc();
    checked(ZSTD_CCtx_reset(zstd.get(), ZSTD_reset_session_and_parameters));
    checked(ZSTD_CCtx_setParameter(zstd.get(), ZSTD_c_compressionLevel, kZstdLevel));
    checked(ZSTD_CCtx_setPledgedSrcSize(zstd.get(), samples.size()));
    scratch.resize(std::max(scratch.size(), ZSTD_compressBound(samples.size())));
    ZSTD_outBuffer out{scratch.data(), scratch.size(), 0};
    for (std::size_t begin = 0; begin < samples.size();) {
      cancel.throw_if_cancelled();
      const std::size_t piece = std::min(samples.size() - begin, kPieceBytes);
      ZSTD_inBuffer in{samples.data() + begin, piece, 0};
      begin += piece;
      const ZSTD_EndDirective directive = begin == samples.size() ? ZSTD_e_end : ZSTD_e_continue;
      const std::size_t left = checked(ZSTD_compressStream2(zstd.get(), &out, &in, directive));
      if (in.pos != in.size || (directive == ZSTD_e_end && left != 0)) {
        throw Error(ErrorCode::kInternal, "zstd wrote more than its bound");
      }
    }
    return {scratch.begin(), scratch.begin() + static_cast<std::ptrdiff_t>(out.pos)};
  }

  /// `picture`: makes the file of a picture encoding.
  template <class Picture>
  EncodedPlane encode(const SampleImage& image, Encoding encoding, const CancellationToken& cancel,
                      const Picture& picture) {
    const std::uint64_t fitting = sample_bytes(image.type, image.width, image.height, channel_count(image));
    if (image.samples.size() != fitting || image.samples.empty()) {
      throw Error(ErrorCode::kInternal, "a plane's samples don't fit its size");
    }
    EncodedPlane plane;
    plane.raw_bytes = image.samples.size();
    plane.crc32 = crc32_by_pieces(image.samples, cancel);
    switch (encoding) {
      case Encoding::kRaw: plane.bytes = copy_by_pieces(image.samples, cancel); break;
      case Encoding::kRawZstd: plane.bytes = compress(image.samples, cancel); break;
      default: plane.bytes = picture();
    }
    return plane;
  }
};

PlaneEncoder::PlaneEncoder() : state_(std::make_unique<State>()) {}
PlaneEncoder::~PlaneEncoder() = default;
PlaneEncoder::PlaneEncoder(PlaneEncoder&&) noexcept = default;
PlaneEncoder& PlaneEncoder::operator=(PlaneEncoder&&) noexcept = default;

std::uint64_t sample_bytes(SampleType type, std::uint32_t width, std::uint32_t height, std::uint32_t channels) {
  const std::uint64_t samples = std::uint64_t{width} * height * channels;
  switch (type) {
    case SampleType::kBit: return (std::uint64_t{width} + 7) / 8 * height * channels;
    case SampleType::kUint8: return samples;
    case SampleType::kUint16: return 2 * samples;
    case SampleType::kFloat32: return 4 * samples;
    case SampleType::kUint2: return (std::uint64_t{width} + 3) / 4 * height * channels;
    case SampleType::kUint4: return (std::uint64_t{width} + 1) / 2 * height * channels;
  }
  throw Error(ErrorCode::kInternal, "unknown sample type " + std::to_string(static_cast<int>(type)));
}

std::optional<std::string_view> encoding_obstacle(SampleType type, Encoding encoding, std::uint32_t channels) {
  switch (encoding) {
    case Encoding::kRaw:
    case Encoding::kRawZstd: return std::nullopt;
    case Encoding::kPng:
      if (type == SampleType::kFloat32) return "PNG holds no floats; ask for raw zstd, TIFF or EXR, or for UINT16";
      return std::nullopt;
    case Encoding::kPngRgba: return "RGBA pictures are of materials only; ask for PNG";
    case Encoding::kTiff:
      if (channels > 1) return "TIFF has no names for several channels; ask for EXR or raw zstd";
      break;
    case Encoding::kExr:
      if (type != SampleType::kFloat32) return "EXR holds floats only; ask for FLOAT32, or for PNG or TIFF";
      break;
    default: return "unknown encoding; ask for raw, raw zstd, PNG, TIFF or EXR";
  }
  if (!image_files_available()) return kNotBuilt;
  return std::nullopt;
}

std::optional<std::string_view> index_encoding_obstacle(SampleType type, Encoding encoding, std::size_t materials) {
  const std::uint32_t bits = bits_per_index(type);
  if (bits == 0) return "materials are numbers of 1, 2, 4 or 8 bits; ask for BIT, UINT2, UINT4 or UINT8";
  if (materials >> bits != 0) return "too few bits for so many materials; leave it out for as many as it takes";
  switch (encoding) {
    case Encoding::kTiff:
    case Encoding::kExr: return "materials are numbers with colours; ask for PNG, RGBA PNG, raw or raw zstd";
    case Encoding::kPngRgba:
      if (materials >= PngEncoder::kMostRgbaColours) return "too many materials for RGBA pictures; ask for PNG";
      break;
    default: break;
  }
  return std::nullopt;
}

std::uint32_t crc32_of(std::span<const std::uint8_t> bytes) { return crc32_by_pieces(bytes, {}); }

EncodedPlane PlaneEncoder::encode(const SampleImage& image, Encoding encoding, const CancellationToken& cancel) {
  if (const auto obstacle = encoding_obstacle(image.type, encoding, channel_count(image))) {
    throw Error(ErrorCode::kEncodingUnsupported, std::string(*obstacle), "encoding");
  }
  return state_->encode(image, encoding, cancel, [&] {
    return encoding == Encoding::kPng ? state_->png.grey(image, cancel) : encode_image_file(encoding, image, cancel);
  });
}

EncodedPlane PlaneEncoder::encode(const IndexImage& image, SampleType type, Encoding encoding,
                                  const CancellationToken& cancel) {
  if (const auto obstacle = index_encoding_obstacle(type, encoding, image.palette.size() - 1)) {
    throw Error(ErrorCode::kEncodingUnsupported, std::string(*obstacle), "encoding");
  }
  require_known_materials(image);
  pack_indices(image, bits_per_index(type), state_->packed, cancel);
  const SampleImage packed{type, image.width, image.height, state_->packed};
  return state_->encode(packed, encoding, cancel, [&] {
    return encoding == Encoding::kPng ? state_->png.indexed(packed, image.palette, cancel)
                                      : state_->png.rgba(image, cancel);
  });
}

EncodedPlane PlaneEncoder::encode_mask(const IndexImage& image, std::uint32_t material, Encoding encoding,
                                       const CancellationToken& cancel) {
  if (const auto obstacle = encoding_obstacle(SampleType::kBit, encoding)) {
    throw Error(ErrorCode::kEncodingUnsupported, std::string(*obstacle), "encoding");
  }
  pack_mask(image, material, state_->packed, cancel);
  const SampleImage packed{SampleType::kBit, image.width, image.height, state_->packed};
  return state_->encode(packed, encoding, cancel, [&] {
    return encoding == Encoding::kPng ? state_->png.bitmap(packed, cancel)
                                      : encode_image_file(encoding, packed, cancel);
  });
}

}  // namespace ccslice
