// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/plane_encodings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "client/client_error.h"
#include "client/plane_decoder.h"
#include "core/output/encode.h"
#include "core/output/encodings.h"
#include "core/output/pack_indices.h"

namespace ccslice::client {
namespace {

TEST(PlaneEncodings, AreAllThoseOfTheContract) {
  const google::protobuf::EnumDescriptor& type = *v1::PlaneEncoding_descriptor();
  for (int i = 0; i < type.value_count(); ++i) {
    const auto value = static_cast<v1::PlaneEncoding>(type.value(i)->number());
    EXPECT_EQ(find_encoding(value) != nullptr, value != v1::PLANE_ENCODING_UNSPECIFIED) << type.value(i)->name();
  }
}

TEST(PlaneEncodings, AreDecodedOrChecked) {
  for (const PlaneEncoding& encoding : plane_encodings()) {
    EXPECT_NE(encoding.decode == nullptr, encoding.check == nullptr) << encoding.name;
    EXPECT_TRUE(encoding.extension.starts_with('.')) << encoding.name;
  }
}

constexpr std::pair<SampleType, v1::SampleType> kTypes[] = {
    {SampleType::kBit, v1::SAMPLE_TYPE_BIT},       {SampleType::kUint2, v1::SAMPLE_TYPE_UINT2},
    {SampleType::kUint4, v1::SAMPLE_TYPE_UINT4},   {SampleType::kUint8, v1::SAMPLE_TYPE_UINT8},
    {SampleType::kUint16, v1::SAMPLE_TYPE_UINT16}, {SampleType::kFloat32, v1::SAMPLE_TYPE_FLOAT32}};

/// Noise, which doesn't become smaller, in all encodings and types of samples.
void expect_all_encodings_fit(std::uint32_t width, std::uint32_t height) {
  std::minstd_rand random;
  const auto noise = [&](std::uint64_t count, unsigned most) {
    std::vector<std::uint8_t> bytes(count);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>((random() >> 8) % (most + 1));
    return bytes;
  };
  PlaneEncoder encoder;
  v1::GridExtent extent;
  extent.set_columns(width);
  extent.set_rows(height);
  for (const EncodingTraits& traits : encodings()) {
    v1::PlaneSpec spec;
    v1::PlaneEncoding value{};
    ASSERT_TRUE(v1::PlaneEncoding_Parse("PLANE_ENCODING_" + std::string(traits.name), &value));
    spec.set_encoding(value);
    for (const std::pair<SampleType, v1::SampleType>& types : kTypes) {
      const SampleType type = types.first;
      spec.set_sample_type(types.second);
      const auto expect_fits = [&](const EncodedPlane& plane) {
        EXPECT_NO_THROW(require_possible_size(spec, extent, plane.bytes.size()))
            << traits.name << ", type " << spec.sample_type() << ", " << width << " x " << height << ": "
            << plane.bytes.size();
      };
      const bool materials_only = type == SampleType::kUint2 || type == SampleType::kUint4;
      if (!materials_only && !encoding_obstacle(type, traits.encoding)) {
        const auto samples = noise(sample_bytes(type, width, height), 255);
        const auto inside = noise(sample_bytes(SampleType::kBit, width, height), 255);
        expect_fits(encoder.encode(SampleImage{type, width, height, samples, {}, {.x_mm = 0.1, .y_mm = 0.1}, inside},
                                   traits.encoding));
      }
      const unsigned materials = std::min(63u, (1u << bits_per_index(type)) - 1);
      if (!index_encoding_obstacle(type, traits.encoding, materials)) {
        std::vector<std::uint32_t> palette(materials + 1);
        std::ranges::generate(palette, random);
        const auto indices = noise(std::uint64_t{width} * height, materials);
        expect_fits(encoder.encode(IndexImage{width, height, indices, palette}, type, traits.encoding));
      }
    }
  }
}

TEST(PlaneEncodings, HaveRoomForTheLargestFilesThatServersMake) {
  expect_all_encodings_fit(1, 1);
  expect_all_encodings_fit(1, 60'000);
  expect_all_encodings_fit(60'000, 1);
  expect_all_encodings_fit(9, 20'000);
  expect_all_encodings_fit(700, 500);
}

TEST(PlaneEncodings, HaveNoRoomForMuchMore) {
  v1::GridExtent extent;
  extent.set_columns(1'000);
  extent.set_rows(1'000);
  v1::PlaneSpec spec;
  for (const PlaneEncoding& encoding : plane_encodings()) {
    spec.set_encoding(encoding.value);
    for (const auto& [type, number] : kTypes) {
      spec.set_sample_type(number);
      EXPECT_THROW(require_possible_size(spec, extent, 40'000'000), ClientError) << encoding.name << number;
      EXPECT_THROW(require_possible_size(spec, extent, ~std::uint64_t{0}), ClientError) << encoding.name << number;
    }
  }
  spec.set_encoding(static_cast<v1::PlaneEncoding>(99));
  EXPECT_THROW(require_possible_size(spec, extent, 1), ClientError) << "an encoding that nobody knows";
}

}  // namespace
}  // namespace ccslice::client
