// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/output/png.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>

#include "core/output/encode.h"
#include "core/output/pack_indices.h"
#include "tests/core/output/tiny_png.h"

namespace ccslice {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr PixelPitch kPitch = {25.4 / 600, 25.4 / 300};  // As check_png_readers.py expects.
const std::vector<std::uint32_t> kPalette = {0x000000ff, 0x00ffffff, 0xff00ffff, 0xffff00ff, 0xffffffff,
                                             0x102030ff, 0x405060ff, 0x708090ff, 0xa0b0c0ff};

/// Dithered inside an ellipse.
Bytes halftoned(std::uint32_t width, std::uint32_t height, std::size_t materials) {
  std::mt19937 random(21);
  Bytes indices;
  for (std::uint32_t y = 0; y < height; ++y) {
    for (std::uint32_t x = 0; x < width; ++x) {
      const double u = 2.0 * x / width - 1, v = 2.0 * y / height - 1;
      indices.push_back(u * u + v * v > 0.9 ? 0 : static_cast<std::uint8_t>(1 + random() % materials));
    }
  }
  return indices;
}

struct Case {
  std::uint32_t width, height;
  std::size_t materials;
};

const Case kCases[] = {{1, 1, 1}, {3, 2, 2}, {61, 40, 1}, {975, 487, 3}, {33, 300, 8}, {8191, 9, 5}};

TEST(Png, RgbaShowsEachMaterialInItsColourAndNoOther) {
  for (const Case& c : kCases) {
    const Bytes indices = halftoned(c.width, c.height, c.materials);
    const std::span<const std::uint32_t> palette(kPalette.data(), c.materials + 1);
    const SampleType type = smallest_index_type(c.materials);
    const EncodedPlane plane = PlaneEncoder().encode({c.width, c.height, indices, palette}, type, Encoding::kPngRgba);
    const TinyPng png = read_tiny_png(plane.bytes);
    EXPECT_EQ(png.color_type, 6);
    EXPECT_EQ(png.bit_depth, 8);
    EXPECT_THAT(png.chunks, testing::ElementsAre("IHDR", "IDAT", "IEND"));
    ASSERT_EQ(png.samples.size(), 4 * indices.size());
    for (std::size_t i = 0; i < indices.size(); ++i) {
      std::uint32_t rgba = 0;
      for (std::size_t k = 0; k < 4; ++k) rgba = rgba << 8 | png.samples[4 * i + k];
      ASSERT_EQ(rgba, palette[indices[i]]) << i << " of " << c.width << "x" << c.height;
    }
    EXPECT_EQ(plane.raw_bytes, sample_bytes(type, c.width, c.height));
  }
}

TEST(Png, IndexedHoldsThePackedNumbersAndThePalette) {
  for (const Case& c : kCases) {
    const Bytes indices = halftoned(c.width, c.height, c.materials);
    const IndexImage image{c.width, c.height, indices, std::span(kPalette).first(c.materials + 1)};
    for (const SampleType type : {SampleType::kBit, SampleType::kUint2, SampleType::kUint4, SampleType::kUint8}) {
      if (index_encoding_obstacle(type, Encoding::kPng, c.materials)) continue;
      const EncodedPlane plane = PlaneEncoder().encode(image, type, Encoding::kPng);
      const TinyPng png = read_tiny_png(plane.bytes);
      Bytes packed;
      pack_indices(image, bits_per_index(type), packed, {});
      EXPECT_EQ(png.color_type, 3);
      EXPECT_EQ(png.bit_depth, static_cast<int>(bits_per_index(type)));
      EXPECT_EQ(png.samples, packed);
      EXPECT_EQ(plane.crc32, crc32_of(packed));
      ASSERT_EQ(png.palette.size(), 3 * (c.materials + 1));
      EXPECT_EQ(png.palette[4], kPalette[1] >> 16 & 0xff);
      EXPECT_TRUE(png.alphas.empty());
    }
  }
}

TEST(Png, IndexedKeepsAlpha) {
  const std::vector<std::uint32_t> palette = {0xffffff00, 0x112233ff, 0x44556680};
  const EncodedPlane plane = PlaneEncoder().encode({3, 1, Bytes{0, 1, 2}, palette}, SampleType::kUint2, Encoding::kPng);
  EXPECT_THAT(read_tiny_png(plane.bytes).alphas, testing::ElementsAre(0, 255, 128));
}

TEST(Png, AlphaSaysWhatIsInside) {
  const std::uint32_t width = 11, height = 3;  // Rows of bits end within a byte.
  for (const SampleType type : {SampleType::kUint8, SampleType::kUint16}) {
    const std::size_t bytes = type == SampleType::kUint8 ? 1 : 2;
    Bytes samples, inside, expected;
    for (std::uint32_t y = 0; y < height; ++y) {
      inside.resize(inside.size() + 2);
      for (std::uint32_t x = 0; x < width; ++x) {
        const bool in = (x + y) % 3 != 0;
        const std::uint32_t sample = 700 * x + 13 * y;
        if (in) inside[2 * y + x / 8] = static_cast<std::uint8_t>(inside[2 * y + x / 8] | 0x80 >> x % 8);
        for (std::size_t i = 0; i < bytes; ++i) samples.push_back(static_cast<std::uint8_t>(sample >> 8 * i));
        for (std::size_t i = bytes; i-- > 0;) expected.push_back(static_cast<std::uint8_t>(sample >> 8 * i));
        expected.insert(expected.end(), bytes, in ? 255 : 0);
      }
    }
    SampleImage image{type, width, height, samples};
    image.inside = inside;
    const EncodedPlane plane = PlaneEncoder().encode(image, Encoding::kPngAlpha);
    const TinyPng png = read_tiny_png(plane.bytes);
    EXPECT_EQ(png.color_type, 4);
    EXPECT_EQ(png.bit_depth, static_cast<int>(8 * bytes));
    EXPECT_EQ(png.samples, expected);
    EXPECT_EQ(plane.crc32, crc32_of(samples)) << "of the samples alone";
    image.inside = {};
    EXPECT_THROW(PlaneEncoder().encode(image, Encoding::kPngAlpha), Error);
  }
}

TEST(Png, AMaskIsOneBitAVoxel) {
  const Bytes indices = halftoned(975, 487, 3);
  const IndexImage image{975, 487, indices, std::span(kPalette).first(4)};
  for (std::uint32_t material = 1; material <= 3; ++material) {
    const EncodedPlane plane = PlaneEncoder().encode_mask(image, 1U << material, Encoding::kPng);
    const TinyPng png = read_tiny_png(plane.bytes);
    Bytes mask;
    pack_mask(image, 1U << material, mask, {});
    EXPECT_EQ(png.color_type, 0);
    EXPECT_EQ(png.bit_depth, 1);
    EXPECT_EQ(png.samples, mask);
    EXPECT_EQ(plane.crc32, crc32_of(mask));
  }
}

/// Returns the window's samples of a picture, of that many bytes each.
Bytes cut_out(const Bytes& all, std::uint32_t width, const LayerWindow& window, std::size_t bytes) {
  Bytes part;
  for (std::uint32_t y = window.first_row; y < window.end_row(); ++y) {
    const auto row = all.begin() + static_cast<std::ptrdiff_t>(bytes * (std::size_t{width} * y + window.first_column));
    part.insert(part.end(), row, row + static_cast<std::ptrdiff_t>(bytes * window.columns));
  }
  return part;
}

void expect_same_picture(const EncodedPlane& found, const EncodedPlane& expected, const std::string& what) {
  const TinyPng a = read_tiny_png(found.bytes), b = read_tiny_png(expected.bytes);
  EXPECT_EQ(a.width, b.width) << what;
  EXPECT_EQ(a.height, b.height) << what;
  EXPECT_EQ(a.color_type, b.color_type) << what;
  EXPECT_EQ(a.bit_depth, b.bit_depth) << what;
  EXPECT_TRUE(a.samples == b.samples) << what;
  EXPECT_EQ(found.crc32, expected.crc32) << what;
  EXPECT_EQ(found.raw_bytes, expected.raw_bytes) << what;
}

const LayerWindow kWindows[] = {{101, 400, 33, 41}, {0, 0, 700, 900}, {0, 899, 1, 1},
                                {699, 0, 1, 1},     {5, 450, 690, 2}, {}};
constexpr std::uint32_t kWide = 700, kHigh = 900;

TEST(Png, AWindowOfIndicesShowsTheWholePicture) {
  std::mt19937 random(23);
  for (const LayerWindow& window : kWindows) {
    for (const std::size_t materials : {1u, 3u, 8u}) {
      for (const std::uint32_t background : {0u, 0x204060ffu}) {
        std::vector<std::uint32_t> palette(kPalette.begin(), kPalette.begin() + static_cast<int>(materials) + 1);
        palette[0] = background;
        Bytes all(std::size_t{kWide} * kHigh);
        for (std::uint32_t y = window.first_row; y < window.end_row(); ++y) {
          for (std::uint32_t x = window.first_column; x < window.end_column(); ++x) {
            all[std::size_t{kWide} * y + x] = static_cast<std::uint8_t>(random() % (materials + 1));
          }
        }
        const Bytes part = cut_out(all, kWide, window, 1);
        const IndexImage whole{kWide, kHigh, all, palette};
        const IndexImage held{.width = kWide, .height = kHigh, .indices = part, .palette = palette, .window = window};
        const SampleType type = smallest_index_type(materials);
        const std::string what = std::to_string(window.first_row) + ", " + std::to_string(materials);
        for (const Encoding encoding : {Encoding::kPng, Encoding::kPngRgba}) {
          PlaneEncoder encoder;
          expect_same_picture(encoder.encode(held, type, encoding), encoder.encode(whole, type, encoding), what);
        }
        expect_same_picture(PlaneEncoder().encode_mask(held, 1U << 1, Encoding::kPng),
                            PlaneEncoder().encode_mask(whole, 1U << 1, Encoding::kPng), what + ", mask");
      }
    }
  }
}

TEST(Png, AWindowOfSamplesShowsTheWholePicture) {
  std::mt19937 random(24);
  for (const LayerWindow& window : kWindows) {
    for (const SampleType type : {SampleType::kUint8, SampleType::kUint16}) {
      for (const std::uint8_t outside : {0, 77}) {
        const std::size_t bytes = type == SampleType::kUint8 ? 1 : 2;
        Bytes all(bytes * kWide * kHigh);
        for (std::size_t i = 0; i < all.size(); i += bytes) all[i] = outside;
        Bytes inside(sample_bytes(SampleType::kBit, kWide, kHigh));
        for (std::uint32_t y = window.first_row; y < window.end_row(); ++y) {
          for (std::uint32_t x = window.first_column; x < window.end_column(); ++x) {
            const std::size_t voxel = std::size_t{kWide} * y + x;
            for (std::size_t k = 0; k < bytes; ++k) all[bytes * voxel + k] = static_cast<std::uint8_t>(random());
            std::uint8_t& eight = inside[(kWide + 7) / 8 * y + x / 8];
            eight = static_cast<std::uint8_t>(eight | 0x80 >> x % 8);
          }
        }
        const Bytes part = cut_out(all, kWide, window, bytes);
        SampleImage whole{.type = type, .width = kWide, .height = kHigh, .samples = all, .inside = inside};
        whole.outside = {outside};
        SampleImage held = whole;
        held.samples = part;
        held.window = window;
        const std::string what = std::to_string(window.first_row) + ", " + std::to_string(outside);
        for (const Encoding encoding : {Encoding::kPng, Encoding::kPngAlpha}) {
          PlaneEncoder encoder;
          expect_same_picture(encoder.encode(held, encoding), encoder.encode(whole, encoding), what);
        }
      }
    }
  }
}

TEST(Png, SaysTheResolutionWhereThePitchIsKnown) {
  const std::vector<std::string> with = {"IHDR", "pHYs", "IDAT", "IEND"}, without = {"IHDR", "IDAT", "IEND"};
  const Bytes indices = {0, 1};
  const SampleImage grey{SampleType::kUint8, 2, 1, indices, {}, kPitch};
  const Bytes file = PlaneEncoder().encode(grey, Encoding::kPng).bytes;
  EXPECT_EQ(read_tiny_png(file).chunks, with);
  // After the signature and IHDR, the length and the name: pixels a metre along x and y, and 1 for the metre.
  const std::size_t at = 8 + 25 + 8;
  EXPECT_EQ(Bytes(file.begin() + at, file.begin() + at + 9), (Bytes{0, 0, 0x5c, 0x46, 0, 0, 0x2e, 0x23, 1}));
  EXPECT_EQ(read_tiny_png(PlaneEncoder().encode({SampleType::kUint8, 2, 1, indices}, Encoding::kPng).bytes).chunks,
            without);
  const IndexImage numbers{2, 1, indices, std::span(kPalette).first(2), kPitch};
  EXPECT_EQ(read_tiny_png(PlaneEncoder().encode(numbers, SampleType::kBit, Encoding::kPngRgba).bytes).chunks, with);
  EXPECT_EQ(read_tiny_png(PlaneEncoder().encode_mask(numbers, 1U << 1, Encoding::kPng).bytes).chunks, with);
  EXPECT_EQ(read_tiny_png(PlaneEncoder().encode(numbers, SampleType::kBit, Encoding::kPng).bytes).chunks,
            (std::vector<std::string>{"IHDR", "pHYs", "PLTE", "IDAT", "IEND"}));
}

TEST(Png, HasTheSameBytesOnEveryMachine) {
  const Bytes indices = halftoned(975, 487, 3);
  const IndexImage image{975, 487, indices, std::span(kPalette).first(4)};
  EXPECT_EQ(crc32_of(PlaneEncoder().encode(image, SampleType::kUint2, Encoding::kPng).bytes), 1145017453u);
  EXPECT_EQ(crc32_of(PlaneEncoder().encode(image, SampleType::kUint2, Encoding::kPngRgba).bytes), 1870881467u);
}

/// What any reader shows for a picture: four bytes a voxel.
Bytes colours_of(const IndexImage& image) {
  Bytes colours;
  for (const std::uint8_t index : image.indices) {
    for (int shift = 24; shift >= 0; shift -= 8) {
      colours.push_back(static_cast<std::uint8_t>(image.palette[index] >> shift));
    }
  }
  return colours;
}

class PictureFolder {
 public:
  PictureFolder() { std::filesystem::create_directories(path_); }
  ~PictureFolder() { std::filesystem::remove_all(path_); }

