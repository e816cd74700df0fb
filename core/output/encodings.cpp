// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/output/encodings.h"

#include <algorithm>
#include <array>

#include "core/output/image_file.h"
#include "core/output/polling.h"

namespace ccslice {
namespace {

using Bytes = EncodingTraits::Bytes;

constexpr EncodingLimit kNoMaterials = {0,
                                        "materials are numbers with colours; ask for PNG, RGBA PNG, raw or raw zstd"};

constexpr EncodingLimit kOneWithAlpha = {1, "one channel has alpha; ask for EXR or raw zstd, or for a plane each"};

Bytes copy(PlaneCodecs&, const SampleImage& image, const CancellationToken& cancel) {
  Bytes copied;
  copied.reserve(image.samples.size());
  for (std::span<const std::uint8_t> rest = image.samples; !rest.empty();) {
    cancel.throw_if_cancelled();
    const std::size_t piece = std::min(rest.size(), kBytesPerPoll);
    copied.insert(copied.end(), rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(piece));
    rest = rest.subspan(piece);
  }
  return copied;
}

Bytes compress(PlaneCodecs& codecs, const SampleImage& image, const CancellationToken& cancel) {
  return codecs.zstd.frame(image.samples, cancel);
}

Bytes grey_png(PlaneCodecs& codecs, const SampleImage& image, const CancellationToken& cancel) {
  return codecs.png.grey(image, cancel);
}

Bytes grey_alpha_png(PlaneCodecs& codecs, const SampleImage& image, const CancellationToken& cancel) {
  return codecs.png.grey_alpha(image, cancel);
}

Bytes bitmap_png(PlaneCodecs& codecs, const SampleImage& image, const CancellationToken& cancel) {
  return codecs.png.bitmap(image, cancel);
}

Bytes indexed_png(PlaneCodecs& codecs, const IndexImage& image, const SampleImage& packed,
                  const CancellationToken& cancel) {
  return codecs.png.indexed(packed, image.palette, cancel);
}

Bytes rgba_png(PlaneCodecs& codecs, const IndexImage& image, const SampleImage&, const CancellationToken& cancel) {
  return codecs.png.rgba(image, cancel);
}

/// Occupancies are the same inside.
Bytes runs(PlaneCodecs& codecs, const SampleImage& image, const CancellationToken& cancel) {
  const RunsCoding coding = image.type == SampleType::kBit ? RunsCoding::kConstant : coding_of(image.type);
  return codecs.runs.frame(image, coding, codecs.zstd, cancel);
}

Bytes packed_runs(PlaneCodecs& codecs, const SampleImage& image, const CancellationToken& cancel) {
  return codecs.runs.frame(image, RunsCoding::kPacked, codecs.zstd, cancel);
}

/// For encodings that don't care what the samples mean.
template <EncodingTraits::Samples& encode>
Bytes packed(PlaneCodecs& codecs, const IndexImage&, const SampleImage& samples, const CancellationToken& cancel) {
  return encode(codecs, samples, cancel);
}

template <Encoding format>
Bytes image_file(PlaneCodecs&, const SampleImage& image, const CancellationToken& cancel) {
  return encode_image_file(format, image, cancel);
}

bool all_types(SampleType) noexcept { return true; }
bool integers(SampleType type) noexcept { return type != SampleType::kFloat32; }
bool floats(SampleType type) noexcept { return type == SampleType::kFloat32; }
bool no_type(SampleType) noexcept { return false; }
bool whole_bytes(SampleType type) noexcept { return type == SampleType::kUint8 || type == SampleType::kUint16; }
bool channel_types(SampleType type) noexcept { return whole_bytes(type) || floats(type); }

bool always() noexcept { return true; }

constexpr std::array kEncodings = {
    EncodingTraits{.encoding = Encoding::kRaw,
                   .name = "RAW",
                   .compressed = false,
                   .takes = all_types,
                   .is_built = always,
                   .encode_samples = copy,
                   .encode_mask = copy,
                   .encode_indices = packed<copy>},
    EncodingTraits{.encoding = Encoding::kRawZstd,
                   .name = "RAW_ZSTD",
                   .takes = all_types,
                   .is_built = always,
                   .encode_samples = compress,
                   .encode_mask = compress,
                   .encode_indices = packed<compress>},
    EncodingTraits{.encoding = Encoding::kPng,
                   .name = "PNG",
                   .widens_bits = true,
                   .takes_window = true,
                   .takes = integers,
                   .type_remedy = "PNG holds no floats; ask for raw zstd, TIFF or EXR, or for UINT16",
                   .is_built = always,
                   .encode_samples = grey_png,
                   .encode_mask = bitmap_png,
                   .encode_indices = indexed_png},
    EncodingTraits{.encoding = Encoding::kPngRgba,
                   .name = "PNG_RGBA",
                   .takes_window = true,
                   .takes = no_type,
                   .type_remedy = "RGBA pictures are of materials only; ask for PNG",
                   .materials = {PngEncoder::kMostRgbaColours - 1,  // One is the background's.
                                 "too many materials for RGBA pictures; ask for PNG"},
                   .is_built = always,
                   .encode_indices = rgba_png},
    EncodingTraits{.encoding = Encoding::kTiff,
                   .name = "TIFF",
                   .takes = all_types,
                   .channels = {1, "TIFF has no names for several channels; ask for EXR or raw zstd"},
                   .materials = kNoMaterials,
                   .is_built = image_files_available,
                   .encode_samples = image_file<Encoding::kTiff>,
                   .encode_mask = image_file<Encoding::kTiff>},
    EncodingTraits{.encoding = Encoding::kExr,
                   .name = "EXR",
                   .takes = floats,
                   .type_remedy = "EXR holds floats only; ask for FLOAT32, or for PNG or TIFF",
                   .materials = kNoMaterials,
                   .is_built = image_files_available,
                   .encode_samples = image_file<Encoding::kExr>},
    EncodingTraits{.encoding = Encoding::kPngAlpha,
                   .name = "PNG_ALPHA",
                   .has_alpha = true,
                   .takes_window = true,
                   .takes = whole_bytes,
                   .type_remedy = "PNG has alpha for channels of UINT8 and UINT16; ask for those, for PNG without, or "
                                  "for TIFF_ALPHA",
                   .channels = kOneWithAlpha,
                   .materials = kNoMaterials,
                   .is_built = always,
                   .encode_samples = grey_alpha_png},
    EncodingTraits{.encoding = Encoding::kTiffAlpha,
                   .name = "TIFF_ALPHA",
                   .has_alpha = true,
                   .takes = channel_types,
                   .type_remedy = "TIFF has alpha for channels; ask for TIFF without",
                   .channels = kOneWithAlpha,
                   .materials = kNoMaterials,
                   .is_built = image_files_available,
                   .encode_samples = image_file<Encoding::kTiffAlpha>},
    EncodingTraits{.encoding = Encoding::kRunsZstd,
                   .name = "RUNS_ZSTD",
                   .takes_window = true,
                   .takes = all_types,
                   .is_built = always,
                   .encode_samples = runs,
                   .encode_mask = packed_runs,
                   .encode_indices = packed<packed_runs>},
};

}  // namespace

std::span<const EncodingTraits> encodings() noexcept { return kEncodings; }

const EncodingTraits* find_encoding(Encoding encoding) noexcept {
  const auto found = std::ranges::find(kEncodings, encoding, &EncodingTraits::encoding);
  return found == kEncodings.end() ? nullptr : &*found;
}

}  // namespace ccslice
