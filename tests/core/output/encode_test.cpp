// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/output/encode.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zstd.h>

#include <cstring>
#include <random>
#include <string>
#include <string_view>

#include "core/base/error.h"
#include "core/output/image_file.h"
#include "tests/core/output/tiny_png.h"

namespace ccslice {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr Encoding kAllEncodings[] = {Encoding::kRaw, Encoding::kRawZstd, Encoding::kPng, Encoding::kTiff,
                                      Encoding::kExr};

struct Picture {
  SampleType type;
  std::uint32_t width, height;
};

// Smooth with some noise, padding bits zero: what layers look like.
Bytes samples_of(const Picture& picture, std::uint32_t seed) {
  std::mt19937 random(seed);
  Bytes samples(sample_bytes(picture.type, picture.width, picture.height));
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i] = static_cast<std::uint8_t>(i / 7 + random() % 3);
  if (picture.type == SampleType::kBit && picture.width % 8 != 0) {
    const std::size_t row_bytes = (picture.width + 7) / 8;
    for (std::size_t y = 0; y < picture.height; ++y)
      samples[row_bytes * (y + 1) - 1] &= 0xff << (8 - picture.width % 8);
  }
  return samples;
}

Bytes unzstd(std::span<const std::uint8_t> frame) {
  const unsigned long long size = ZSTD_getFrameContentSize(frame.data(), frame.size());
  if (size == ZSTD_CONTENTSIZE_UNKNOWN || size == ZSTD_CONTENTSIZE_ERROR) return {};
  EXPECT_EQ(ZSTD_findFrameCompressedSize(frame.data(), frame.size()), frame.size()) << "more than one frame";
  Bytes samples(size);
  EXPECT_EQ(ZSTD_decompress(samples.data(), samples.size(), frame.data(), frame.size()), size);
  return samples;
}

// Back from a decoded picture to the samples that were encoded.
Bytes samples_of_png(const TinyPng& png, SampleType type) {
  Bytes samples(sample_bytes(type, png.width, png.height));
  const std::size_t row_bytes = (std::size_t{png.width} + 7) / 8;
  for (std::size_t i = 0; i < png.samples.size(); ++i) {
    const std::uint8_t value = png.samples[i];
    if (type == SampleType::kUint16) {
      samples[i ^ 1] = value;
    } else if (type == SampleType::kUint8) {
      samples[i] = value;
    } else {
      EXPECT_TRUE(value == 0 || value == 255);
      if (value) samples[row_bytes * (i / png.width) + i % png.width / 8] |= 0x80 >> (i % png.width % 8);
    }
  }
  return samples;
}

ErrorCode code_of(SampleType type, Encoding encoding) {
  const Bytes samples(sample_bytes(type, 4, 4));
  try {
    (void)PlaneEncoder().encode({type, 4, 4, samples}, encoding);
  } catch (const Error& error) {
    return error.code();
  }
  return ErrorCode{0};
}

TEST(Crc32, GivesTheKnownVectors) {
  const auto crc_of_text = [](std::string_view text) { return crc32_of(Bytes(text.begin(), text.end())); };
  EXPECT_EQ(crc_of_text(""), 0u);
  EXPECT_EQ(crc_of_text("123456789"), 0xCBF43926u);
  EXPECT_EQ(crc_of_text("The quick brown fox jumps over the lazy dog"), 0x414FA339u);
  EXPECT_EQ(crc32_of(Bytes(32, 0)), 0x190A55ADu);
  EXPECT_EQ(crc32_of(Bytes(32, 0xff)), 0xFF6CAB0Bu);
}

TEST(Crc32, IsTheSameByPiecesOfAMegabyte) {
  Bytes bytes(3 * (1 << 20) + 17, 0);
  bytes.back() = 1;
  std::uint32_t remainder = 0xffffffff;  // Bit by bit, from the definition.
  for (const std::uint8_t byte : bytes) {
    remainder ^= byte;
    for (int bit = 0; bit < 8; ++bit) remainder = remainder >> 1 ^ (remainder & 1 ? 0xEDB88320u : 0);
  }
  EXPECT_EQ(crc32_of(bytes), ~remainder);
}

class EncodeRoundTrip : public testing::TestWithParam<Picture> {};

TEST_P(EncodeRoundTrip, RawIsTheSamples) {
  const Picture picture = GetParam();
  const Bytes samples = samples_of(picture, 1);
  const EncodedPlane plane =
      PlaneEncoder().encode({picture.type, picture.width, picture.height, samples}, Encoding::kRaw);
  EXPECT_EQ(plane.bytes, samples);
  EXPECT_EQ(plane.raw_bytes, samples.size());
  EXPECT_EQ(plane.crc32, crc32_of(samples));
}

TEST_P(EncodeRoundTrip, ZstdDecodesToTheSamples) {
  const Picture picture = GetParam();
  const Bytes samples = samples_of(picture, 2);
  const EncodedPlane plane =
      PlaneEncoder().encode({picture.type, picture.width, picture.height, samples}, Encoding::kRawZstd);
  EXPECT_EQ(unzstd(plane.bytes), samples);
  EXPECT_EQ(plane.raw_bytes, samples.size());
  EXPECT_EQ(plane.crc32, crc32_of(samples));
}

