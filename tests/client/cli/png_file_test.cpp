// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/pictures/png_file.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "core/output/encode.h"

namespace ccslice::cli {
namespace {

std::vector<std::uint8_t> some_samples(std::uint32_t width, std::uint32_t height) {
  std::vector<std::uint8_t> samples(std::size_t{width} * height);
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i] = static_cast<std::uint8_t>(i * i / 7 + i % width);
  return samples;
}

std::string png_of(SampleType type, std::uint32_t width, std::uint32_t height, const std::vector<std::uint8_t>& bytes) {
  const std::vector<std::uint8_t> png = PlaneEncoder().encode({type, width, height, bytes}, Encoding::kPng).bytes;
  return {png.begin(), png.end()};
}

TEST(GreySamples, AreThoseThatTheServerEncoded) {
  for (const auto& [width, height] : {std::pair{1u, 1u}, std::pair{7u, 200u}, std::pair{975u, 3u}}) {
    const std::vector<std::uint8_t> samples = some_samples(width, height);
    const auto read = grey_samples(png_of(SampleType::kUint8, width, height, samples), width, height);
    ASSERT_TRUE(read);
    EXPECT_EQ(*read, std::string(samples.begin(), samples.end()));
  }
}

TEST(GreySamples, AreThoseOfNoOtherFile) {
  const std::vector<std::uint8_t> samples = some_samples(20, 10);
  const std::string png = png_of(SampleType::kUint8, 20, 10, samples);
  EXPECT_FALSE(grey_samples(png, 10, 20)) << "another size";
  EXPECT_FALSE(grey_samples("", 20, 10));
  EXPECT_FALSE(grey_samples(png, 0xffffffff, 0xffffffff)) << "more than there is memory";
  EXPECT_FALSE(grey_samples("not a picture", 20, 10));
  EXPECT_FALSE(grey_samples(png_of(SampleType::kUint16, 10, 10, samples), 10, 10)) << "16 bits";
  EXPECT_FALSE(grey_samples(to_png({20, 10, std::vector<std::uint8_t>(600)}), 20, 10)) << "colours";
  for (std::size_t length = 0; length + 12 < png.size(); ++length) {
    EXPECT_FALSE(grey_samples(png.substr(0, length), 20, 10)) << length << " bytes of " << png.size();
  }
  for (std::size_t at = 0; at < png.size(); ++at) {  // Whatever a byte is changed to, reading comes to an end.
    std::string changed = png;
    changed[at] = static_cast<char>(changed[at] ^ 0x55);
    (void)grey_samples(changed, 20, 10);
  }
}

}  // namespace
}  // namespace ccslice::cli
