// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/volume_files/read_npy.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/core/mesh/expect_error.h"
#include "tests/core/volume_files/volume_bytes.h"

namespace ccslice {
namespace {

using testing::ElementsAre;

std::string npy(const std::string& descr, const std::string& order, const std::string& shape, const std::string& data,
                char version = 1) {
  std::string header = "{'descr': '" + descr + "', 'fortran_order': " + order + ", 'shape': " + shape + ", }";
  header += std::string(64 - (header.size() + 11) % 64, ' ') + "\n";
  const auto length = version == 1 ? raw<std::uint16_t>({static_cast<std::uint16_t>(header.size())})
                                   : raw<std::uint32_t>({static_cast<std::uint32_t>(header.size())});
  return std::string("\x93NUMPY") + version + '\0' + length + header + data;
}

/// Two layers of a row of three.
const std::string kBytes = "abcdef";

TEST(ReadNpy, ReadsLayersFirst) {
  for (const char version : {'\1', '\2', '\3'}) {
    const VolumeFile file = read_npy(npy("|u1", "False", "(2, 1, 3)", kBytes, version));
    EXPECT_EQ(file.shape.samples, (std::array<std::uint32_t, 3>{3, 1, 2}));
    EXPECT_THAT(numbers_of(file), ElementsAre('a', 'b', 'c', 'd', 'e', 'f'));
    EXPECT_FALSE(file.mm_of_index.has_value());
  }
  EXPECT_THAT(numbers_of(read_npy(npy("|u1", "True", "(2, 1, 3)", "adbecf"))),
              ElementsAre('a', 'b', 'c', 'd', 'e', 'f'));
}

TEST(ReadNpy, ReadsXFirst) {
  const VolumeFile file = read_npy(npy("|u1", "False", "(3, 1, 2)", "adbecf"), true);
  EXPECT_EQ(file.shape.samples, (std::array<std::uint32_t, 3>{3, 1, 2}));
  EXPECT_THAT(numbers_of(file), ElementsAre('a', 'b', 'c', 'd', 'e', 'f'));
  EXPECT_THAT(numbers_of(read_npy(npy("|u1", "True", "(3, 1, 2)", kBytes), true)),
              ElementsAre('a', 'b', 'c', 'd', 'e', 'f'));
}

TEST(ReadNpy, ReadsChannelsLast) {
  const VolumeFile file = read_npy(npy("|u1", "False", "(1, 1, 3, 2)", kBytes));
  EXPECT_EQ(file.shape.channels, 2u);
  EXPECT_THAT(numbers_of(file), ElementsAre('a', 'b', 'c', 'd', 'e', 'f'));
  EXPECT_THAT(numbers_of(read_npy(npy("|u1", "True", "(1, 1, 3, 2)", "acebdf"))),
              ElementsAre('a', 'b', 'c', 'd', 'e', 'f'));
}

TEST(ReadNpy, ReadsNumbersOfEachKind) {
  EXPECT_THAT(numbers_of(read_npy(npy("<f4", "False", "(1, 2)", raw<float>({1.5, -2})))), ElementsAre(1.5, -2));
  EXPECT_THAT(numbers_of(read_npy(npy(">f8", "False", "(1, 2)", raw<double>({1.5, -2}, true)))), ElementsAre(1.5, -2));
  EXPECT_THAT(numbers_of(read_npy(npy("<i8", "False", "(1, 2)", raw<std::int64_t>({1, -2})))), ElementsAre(1, -2));
  EXPECT_THAT(numbers_of(read_npy(npy(">u2", "False", "(1, 2)", raw<std::uint16_t>({1, 65535}, true)))),
              ElementsAre(1, 65535));
  EXPECT_THAT(numbers_of(read_npy(npy("|b1", "False", "(1, 2)", std::string("\1\0", 2)))), ElementsAre(1, 0));
}

TEST(ReadNpy, SaysWhatIsWrong) {
  const auto refuses = [](const std::string& text, ErrorCode code, const std::string& part) {
    expect_error([&] { (void)read_npy(text); }, code, part);
  };
  const ErrorCode syntax = ErrorCode::kFileSyntax, unsupported = ErrorCode::kFileUnsupported;
  refuses("\x93NUMPY", syntax, "numpy.save");
  refuses(npy("<f4", "False", "(1, 2)", "").substr(0, 20), syntax, "numpy.save");
  refuses(npy("<f2", "False", "(1, 2)", "1234"), unsupported, "<f2");
  refuses(npy("<c8", "False", "(1, 2)", ""), unsupported, "<c8");
  refuses(npy("<M8[ns]", "False", "(1, 2)", ""), unsupported, "M8");
  refuses(npy("|u1", "Perhaps", "(1, 2)", ""), syntax, "numpy.save");
  refuses(npy("|u1", "False", "(6,)", kBytes), unsupported, "an array of 1 axes");
  refuses(npy("|u1", "False", "()", kBytes), unsupported, "an array of 0 axes");
  refuses(npy("|u1", "False", "(1, 1, 1, 1, 6)", kBytes), unsupported, "an array of 5 axes");
  refuses(npy("|u1", "False", "(1, x, 1)", kBytes), syntax, "whole number");
  refuses(npy("|u1", "False", "(2, 2, 2)", kBytes), syntax, "6 bytes of samples, and the header promises 8");
  refuses(npy("|u1", "False", "(2, 0, 2)", kBytes), ErrorCode::kVolumeInvalid, "samples_j");
  refuses(npy("|u1", "False", "(65536, 65536, 65536)", kBytes), ErrorCode::kMeshTooLarge, "8 GiB");
}

}  // namespace
}  // namespace ccslice
