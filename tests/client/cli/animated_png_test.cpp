// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/pictures/animated_png.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "core/output/png.h"
#include "tests/core/output/tiny_png.h"

namespace ccslice::cli {
namespace {

using testing::ElementsAre;

TinyPng read(const std::string& file) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(file.data());
  return read_tiny_png({bytes, file.size()});
}

/// 5 x 4 pixels of one colour.
std::string frame_of(std::uint8_t grey) {
  const std::vector<std::uint8_t> rgba(std::size_t{4} * 5 * 4, grey);
  const std::vector<std::uint8_t> file = PngEncoder().true_colours(5, 4, rgba, {});
  return {file.begin(), file.end()};
}

/// The data of the n-th chunk of a type.
std::string chunk(const std::string& file, const std::string& type, int n) {
  std::size_t at = 8;
  while (at < file.size()) {
    std::size_t size = 0;
    for (std::size_t i = 0; i < 4; ++i) size = size << 8 | static_cast<std::uint8_t>(file[at + i]);
    if (file.compare(at + 4, 4, type) == 0 && n-- == 0) return file.substr(at + 8, size);
    at += 12 + size;
  }
  return {};
}

TEST(AnimatedPng, HoldsTheFramesOneAfterTheOther) {
  const std::vector<std::string> frames = {frame_of(10), frame_of(20), frame_of(30)};
  const std::string file = animated_png(frames, 80);
  const TinyPng png = read(file);
  EXPECT_THAT(png.chunks, ElementsAre("IHDR", "acTL", "fcTL", "IDAT", "fcTL", "fdAT", "fcTL", "fdAT", "IEND"));
  EXPECT_EQ(png.samples, read(frames[0]).samples) << "what programs without animation show";
  EXPECT_EQ(chunk(file, "acTL", 0), std::string("\0\0\0\3\0\0\0\0", 8));
  EXPECT_EQ(chunk(file, "fcTL", 0), std::string("\0\0\0\0"
                                                "\0\0\0\5\0\0\0\4"
                                                "\0\0\0\0\0\0\0\0"
                                                "\0\x50\3\xe8"
                                                "\0\0",
                                                26));
  EXPECT_EQ(chunk(file, "fcTL", 2).substr(0, 4), std::string("\0\0\0\3", 4)) << "numbers go through both kinds";
  EXPECT_EQ(chunk(file, "fdAT", 1), std::string("\0\0\0\4", 4) + chunk(frames[2], "IDAT", 0));
}

TEST(AnimatedPng, OfOneFrameIsAnAnimationToo) {
  const std::string frame = frame_of(7);
  EXPECT_THAT(read(animated_png({&frame, 1}, 10)).chunks, ElementsAre("IHDR", "acTL", "fcTL", "IDAT", "IEND"));
}

}  // namespace
}  // namespace ccslice::cli
