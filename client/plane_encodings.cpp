// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/plane_encodings.h"

#include <zstd.h>

#include <algorithm>
#include <array>

#include "client/client_error.h"
#include "client/runs_frame.h"

namespace ccslice::client {
namespace {

/// `most`: bytes of its content.
std::string inflate(const std::string& frame, std::uint64_t most) {
  constexpr std::uint64_t kMostOfAByte = 1 << 15;  // A block makes 128 KiB at most, and has four bytes at least.
  const auto announced = ZSTD_getFrameContentSize(frame.data(), frame.size());
  if (announced == ZSTD_CONTENTSIZE_ERROR) answer_corrupt("a plane isn't a zstd frame");
  const std::uint64_t bytes = announced == ZSTD_CONTENTSIZE_UNKNOWN ? most : announced;
  if (bytes > most || bytes > kMostOfAByte * frame.size()) {
    answer_corrupt("a zstd plane doesn't hold what its grid has, " + std::to_string(most) + " bytes at most");
  }
  std::string content(bytes, '\0');
  const std::size_t size = ZSTD_decompress(content.data(), content.size(), frame.data(), frame.size());
  if (ZSTD_isError(size)) answer_corrupt(std::string("a zstd plane can't be decoded: ") + ZSTD_getErrorName(size));
  content.resize(size);
  return content;
}

std::string samples_of_frame(const std::string& frame, const v1::PlaneSpec&, const v1::GridExtent&,
                             std::uint64_t bytes) {
  return inflate(frame, bytes);
}

std::string samples_of_runs(const std::string& frame, const v1::PlaneSpec& spec, const v1::GridExtent& extent,
                            std::uint64_t bytes) {
  return expand_runs(spec, extent, inflate(frame, most_runs_bytes(extent, bytes)), bytes);
}

std::string copy(const std::string& samples, const v1::PlaneSpec&, const v1::GridExtent&, std::uint64_t) {
  return samples;
}

void check_png(const std::string& bytes) {
  constexpr std::string_view kSignature("\x89PNG\r\n\x1a\n", 8);
  constexpr std::string_view kEnd("\0\0\0\0IEND\xae\x42\x60\x82", 12);
  const std::string_view view(bytes);
  const bool whole = view.size() > kSignature.size() + kEnd.size() && view.substr(0, kSignature.size()) == kSignature &&
                     view.substr(view.size() - kEnd.size()) == kEnd;
  if (!whole) answer_corrupt("a PNG plane is not a whole PNG file");
}

void check_tiff(const std::string& bytes) {
  if (!bytes.starts_with(std::string_view("II*\0", 4))) answer_corrupt("a plane isn't a TIFF file");
}

void check_exr(const std::string& bytes) {
  if (!bytes.starts_with("\x76\x2f\x31\x01")) answer_corrupt("a plane isn't an OpenEXR file");
}

bool has_floats(const v1::PlaneSpec& plane) { return plane.sample_type() == v1::SAMPLE_TYPE_FLOAT32; }

std::string_view png_objection(const v1::PlaneSpec& plane) {
  return has_floats(plane) ? "PNG has no floating point samples; take u8, u16, or --encoding tiff, exr or zstd" : "";
}

std::string_view tiff_objection(const v1::PlaneSpec& plane) {
  if (plane.has_materials()) return "TIFF shows no materials; take --encoding png, png-rgba or zstd";
  if (plane.has_cell_regions()) return "TIFF shows no cell regions; take --encoding png, png-rgba or zstd";
  return plane.has_channels() ? "TIFF has no names for all channels; take --encoding exr or zstd" : "";
}

std::string_view exr_objection(const v1::PlaneSpec& plane) {
  return has_floats(plane) ? "" : "EXR has floating point samples only; take f32, or --encoding png, tiff or auto";
}

constexpr std::array kEncodings = {
    PlaneEncoding{.value = v1::PLANE_ENCODING_PNG,
                  .name = "png",
                  .extension = ".png",
                  .objection = png_objection,
                  .widens = true,
                  .check = check_png},
    PlaneEncoding{.value = v1::PLANE_ENCODING_PNG_RGBA,
                  .name = "png_rgba",
                  .extension = ".png",
                  .note = "materials and cell regions in colour; png for others",
                  .only_materials = true,
                  .numbers_a_sample = 4,
                  .widens = true,
                  .check = check_png},
    PlaneEncoding{.value = v1::PLANE_ENCODING_TIFF,
                  .name = "tiff",
                  .extension = ".tif",
                  .objection = tiff_objection,
                  .widens = true,
                  .check = check_tiff},
    PlaneEncoding{.value = v1::PLANE_ENCODING_EXR,
                  .name = "exr",
                  .extension = ".exr",
                  .note = "floats only",
                  .objection = exr_objection,
                  .widens = true,
                  .check = check_exr},
    PlaneEncoding{.value = v1::PLANE_ENCODING_PNG_ALPHA,
                  .name = "png_alpha",
                  .extension = ".png",
                  .without_alpha = v1::PLANE_ENCODING_PNG,
                  .numbers_a_sample = 2,
                  .objection = png_objection,
                  .widens = true,
                  .check = check_png},
    PlaneEncoding{.value = v1::PLANE_ENCODING_TIFF_ALPHA,
                  .name = "tiff_alpha",
                  .extension = ".tif",
                  .without_alpha = v1::PLANE_ENCODING_TIFF,
                  .numbers_a_sample = 2,
                  .objection = tiff_objection,
                  .widens = true,
                  .check = check_tiff},
    PlaneEncoding{
        .value = v1::PLANE_ENCODING_RAW_ZSTD, .name = "zstd", .extension = ".zst", .decode = samples_of_frame},
    PlaneEncoding{.value = v1::PLANE_ENCODING_RUNS_ZSTD,
                  .name = "runs",
                  .extension = ".runs",
                  .note = "what is inside, in the fewest bytes",
                  .widens = true,
                  .decode = samples_of_runs},
    PlaneEncoding{.value = v1::PLANE_ENCODING_RAW, .name = "raw", .extension = ".bin", .decode = copy},
};

}  // namespace

std::span<const PlaneEncoding> plane_encodings() { return kEncodings; }

const PlaneEncoding* find_encoding(v1::PlaneEncoding value) {
  const auto found = std::ranges::find(kEncodings, value, &PlaneEncoding::value);
  return found == kEncodings.end() ? nullptr : &*found;
}

}  // namespace ccslice::client
