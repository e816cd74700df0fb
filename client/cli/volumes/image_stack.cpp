// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/volumes/image_stack.h"

#include <png.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <new>

#include "core/base/echo.h"
#include "core/base/error.h"
#include "core/volume_files/raw_samples.h"

namespace ccslice::cli {
namespace {

[[noreturn]] void refuse(ErrorCode code, const std::string& path, const std::string& what) {
  throw Error(code, echoed(path) + ": " + what);
}

struct CloseFile {
  void operator()(std::FILE* file) const noexcept { std::fclose(file); }
};

/// A fault that libpng reports. It is thrown through libpng, which Debian compiles with unwind tables.
struct PngFault {
  std::string text;
};

/// A PNG file whose header has been read.
class PngReader {
 public:
  explicit PngReader(const std::string& path) : file_(std::fopen(path.c_str(), "rb")) {
    if (!file_) refuse(ErrorCode::kFileUnreadable, path, "can't be opened");
    png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, &fail, &ignore);
    if (png_ != nullptr) info_ = png_create_info_struct(png_);
    if (info_ != nullptr) return;
    png_destroy_read_struct(&png_, nullptr, nullptr);
    throw std::bad_alloc();
  }
  ~PngReader() { png_destroy_read_struct(&png_, &info_, nullptr); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;

  void read_header() {
    png_init_io(png_, file_.get());
    png_read_info(png_, info_);
    png_set_expand(png_);  // Palettes to colours, fewer bits to 8, transparency to alpha.
    png_set_swap(png_);    // Little-endian.
    (void)png_set_interlace_handling(png_);
    png_read_update_info(png_, info_);
  }
  VolumeShape shape() const {
    return {.samples = {png_get_image_width(png_, info_), png_get_image_height(png_, info_), 1},
            .channels = png_get_channels(png_, info_),
            .type = png_get_bit_depth(png_, info_) == 16 ? VolumeSampleType::kUint16 : VolumeSampleType::kUint8};
  }
  /// REQUIRES: room for shape().bytes().
  void read_rows(std::byte* to) {
    const VolumeShape shape = this->shape();
    const std::size_t row_bytes = shape.bytes() / shape.samples[1];
    std::vector<png_bytep> rows;
    for (std::uint32_t row = 0; row < shape.samples[1]; ++row) {
      rows.push_back(reinterpret_cast<png_bytep>(to + row * row_bytes));
    }
    png_read_image(png_, rows.data());
  }

 private:
  [[noreturn]] static void fail(png_structp, png_const_charp text) { throw PngFault{text}; }
  static void ignore(png_structp, png_const_charp) {}

  std::unique_ptr<std::FILE, CloseFile> file_;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
};

std::string text_of(const VolumeShape& shape) {
  return std::to_string(shape.samples[0]) + " x " + std::to_string(shape.samples[1]) + " pixels of " +
         std::to_string(shape.channels) + " x " + std::to_string(8 * bytes_of(shape.type)) + " bits";
}

void add_picture(const std::string& path, std::size_t pictures, VolumeFile& file) {
  PngReader png(path);
  png.read_header();
  const VolumeShape shape = png.shape();
  if (file.samples.empty()) file.shape = shape;
  VolumeShape first = file.shape;
  first.samples[2] = 1;
  if (!(shape == first)) {
    refuse(ErrorCode::kFileSyntax, path,
           text_of(shape) + ", and the first picture is " + text_of(first) + "; give pictures of one kind");
  }
  const std::uint64_t bytes = shape.bytes();
  if (bytes > kMostVolumeBytes / pictures) {
    refuse(ErrorCode::kMeshTooLarge, path,
           std::to_string(pictures) + " pictures of its size take more than " + std::to_string(kMostVolumeBytes >> 30) +
               " GiB; crop or scale them");
  }
  const std::size_t before = file.samples.size();
  file.samples.resize(before + bytes);
  png.read_rows(file.samples.data() + before);
  file.shape.samples[2] = static_cast<std::uint32_t>(file.samples.size() / bytes);
}

}  // namespace

VolumeFile read_image_stack(const std::vector<std::string>& paths) {
  VolumeFile file;
  for (const std::string& path : paths) {
    try {
      add_picture(path, paths.size(), file);
    } catch (const PngFault& fault) {
      refuse(ErrorCode::kFileSyntax, path, "not a PNG picture that can be read: " + echoed(fault.text));
    }
  }
  return file;
}

}  // namespace ccslice::cli