  void add(const std::string& name, const Bytes& png, const Bytes& colours) {
    write(name + ".png", png);
    write(name + ".rgba", colours);
  }
  std::string path() const { return path_.string(); }

 private:
  void write(const std::string& name, const Bytes& bytes) {
    std::ofstream(path_ / name, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  const std::filesystem::path path_ =
      std::filesystem::temp_directory_path() / ("ccslice_pictures_" + std::to_string(getpid()));
};

TEST(Png, OtherProgramsSeeTheSame) {
  PictureFolder folder;
  for (const Case& c : kCases) {
    const std::string size = std::to_string(c.width) + "x" + std::to_string(c.height);
    const Bytes indices = halftoned(c.width, c.height, c.materials);
    const IndexImage image{c.width, c.height, indices, std::span(kPalette).first(c.materials + 1), kPitch};
    const SampleType type = smallest_index_type(c.materials);
    folder.add("rgba_" + size, PlaneEncoder().encode(image, type, Encoding::kPngRgba).bytes, colours_of(image));
    folder.add("indexed_" + size, PlaneEncoder().encode(image, type, Encoding::kPng).bytes, colours_of(image));
    Bytes mask;
    for (const std::uint8_t index : indices) mask.push_back(index == 1);
    const std::vector<std::uint32_t> black_and_white = {0x000000ff, 0xffffffff};
    folder.add("mask_" + size, PlaneEncoder().encode_mask(image, 1U << 1, Encoding::kPng).bytes,
               colours_of({c.width, c.height, mask, black_and_white}));
    std::vector<std::uint32_t> greys(256);
    for (std::uint32_t i = 0; i < 256; ++i) greys[i] = i * 0x01010100 | 0xff;
    const SampleImage grey{SampleType::kUint8, c.width, c.height, indices, {}, kPitch};
    folder.add("grey_" + size, PlaneEncoder().encode(grey, Encoding::kPng).bytes,
               colours_of({c.width, c.height, indices, greys}));
  }
  EXPECT_EQ(std::system(("/usr/bin/python3 " CCSLICE_CHECK_PNG_READERS " " + folder.path()).c_str()), 0);
}

TEST(Png, StopsWhenCancelled) {
  const CancellationToken cancel = CancellationToken::make();
  cancel.cancel();
  const Bytes indices = {0, 1};
  const IndexImage image{2, 1, indices, std::span(kPalette).first(2)};
  for (const Encoding encoding : {Encoding::kPng, Encoding::kPngRgba}) {
    EXPECT_THROW(PlaneEncoder().encode(image, SampleType::kBit, encoding, cancel), Error);
  }
  EXPECT_THROW(PlaneEncoder().encode_mask(image, 1U << 1, Encoding::kPng, cancel), Error);
}

/// Red, green, blue and alpha of every pixel, whichever kind of picture it is.
std::vector<std::uint8_t> rgba_of(const TinyPng& png) {
  if (png.color_type == 6) return png.samples;
  std::vector<std::uint8_t> rgba;
  for (const std::uint8_t index : png.samples) {
    for (std::size_t c = 0; c < 3; ++c) rgba.push_back(png.palette[3u * index + c]);
    rgba.push_back(index < png.alphas.size() ? png.alphas[index] : 255);
  }
  return rgba;
}

TEST(Png, ColoursComeWithAPaletteIfTheyAreFew) {
  for (const std::uint32_t colours : {1u, 2u, 256u, 257u, 4000u}) {
    std::vector<std::uint8_t> rgba;
    for (std::uint32_t pixel = 0; pixel < 80 * 50; ++pixel) {
      const std::uint32_t colour = (pixel * 2654435761u >> 8) % colours * 0x01030507u;
      for (int shift = 24; shift >= 0; shift -= 8) rgba.push_back(static_cast<std::uint8_t>(colour >> shift));
    }
    const TinyPng png = read_tiny_png(PngEncoder().colours(80, 50, rgba, {}));
    EXPECT_EQ(png.width, 80u);
    EXPECT_EQ(png.color_type, colours <= 256 ? 3 : 6) << colours;
    EXPECT_EQ(rgba_of(png), rgba) << colours;
  }
}

}  // namespace
}  // namespace ccslice
