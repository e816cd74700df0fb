// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/volumes/image_stack.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "tests/client/cli/volume_pictures.h"
#include "tests/core/mesh/expect_error.h"
#include "tests/core/volume_files/volume_bytes.h"
#include "tests/support/temporary_folder.h"

namespace ccslice::cli {
namespace {

using testing::ElementsAre;

class ImageStack : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  void write(const std::string& name, const std::vector<std::uint8_t>& bytes) const {
    std::ofstream(path(name), std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }

  TemporaryFolder folder_;
};

TEST_F(ImageStack, HasALayerOfEachPicture) {
  write_picture(path("a.png"), 3, {1, 2, 3, 4, 5, 6});
  write_picture(path("b.png"), 3, {7, 8, 9, 10, 11, 12});
  const VolumeFile file = read_image_stack({path("a.png"), path("b.png")});
  EXPECT_EQ(file.shape, (VolumeShape{.samples = {3, 2, 2}}));
  EXPECT_THAT(numbers_of(file), ElementsAre(1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12));
}

TEST_F(ImageStack, KeepsSixteenBitsAndExpandsOne) {
  const std::string words = raw<std::uint16_t>({0, 258, 65535});
  write_picture(path("a.png"), 3, {words.begin(), words.end()}, SampleType::kUint16);
  EXPECT_THAT(numbers_of(read_image_stack({path("a.png")})), ElementsAre(0, 258, 65535));
  const std::vector<std::uint8_t> bits = {0b01000000};
  SampleImage image;
  image.width = 3;
  image.height = 1;
  image.samples = bits;
  write("b.png", PngEncoder().grey(image, {}));
  EXPECT_THAT(numbers_of(read_image_stack({path("b.png")})), ElementsAre(0, 255, 0));
}

TEST_F(ImageStack, KeepsColoursThatAreTransparent) {
  const std::vector<std::uint8_t> samples = {200, 100}, inside = {0b10000000};
  SampleImage image;
  image.type = SampleType::kUint8;
  image.width = 2;
  image.height = 1;
  image.samples = samples;
  image.inside = inside;
  write("a.png", PngEncoder().grey_alpha(image, {}));
  EXPECT_THAT(numbers_of(read_image_stack({path("a.png")})), ElementsAre(200, 255, 100, 0));
}

TEST_F(ImageStack, SaysWhatIsWrong) {
  write_picture(path("a.png"), 3, {1, 2, 3});
  write_picture(path("b.png"), 2, {1, 2});
  write("c.png", {0x89, 'P', 'N', 'G', 'x'});
  std::ifstream whole(path("a.png"), std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(whole)), std::istreambuf_iterator<char>());
  for (const std::size_t length : {std::size_t{0}, bytes.size() / 2, bytes.size() - 20}) {
    const std::string part = bytes.substr(0, length);
    write("d.png", {part.begin(), part.end()});
    expect_error([&] { (void)read_image_stack({path("d.png")}); }, ErrorCode::kFileSyntax, "d.png");
  }
  expect_error(
      [&] {
        (void)read_image_stack({path("a.png"), path("b.png")});
      },
      ErrorCode::kFileSyntax, "2 x 1 pixels of 1 x 8 bits, and the first picture is 3 x 1");
  expect_error([&] { (void)read_image_stack({path("c.png")}); }, ErrorCode::kFileSyntax, "not a PNG picture");
  expect_error([&] { (void)read_image_stack({path("none.png")}); }, ErrorCode::kFileUnreadable, "none.png");
}

}  // namespace
}  // namespace ccslice::cli
