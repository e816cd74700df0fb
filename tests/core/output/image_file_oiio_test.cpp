// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <cstring>
#include <numeric>
#include <thread>

#include "core/output/encode.h"
#include "core/output/image_file.h"

namespace ccslice {
namespace {

using Bytes = std::vector<std::uint8_t>;

struct Decoded {
  OIIO::ImageSpec spec;
  Bytes samples;  // Of spec's format and channels.
};

Decoded read_with_openimageio(const Bytes& file, const char* name) {
  OIIO::Filesystem::IOMemReader source(file.data(), file.size());
  const auto input = OIIO::ImageInput::open(name, nullptr, &source);
  if (!input) {
    ADD_FAILURE() << OIIO::geterror();
    return {};
  }
  Decoded decoded{input->spec(), {}};
  decoded.samples.resize(decoded.spec.image_bytes());
  EXPECT_TRUE(input->read_image(0, 0, 0, decoded.spec.nchannels, decoded.spec.format, decoded.samples.data()));
  return decoded;
}

const char* file_name(Encoding format) { return format == Encoding::kTiff ? "a.tif" : "a.exr"; }

template <class Sample>
Bytes counting_samples(std::size_t count, Sample first) {
  std::vector<Sample> samples(count);
  std::iota(samples.begin(), samples.end(), first);
  Bytes bytes(count * sizeof(Sample));
  std::memcpy(bytes.data(), samples.data(), bytes.size());
  return bytes;
}

struct Kind {
  Encoding format;
  SampleType type;
  OIIO::TypeDesc read_as;
};

const Kind kKinds[] = {{Encoding::kTiff, SampleType::kUint8, OIIO::TypeDesc::UINT8},
                       {Encoding::kTiff, SampleType::kUint16, OIIO::TypeDesc::UINT16},
                       {Encoding::kTiff, SampleType::kFloat32, OIIO::TypeDesc::FLOAT},
                       {Encoding::kExr, SampleType::kFloat32, OIIO::TypeDesc::FLOAT}};

Bytes samples_of(SampleType type, std::size_t count) {
  switch (type) {
    case SampleType::kUint8: return counting_samples<std::uint8_t>(count, 0);
    case SampleType::kUint16: return counting_samples<std::uint16_t>(count, 65000);
    default: return counting_samples<float>(count, -0.25f);
  }
}

TEST(ImageFile, ReadsBackEveryKindOfSampleAtEverySize) {
  struct Size {
    std::uint32_t width, height;
  };
  for (const Size size : {Size{1, 1}, Size{321, 45}, Size{7, 200}, Size{65'536, 5}, Size{1975, 987}}) {
    for (const Kind& kind : kKinds) {
      const Bytes samples = samples_of(kind.type, std::size_t{size.width} * size.height);
      const Bytes file = encode_image_file(kind.format, {kind.type, size.width, size.height, samples}, {});
      const Decoded decoded = read_with_openimageio(file, file_name(kind.format));
      EXPECT_EQ(decoded.spec.width, static_cast<int>(size.width));
      EXPECT_EQ(decoded.spec.nchannels, 1);
      EXPECT_EQ(decoded.spec.format, kind.read_as);
      EXPECT_EQ(decoded.samples, samples) << file_name(kind.format) << " " << size.width << "x" << size.height;
    }
  }
}

TEST(ImageFile, ATiffSaysTheResolutionWhereThePitchIsKnown) {
  const Bytes samples = {1, 2};
  const PixelPitch pitch = {25.4 / 600, 25.4 / 300};
  const Bytes with = encode_image_file(Encoding::kTiff, {SampleType::kUint8, 2, 1, samples, {}, pitch}, {});
  const OIIO::ImageSpec spec = read_with_openimageio(with, "a.tif").spec;
  EXPECT_EQ(spec.get_string_attribute("ResolutionUnit"), "in");
  EXPECT_FLOAT_EQ(spec.get_float_attribute("XResolution"), 600);
  EXPECT_FLOAT_EQ(spec.get_float_attribute("YResolution"), 300);
  const Bytes without = encode_image_file(Encoding::kTiff, {SampleType::kUint8, 2, 1, samples}, {});
  EXPECT_EQ(read_with_openimageio(without, "a.tif").spec.find_attribute("XResolution"), nullptr);
}

TEST(ImageFile, ATiffWithAlphaSaysWhatIsInside) {
  const Bytes inside = {0b01010000, 0b10100000};
  for (const SampleType type : {SampleType::kUint8, SampleType::kUint16, SampleType::kFloat32}) {
    const Bytes samples = samples_of(type, 8);
    SampleImage image{type, 4, 2, samples};
    image.inside = inside;
    const Decoded decoded = read_with_openimageio(encode_image_file(Encoding::kTiffAlpha, image, {}), "a.tif");
    ASSERT_EQ(decoded.spec.nchannels, 2);
    EXPECT_EQ(decoded.spec.alpha_channel, 1);
    const std::size_t bytes = samples.size() / 8;
    const float one = 1;
    Bytes opaque(bytes, 255);
    if (type == SampleType::kFloat32) std::memcpy(opaque.data(), &one, sizeof one);
    for (std::size_t i = 0; i < 8; ++i) {
      // A reader multiplies by alpha: what is outside comes out as 0.
      const bool in = inside[i / 4] >> (7 - i % 4) & 1;
      const auto at = decoded.samples.begin() + static_cast<std::ptrdiff_t>(2 * bytes * i);
      const auto from = samples.begin() + static_cast<std::ptrdiff_t>(bytes * i);
      const Bytes sample(at, at + static_cast<std::ptrdiff_t>(bytes)),
          alpha(at + static_cast<std::ptrdiff_t>(bytes), at + static_cast<std::ptrdiff_t>(2 * bytes));
      EXPECT_EQ(alpha, in ? opaque : Bytes(bytes, 0)) << i;
      if (!in) continue;
      EXPECT_EQ(sample, Bytes(from, from + static_cast<std::ptrdiff_t>(bytes))) << i;
    }
  }
}

TEST(ImageFile, OccupancyIsOneBitInATiff) {
  for (const std::uint32_t width : {1u, 8u, 61u, 1975u}) {
    const std::uint32_t height = 75;
    const std::size_t row_bytes = (width + 7) / 8;
    Bytes bits(row_bytes * height), grey;
    for (std::uint32_t y = 0; y < height; ++y) {
      for (std::uint32_t x = 0; x < width; ++x) {
        const bool inside = (x * 7 + y) / 5 % 3 == 1;
        grey.push_back(inside ? 255 : 0);
        if (inside) bits[row_bytes * y + x / 8] |= static_cast<std::uint8_t>(0x80 >> x % 8);
      }
    }
    const Bytes file = encode_image_file(Encoding::kTiff, {SampleType::kBit, width, height, bits}, {});
    const Decoded decoded = read_with_openimageio(file, "a.tif");
    EXPECT_EQ(decoded.spec.get_int_attribute("oiio:BitsPerSample"), 1);
    EXPECT_EQ(decoded.samples, grey) << width;
  }
}

TEST(ImageFile, AnExrKeepsEachChannelUnderItsName) {
  const std::vector<std::string> names = {"stiffness", "A", "Z", "colour.red", "a b"};
  const Bytes samples = samples_of(SampleType::kFloat32, 33 * 70 * names.size());
  const Bytes file = encode_image_file(Encoding::kExr, {SampleType::kFloat32, 33, 70, samples, names}, {});
  const Decoded decoded = read_with_openimageio(file, "a.exr");
  ASSERT_EQ(decoded.spec.nchannels, static_cast<int>(names.size()));
  for (std::size_t c = 0; c < names.size(); ++c) {
    const int there = decoded.spec.channelindex(names[c]);
    ASSERT_GE(there, 0) << names[c];
    for (std::size_t voxel = 0; voxel < 33 * 70; ++voxel) {
      const std::size_t from = 4 * (names.size() * voxel + c);
      const std::size_t to = 4 * (names.size() * voxel + static_cast<std::size_t>(there));
      ASSERT_EQ(std::memcmp(&samples[from], &decoded.samples[to], 4), 0) << names[c] << " at " << voxel;
    }
  }
}

TEST(ImageFile, HoldsNoDate) {
  for (const Kind& kind : kKinds) {
    const Bytes samples = samples_of(kind.type, 64 * 64);
    const Bytes file = encode_image_file(kind.format, {kind.type, 64, 64, samples}, {});
    const OIIO::ImageSpec spec = read_with_openimageio(file, file_name(kind.format)).spec;
    EXPECT_EQ(spec.get_string_attribute("DateTime"), "");
    EXPECT_EQ(spec.get_string_attribute("Software"), "");
    EXPECT_EQ(spec.get_string_attribute("HostComputer"), "");
  }
}

TEST(ImageFile, IsTheSameOnAnyThread) {
  for (const Kind& kind : kKinds) {
    const Bytes samples = samples_of(kind.type, 640 * 480);
    const SampleImage image{kind.type, 640, 480, samples};
    const Bytes here = encode_image_file(kind.format, image, {});
    std::vector<Bytes> there(4);
    std::vector<std::jthread> threads;
    for (Bytes& file : there) threads.emplace_back([&] { file = encode_image_file(kind.format, image, {}); });
    threads.clear();
    for (const Bytes& file : there) EXPECT_EQ(file, here);
  }
}

// Our own PNG files, read by somebody else.

TEST(PngFile, GreyReadsBack) {
  for (const std::uint32_t width : {1u, 7u, 61u, 1975u}) {
    const std::uint32_t height = 75;
    const Bytes bytes = samples_of(SampleType::kUint8, std::size_t{width} * height);
    const Bytes words = samples_of(SampleType::kUint16, std::size_t{width} * height);
    const auto read = [&](SampleType type, const Bytes& samples) {
      return read_with_openimageio(PlaneEncoder().encode({type, width, height, samples}, Encoding::kPng).bytes,
                                   "a.png");
    };
    EXPECT_EQ(read(SampleType::kUint8, bytes).samples, bytes);
    EXPECT_EQ(read(SampleType::kUint16, words).samples, words);
    EXPECT_EQ(read(SampleType::kUint16, words).spec.format, OIIO::TypeDesc::UINT16);
  }
}

TEST(PngFile, MaterialsReadBackInTheirColours) {
  const std::vector<std::uint32_t> palette = {0x000000ff, 0x00ffffff, 0xff0080ff, 0xffffffff};
  const std::uint32_t width = 321, height = 75;
  Bytes indices, colours, mask;
  for (std::uint32_t i = 0; i < width * height; ++i) {
    indices.push_back(static_cast<std::uint8_t>(i * 7 / 5 % 4));
    for (int shift = 24; shift >= 0; shift -= 8)
      colours.push_back(static_cast<std::uint8_t>(palette[indices.back()] >> shift));
    mask.push_back(indices.back() == 2 ? 255 : 0);
  }
  const IndexImage image{width, height, indices, palette};
  const Decoded rgba =
      read_with_openimageio(PlaneEncoder().encode(image, SampleType::kUint2, Encoding::kPngRgba).bytes, "a.png");
  EXPECT_EQ(rgba.spec.nchannels, 4);
  EXPECT_EQ(rgba.samples, colours);
  for (const SampleType type : {SampleType::kUint2, SampleType::kUint4, SampleType::kUint8}) {
    const Decoded indexed = read_with_openimageio(PlaneEncoder().encode(image, type, Encoding::kPng).bytes, "a.png");
    ASSERT_EQ(indexed.spec.nchannels, 3);  // OpenImageIO looks the colours up.
    for (std::size_t i = 0; i < indices.size(); ++i) {
      ASSERT_EQ(std::memcmp(&indexed.samples[3 * i], &colours[4 * i], 3), 0) << i;
    }
  }
  EXPECT_EQ(read_with_openimageio(PlaneEncoder().encode_mask(image, 1U << 2, Encoding::kPng).bytes, "a.png").samples,
            mask);
}

}  // namespace
}  // namespace ccslice
