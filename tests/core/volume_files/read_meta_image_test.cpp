// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/volume_files/read_meta_image.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "tests/core/mesh/expect_error.h"
#include "tests/core/volume_files/volume_bytes.h"
#include "tests/support/temporary_folder.h"

namespace ccslice {
namespace {

using testing::ElementsAre;

const std::string kMetaHead = "ObjectType = Image\nNDims = 3\nDimSize = 3 2 1\nElementType = MET_SHORT\n";
const std::string kLocal = "ElementDataFile = LOCAL\n";

VolumeFile meta_of(const std::string& text) { return read_meta_image(text, ""); }

TEST(ReadMetaImage, ReadsBinaryTextAndPackedSamples) {
  expect_six_samples(
      meta_of(kMetaHead + "BinaryData = True\nBinaryDataByteOrderMSB = False\n" + kLocal + six_samples()));
  expect_six_samples(
      meta_of(kMetaHead + "BinaryDataByteOrderMSB = True\n" + kLocal + raw<std::int16_t>({1, 2, 3, -4, 5, 600}, true)));
  expect_six_samples(meta_of(kMetaHead + "CompressedData = True\n" + kLocal + zlibbed(six_samples())));
  expect_six_samples(meta_of(kMetaHead + "BinaryData = False\n" + kLocal + "1 2 3 -4 5 600\n"));
}

TEST(ReadMetaImage, ReadsAFileOfItsOwn) {
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "a.raw") << "HEAD" << six_samples();
  const std::string path = (folder.path() / "a.mhd").string();
  expect_six_samples(read_meta_image(kMetaHead + "HeaderSize = 4\nElementDataFile = a.raw\n", path));
  expect_six_samples(read_meta_image(kMetaHead + "HeaderSize = -1\nElementDataFile = a.raw\n", path));
  expect_error([&] { (void)read_meta_image(kMetaHead + "ElementDataFile = ../b.raw\n", path); },
               ErrorCode::kFileUnsupported, "b.raw");
  expect_error([&] { (void)read_meta_image(kMetaHead + "ElementDataFile = LIST\na\n", path); },
               ErrorCode::kFileUnsupported, "several files");
  expect_error([&] { (void)read_meta_image(kMetaHead + "ElementDataFile = a.%03d 1 9 1\n", path); },
               ErrorCode::kFileUnsupported, "several files");
}

TEST(ReadMetaImage, LiesInLps) {
  const VolumeFile file = meta_of(kMetaHead +
                                  "TransformMatrix = 0 1 0 -1 0 0 0 0 1\nOffset = 10 20 30\n"
                                  "ElementSpacing = 0.5 2 3\n" +
                                  kLocal + six_samples());
  EXPECT_TRUE(file.is_lps);
  // Axis 0 goes along y, axis 1 against x.
  EXPECT_TRUE((*file.mm_of_index * Vec3(1, 1, 1)).isApprox(Vec3(10 - 2, 20 + 0.5, 33)));
  EXPECT_FALSE(meta_of(kMetaHead + kLocal + six_samples()).mm_of_index.has_value());
  EXPECT_TRUE((*meta_of(kMetaHead + "ElementSize = 1 2 3\n" + kLocal + six_samples()).mm_of_index * Vec3(1, 1, 1))
                  .isApprox(Vec3(1, 2, 3)));
}

TEST(ReadMetaImage, HasChannels) {
  const VolumeFile file = meta_of(
      "NDims = 2\nDimSize = 2 1\nElementNumberOfChannels = 3\nElementType = MET_UCHAR_ARRAY\n" + kLocal + "abcdef");
  EXPECT_EQ(file.shape.channels, 3u);
  EXPECT_EQ(file.shape.samples, (std::array<std::uint32_t, 3>{2, 1, 1}));
  EXPECT_THAT(numbers_of(file), ElementsAre('a', 'b', 'c', 'd', 'e', 'f'));
}

TEST(ReadMetaImage, SaysWhatIsWrong) {
  const auto refuses = [](const std::string& text, ErrorCode code, const std::string& part) {
    expect_error([&] { (void)meta_of(text); }, code, part);
  };
  const ErrorCode syntax = ErrorCode::kFileSyntax, unsupported = ErrorCode::kFileUnsupported;
  refuses("ObjectType = Tube\n", unsupported, "Tube");
  refuses("NDims = 3\nDimSize = 3 2\nElementType = MET_CHAR\n" + kLocal, syntax, "DimSize");
  refuses("NDims = 4\nDimSize = 3 2 1 1\nElementType = MET_CHAR\n" + kLocal, unsupported, "NDims");
  refuses("NDims = 3\nElementType = MET_NONE\n", syntax, "MET_NONE");
  refuses("NDims = 3\n" + kLocal, syntax, "lacks DimSize");
  refuses("NDims = 3\nwhat\n", syntax, "line 2: expected KEY = VALUE");
  refuses("NDims = 3\nBinaryData = maybe\n", syntax, "True or False");
  refuses(kMetaHead + "Offset = 1 2\n" + kLocal + six_samples(), syntax, "Offset: expected 3");
  refuses(kMetaHead + kLocal + six_samples().substr(1), syntax, "11 bytes of samples, and the header promises 12");
  refuses(kMetaHead + "CompressedData = True\n" + kLocal + six_samples(), syntax, "can't be unpacked");
}

}  // namespace
}  // namespace ccslice
