// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <numeric>
#include <thread>

#include "core/output/png.h"

namespace ccslice {
namespace {

template <class Sample>
std::vector<Sample> read_with_openimageio(const std::vector<std::uint8_t>& file, OIIO::TypeDesc type) {
  OIIO::Filesystem::IOMemReader source(file.data(), file.size());
  const auto input = OIIO::ImageInput::open("layer.png", nullptr, &source);
  if (!input) return {};
  EXPECT_EQ(input->spec().nchannels, 1);
  EXPECT_EQ(input->spec().format, type);
  std::vector<Sample> samples(std::size_t(input->spec().width) * input->spec().height);
  EXPECT_TRUE(input->read_image(0, 0, 0, 1, type, samples.data()));
  return samples;
}

TEST(PngOfOpenImageIo, ReadsBackBytes) {
  std::vector<std::uint8_t> samples(321 * 45);
  std::iota(samples.begin(), samples.end(), 0);
  EXPECT_EQ(read_with_openimageio<std::uint8_t>(encode_grey_png(321, 45, 1, samples, {}), OIIO::TypeDesc::UINT8),
            samples);
}

TEST(PngOfOpenImageIo, ReadsBackWords) {
  std::vector<std::uint16_t> samples(321 * 45);
  std::iota(samples.begin(), samples.end(), 65000);
  const std::span<const std::uint8_t> bytes(reinterpret_cast<const std::uint8_t*>(samples.data()), 2 * samples.size());
  EXPECT_EQ(read_with_openimageio<std::uint16_t>(encode_grey_png(321, 45, 2, bytes, {}), OIIO::TypeDesc::UINT16),
            samples);
}

TEST(PngOfOpenImageIo, WidePicturesAreWrittenInBands) {
  for (const std::uint32_t width : {1u, 7u, 65'536u, 1'000'000u}) {
    std::vector<std::uint16_t> samples(std::size_t{width} * 5);
    std::iota(samples.begin(), samples.end(), 0);
    const std::span<const std::uint8_t> bytes(reinterpret_cast<const std::uint8_t*>(samples.data()),
                                              2 * samples.size());
    const std::vector<std::uint8_t> file = encode_grey_png(width, 5, 2, bytes, {});
    EXPECT_EQ(read_with_openimageio<std::uint16_t>(file, OIIO::TypeDesc::UINT16), samples);
  }
}

TEST(PngOfOpenImageIo, IsTheSameOnAnyThread) {
  std::vector<std::uint8_t> samples(640 * 480);
  std::iota(samples.begin(), samples.end(), 0);
  const std::vector<std::uint8_t> here = encode_grey_png(640, 480, 1, samples, {});
  std::vector<std::vector<std::uint8_t>> there(4);
  std::vector<std::jthread> threads;
  for (auto& file : there) threads.emplace_back([&] { file = encode_grey_png(640, 480, 1, samples, {}); });
  threads.clear();
  for (const auto& file : there) EXPECT_EQ(file, here);
}

}  // namespace
}  // namespace ccslice
