// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The only source file that includes OpenImageIO: the library drags in hundreds of others.

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cstring>
#include <string>

#include "core/base/error.h"
#include "core/output/image_file.h"

namespace ccslice {
namespace {

constexpr std::uint64_t kBandBytes = 1 << 20;
constexpr std::uint32_t kStripRows =
    32;  // Rows of a TIFF strip; EXR blocks have 16. Bands are whole strips and blocks.

// OpenImageIO would otherwise start a thread pool of its own; layers are what runs in parallel here.
void keep_openimageio_serial() {
  static const bool done = OIIO::attribute("threads", 1);
  (void)done;
}

const char* name_of(Encoding format) {
  switch (format) {
    case Encoding::kTiff:
    case Encoding::kTiffAlpha: return "tiff";
    case Encoding::kExr: return "openexr";
    default: throw Error(ErrorCode::kInternal, "a picture file asked of an encoding that is none");
  }
}

// Bits are handed over as bytes, 0 or 255.
OIIO::TypeDesc type_of(SampleType type) {
  switch (type) {
    case SampleType::kBit:
    case SampleType::kUint8: return OIIO::TypeDesc::UINT8;
    case SampleType::kUint16: return OIIO::TypeDesc::UINT16;
    case SampleType::kUint2:
    case SampleType::kUint4:
    case SampleType::kFloat32: break;
  }
  return OIIO::TypeDesc::FLOAT;
}

OIIO::ImageSpec spec_of(Encoding format, const SampleImage& image) {
  const bool has_alpha = format == Encoding::kTiffAlpha;
  OIIO::ImageSpec spec(static_cast<int>(image.width), static_cast<int>(image.height),
                       has_alpha ? 2 : static_cast<int>(channel_count(image)), type_of(image.type));
  // Samples are written as they are: no channel is alpha for its name, and none is premultiplied or divided.
  spec.alpha_channel = has_alpha ? 1 : -1;
  spec.z_channel = -1;
  spec.attribute("oiio:UnassociatedAlpha", 1);
  spec.attribute("compression", "zip");
  // The writers stamp the time unless told one. TIFF drops a date that is no text; EXR takes an empty one.
  if (format == Encoding::kExr) {
    if (!image.channel_names.empty()) spec.channelnames = {image.channel_names.begin(), image.channel_names.end()};
    spec.attribute("DateTime", "");
    return spec;
  }
  spec.attribute("DateTime", 0);
  spec.attribute("tiff:zipquality", 1);
  spec.attribute("tiff:RowsPerStrip", static_cast<int>(kStripRows));
  if (image.type == SampleType::kBit) spec.attribute("oiio:BitsPerSample", 1);
  if (image.pitch.x_mm > 0 && image.pitch.y_mm > 0) {
    constexpr double kInchMm = 25.4;
    spec.attribute("ResolutionUnit", "in");
    spec.attribute("XResolution", static_cast<float>(kInchMm / image.pitch.x_mm));
    spec.attribute("YResolution", static_cast<float>(kInchMm / image.pitch.y_mm));
    // Without it, the writer takes the one for the other.
    spec.attribute("PixelAspectRatio", static_cast<float>(image.pitch.x_mm / image.pitch.y_mm));
  }
  return spec;
}

[[noreturn]] void fail(const std::string& what) {
  throw Error(ErrorCode::kInternal, "OpenImageIO can't write a picture: " + what);
}

void unpack_bits(const SampleImage& image, std::uint32_t y_begin, std::uint32_t y_end,
                 std::vector<std::uint8_t>& grey) {
  const std::size_t row_bytes = (std::size_t{image.width} + 7) / 8;
  grey.resize(std::size_t{image.width} * (y_end - y_begin));
  auto out = grey.begin();
  for (std::uint32_t y = y_begin; y < y_end; ++y) {
    const auto row = image.samples.subspan(y * row_bytes, row_bytes);
    for (std::size_t x = 0; x < image.width; ++x) *out++ = row[x / 8] >> (7 - x % 8) & 1 ? 255 : 0;
  }
}

// Each sample of some rows with its alpha behind it.
template <typename Sample>
void add_alpha(const SampleImage& image, Sample opaque, std::uint32_t y_begin, std::uint32_t y_end,
               std::vector<std::uint8_t>& out) {
  const std::size_t inside_bytes = image.inside.size() / image.height;
  out.resize(2 * sizeof(Sample) * image.width * (y_end - y_begin));
  std::uint8_t* to = out.data();
  const std::uint8_t* from = image.samples.data() + sizeof(Sample) * image.width * y_begin;
  for (std::uint32_t y = y_begin; y < y_end; ++y) {
    const std::uint8_t* inside = image.inside.data() + inside_bytes * y;
    for (std::size_t x = 0; x < image.width; ++x) {
      const Sample alpha = inside[x / 8] >> (7 - x % 8) & 1 ? opaque : Sample{0};
      std::memcpy(to, from, sizeof alpha);
      std::memcpy(to + sizeof alpha, &alpha, sizeof alpha);
      from += sizeof alpha;
      to += 2 * sizeof alpha;
    }
  }
}

void add_alpha(const SampleImage& image, std::uint32_t y_begin, std::uint32_t y_end, std::vector<std::uint8_t>& out) {
  switch (image.type) {
    case SampleType::kUint8: return add_alpha(image, std::uint8_t{255}, y_begin, y_end, out);
    case SampleType::kUint16: return add_alpha(image, std::uint16_t{65535}, y_begin, y_end, out);
    default: return add_alpha(image, 1.0f, y_begin, y_end, out);
  }
}

// Band by band, so that a cancel is noticed in between.
void write_rows(const SampleImage& image, bool has_alpha, OIIO::ImageOutput& output, const CancellationToken& cancel) {
  const OIIO::TypeDesc type = type_of(image.type);
  const std::uint64_t row_bytes = std::uint64_t{image.width} * channel_count(image) * type.size();
  const auto strips = static_cast<std::uint32_t>(std::max<std::uint64_t>(1, kBandBytes / (row_bytes * kStripRows)));
  const std::uint32_t band_rows = strips * kStripRows;
  std::vector<std::uint8_t> grey;
  for (std::uint32_t y = 0; y < image.height;) {
    cancel.throw_if_cancelled();
    const std::uint32_t y_end = y + std::min(band_rows, image.height - y);
    const std::uint8_t* rows = image.samples.data() + row_bytes * y;
    if (image.type == SampleType::kBit) {
      unpack_bits(image, y, y_end, grey);
      rows = grey.data();
    } else if (has_alpha) {
      add_alpha(image, y, y_end, grey);
      rows = grey.data();
    }
    if (!output.write_scanlines(static_cast<int>(y), static_cast<int>(y_end), 0, type, rows)) fail(output.geterror());
    y = y_end;
  }
}

}  // namespace

bool image_files_available() noexcept { return true; }

std::vector<std::uint8_t> encode_image_file(Encoding format, const SampleImage& image,
                                            const CancellationToken& cancel) {
  keep_openimageio_serial();
  std::vector<std::uint8_t> file;
  OIIO::Filesystem::IOVecOutput sink(file);
  const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(name_of(format));
  if (!output) fail(OIIO::geterror());
  if (!output->set_ioproxy(&sink)) fail(output->geterror());
  if (!output->open("layer", spec_of(format, image))) fail(output->geterror());
  write_rows(image, format == Encoding::kTiffAlpha, *output, cancel);
  if (!output->close()) fail(output->geterror());
  // A TIFF of one channel is complete here, yet leaves an error about Exif data that it hasn't got. Taking it keeps
  // OpenImageIO from reporting it.
  (void)output->geterror();
  return file;
}

}  // namespace ccslice