TEST_P(EncodeRoundTrip, PngDecodesToTheSamples) {
  const Picture picture = GetParam();
  if (encoding_obstacle(picture.type, Encoding::kPng)) GTEST_SKIP() << *encoding_obstacle(picture.type, Encoding::kPng);
  const Bytes samples = samples_of(picture, 3);
  const EncodedPlane plane =
      PlaneEncoder().encode({picture.type, picture.width, picture.height, samples}, Encoding::kPng);
  const TinyPng png = read_tiny_png(plane.bytes);
  EXPECT_EQ(png.width, picture.width);
  EXPECT_EQ(png.height, picture.height);
  EXPECT_EQ(png.bit_depth, picture.type == SampleType::kUint16 ? 16 : 8);
  EXPECT_EQ(samples_of_png(png, picture.type), samples);
  EXPECT_EQ(plane.raw_bytes, samples.size());
  EXPECT_EQ(plane.crc32, crc32_of(samples));
}

TEST_P(EncodeRoundTrip, AnEncodersPastDoesNotShow) {
  const Picture picture = GetParam();
  const Bytes samples = samples_of(picture, 4);
  const SampleImage image{picture.type, picture.width, picture.height, samples};
  PlaneEncoder used;
  const Bytes other = samples_of({SampleType::kFloat32, 300, 200}, 5);
  (void)used.encode({SampleType::kFloat32, 300, 200, other}, Encoding::kRawZstd);
  for (const Encoding encoding : kAllEncodings) {
    if (encoding_obstacle(picture.type, encoding)) continue;
    EXPECT_EQ(used.encode(image, encoding).bytes, PlaneEncoder().encode(image, encoding).bytes);
  }
}

std::string name_of(const testing::TestParamInfo<Picture>& info) {
  const std::string names[] = {"Bit", "Uint8", "Uint16", "Float32"};
  return names[static_cast<int>(info.param.type)] + "_" + std::to_string(info.param.width) + "x" +
         std::to_string(info.param.height);
}

INSTANTIATE_TEST_SUITE_P(Pictures, EncodeRoundTrip,
                         testing::Values(Picture{SampleType::kBit, 1, 1}, Picture{SampleType::kBit, 8, 3},
                                         Picture{SampleType::kBit, 1975, 987}, Picture{SampleType::kUint8, 1, 1},
                                         Picture{SampleType::kUint8, 1975, 987}, Picture{SampleType::kUint16, 3, 5},
                                         Picture{SampleType::kUint16, 1975, 987}, Picture{SampleType::kFloat32, 7, 1},
                                         Picture{SampleType::kFloat32, 1975, 987}),
                         name_of);

TEST(Encode, WritesBitsAsBlackAndWhite) {
  const Bytes bits = {0b10100000, 0b01000000};  // Two rows of three.
  const EncodedPlane plane = PlaneEncoder().encode({SampleType::kBit, 3, 2, bits}, Encoding::kPng);
  EXPECT_THAT(read_tiny_png(plane.bytes).samples, testing::ElementsAre(255, 0, 255, 0, 255, 0));
}

TEST(Encode, PutsNothingButThePictureIntoAPng) {
  const Bytes samples(64, 9);
  const TinyPng png = read_tiny_png(PlaneEncoder().encode({SampleType::kUint8, 8, 8, samples}, Encoding::kPng).bytes);
  // No time, no software name: equal layers are equal files.
  for (const std::string& chunk : png.chunks)
    EXPECT_THAT(chunk, testing::Not(testing::AnyOf("tIME", "tEXt", "iTXt", "zTXt")));
}

TEST(Encode, RefusesWhatPicturesCannotHold) {
  EXPECT_EQ(code_of(SampleType::kFloat32, Encoding::kPng), ErrorCode::kEncodingUnsupported);
  EXPECT_EQ(code_of(SampleType::kUint8, Encoding::kPngRgba), ErrorCode::kEncodingUnsupported);
  for (const SampleType type : {SampleType::kBit, SampleType::kUint8, SampleType::kUint16}) {
    EXPECT_EQ(code_of(type, Encoding::kExr), ErrorCode::kEncodingUnsupported);
  }
  EXPECT_THAT(std::string(*encoding_obstacle(SampleType::kFloat32, Encoding::kTiff, 2)), testing::HasSubstr("EXR"));
  EXPECT_EQ(code_of(SampleType::kUint8, static_cast<Encoding>(77)), ErrorCode::kEncodingUnsupported);
}

TEST(Encode, SaysWhatToDoWithoutOpenImageIo) {
  if (image_files_available()) GTEST_SKIP() << "this build has TIFF";
  EXPECT_EQ(code_of(SampleType::kUint8, Encoding::kTiff), ErrorCode::kEncodingUnsupported);
  EXPECT_THAT(std::string(*encoding_obstacle(SampleType::kUint8, Encoding::kTiff)), testing::HasSubstr("OpenImageIO"));
}

TEST(Encode, RefusesSamplesThatDoNotFit) {
  const Bytes samples(15);
  EXPECT_THROW(PlaneEncoder().encode({SampleType::kUint8, 4, 4, samples}, Encoding::kRaw), Error);
  EXPECT_THROW(PlaneEncoder().encode({SampleType::kUint8, 0, 0, {}}, Encoding::kRaw), Error);
}

TEST(Encode, StopsWhenCancelled) {
  const CancellationToken cancel = CancellationToken::make();
  cancel.cancel();
  const Bytes samples(16);
  for (const Encoding encoding : kAllEncodings) {
    if (encoding_obstacle(SampleType::kUint8, encoding)) continue;
    try {
      (void)PlaneEncoder().encode({SampleType::kUint8, 4, 4, samples}, encoding, cancel);
      ADD_FAILURE() << "not cancelled";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kCancelled);
    }
  }
}

}  // namespace
}  // namespace ccslice
