// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The only source file that includes OpenImageIO: the library drags in hundreds of others.

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <string>

#include "core/base/error.h"
#include "core/output/png.h"

namespace ccslice {
namespace {

constexpr int kPngFilterNone = 8;  // libpng's PNG_FILTER_NONE.
constexpr std::uint64_t kBandBytes = 1 << 20;

// OpenImageIO would otherwise start a thread pool of its own; layers are what runs in parallel here.
void keep_openimageio_serial() {
  static const bool done = OIIO::attribute("threads", 1);
  (void)done;
}

OIIO::ImageSpec grey_spec(std::uint32_t width, std::uint32_t height, OIIO::TypeDesc type) {
  OIIO::ImageSpec spec(static_cast<int>(width), static_cast<int>(height), 1, type);
  spec.attribute("png:compressionLevel", 1);
  spec.attribute("png:filter", kPngFilterNone);
  spec.attribute("oiio:UnassociatedAlpha", 1);  // Samples are written as they are, never premultiplied or divided.
  return spec;
}

[[noreturn]] void fail(const std::string& what) {
  throw Error(ErrorCode::kInternal, "OpenImageIO can't write a PNG: " + what);
}

}  // namespace

bool png_available() noexcept { return true; }

std::vector<std::uint8_t> encode_grey_png(std::uint32_t width, std::uint32_t height, int bytes_per_sample,
                                          std::span<const std::uint8_t> samples, const CancellationToken& cancel) {
  keep_openimageio_serial();
  const OIIO::TypeDesc type = bytes_per_sample == 1 ? OIIO::TypeDesc::UINT8 : OIIO::TypeDesc::UINT16;
  std::vector<std::uint8_t> file;
  OIIO::Filesystem::IOVecOutput sink(file);
  const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create("png");
  if (!output) fail(OIIO::geterror());
  if (!output->set_ioproxy(&sink)) fail(output->geterror());
  if (!output->open("layer.png", grey_spec(width, height, type))) fail(output->geterror());

  const std::uint64_t row_bytes = std::uint64_t{width} * bytes_per_sample;
  const auto band_rows = static_cast<std::uint32_t>(std::max<std::uint64_t>(1, kBandBytes / row_bytes));
  for (std::uint32_t y = 0; y < height;) {
    cancel.throw_if_cancelled();
    const std::uint32_t y_end = y + std::min(band_rows, height - y);
    const bool written =
        output->write_scanlines(static_cast<int>(y), static_cast<int>(y_end), 0, type, samples.data() + row_bytes * y);
    if (!written) fail(output->geterror());
    y = y_end;
  }
  if (!output->close()) fail(output->geterror());
  return file;
}

}  // namespace ccslice
