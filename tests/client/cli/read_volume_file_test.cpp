// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/volumes/read_volume_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <random>
#include <string>

#include "tests/client/cli/volume_pictures.h"
#include "tests/core/mesh/expect_error.h"
#include "tests/core/volume_files/volume_bytes.h"
#include "tests/support/temporary_folder.h"

namespace ccslice::cli {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class ReadVolumeFile : public testing::Test {
 protected:
  std::string put(const std::string& name, const std::string& bytes) const {
    std::ofstream(path(name), std::ios::binary) << bytes;
    return path(name);
  }
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  VolumeFile read(const std::string& name, const std::string& bytes) const {
    return read_volume_file(put(name, bytes));
  }

  TemporaryFolder folder_;
};

const std::string kNrrd = "NRRD0001\ntype: uchar\ndimension: 3\nsizes: 2 1 1\nencoding: raw\n\nab";
const std::string kMeta = "NDims = 3\nDimSize = 2 1 1\nElementType = MET_UCHAR\nElementDataFile = LOCAL\nab";
const std::string kNpy = std::string("\x93NUMPY\1\0", 8) + raw<std::uint16_t>({57}) +
                         "{'descr': '|u1', 'fortran_order': False, 'shape': (1, 2)}" + "ab";

std::string nifti() {
  std::string bytes(352, '\0');
  bytes.replace(0, 4, raw<std::int32_t>({348}));
  bytes.replace(40, 8, raw<std::int16_t>({3, 2, 1, 1}));
  bytes.replace(70, 2, raw<std::int16_t>({2}));
  bytes.replace(108, 4, raw<float>({352}));
  bytes.replace(344, 3, "n+1");
  return bytes + "ab";
}

TEST_F(ReadVolumeFile, TellsKindsByTheirBytes) {
  for (const std::string& bytes : {kNrrd, kMeta, kNpy, nifti(), gzipped(nifti())}) {
    EXPECT_THAT(numbers_of(read("any", bytes)), ElementsAre('a', 'b'));
  }
}

TEST_F(ReadVolumeFile, TurnsArraysWhereAsked) {
  const VolumeFile file = read_volume_file(put("a.npy", kNpy), {.axes_are_xyz = true});
  EXPECT_EQ(file.shape.samples, (std::array<std::uint32_t, 3>{1, 2, 1}));
}

TEST_F(ReadVolumeFile, ReadsFoldersInTheOrderOfNumbers) {
  for (const int number : {10, 9, 1}) {
    write_picture(path("slice_" + std::to_string(number) + ".png"), 1, {static_cast<std::uint8_t>(number)});
  }
  write_picture(path("slice_002.png"), 1, {2});
  put("notes.txt", "");
  const VolumeFile file = read_volume_file(folder_.path().string());
  EXPECT_THAT(numbers_of(file), ElementsAre(1, 2, 9, 10));
  EXPECT_THAT(file.notes, ElementsAre(HasSubstr("1 files of the folder aren't pictures")));
  write_picture(path("sheet.png"), 2, {7, 7});
  EXPECT_THAT(numbers_of(read_volume_file(path("slice_*.png"))), ElementsAre(1, 2, 9, 10));
  EXPECT_THAT(numbers_of(read_volume_file(path("slice_1*"))), ElementsAre(1, 10));
  expect_error([&] { (void)read_volume_file(path("slice_8*")); }, ErrorCode::kFileUnsupported, "no .png pictures");
}

TEST_F(ReadVolumeFile, NamesTheFileAndTheRemedy) {
  const auto refuses = [&](const std::string& name, const std::string& bytes, ErrorCode code, const std::string& part) {
    put(name, bytes);
    expect_error([&] { (void)read_volume_file(path(name)); }, code, path(name));
    expect_error([&] { (void)read_volume_file(path(name)); }, code, part);
  };
  const ErrorCode unsupported = ErrorCode::kFileUnsupported;
  refuses("a", "what else", unsupported, "save it as .nrrd");
  refuses("a", "", unsupported, "save it as .nrrd");
  refuses("a", std::string(128, '\0') + "DICM", unsupported, "dcm2niix");
  refuses("a", std::string(" BDV") + std::string(100, '\0'), unsupported, "OpenVDB");
  refuses("a", std::string("II*\0", 4) + std::string(100, ' '), unsupported, "a TIFF file");
  refuses("a", gzipped("what else"), unsupported, "save it as .nrrd");
  refuses("a", kNrrd.substr(0, kNrrd.size() - 1), ErrorCode::kFileSyntax, "cut off");
  expect_error([&] { (void)read_volume_file(path("none")); }, ErrorCode::kFileUnreadable, "none");
  std::filesystem::create_directory(path("empty"));
  expect_error([&] { (void)read_volume_file(path("empty")); }, unsupported, "dcm2niix");
}

/// Whatever happens to a file, it is read or refused.
TEST_F(ReadVolumeFile, SurvivesAnyChange) {
  std::mt19937 random(3);
  for (const std::string& bytes : {kNrrd, kMeta, kNpy, nifti(), gzipped(nifti())}) {
    for (int turn = 0; turn < 2000; ++turn) {
      std::string changed = bytes;
      for (int change = 0; change < 3; ++change) {
        const std::size_t at = random() % changed.size();
        switch (random() % 3) {
          case 0: changed[at] = static_cast<char>(random()); break;
          case 1: changed.erase(at, 1 + random() % 4); break;
          default: changed.insert(at, std::string(1 + random() % 3, static_cast<char>('0' + random() % 10)));
        }
        if (changed.empty()) changed = "x";
      }
      try {
        const VolumeFile file = read("changed", changed);
        EXPECT_EQ(file.samples.size(), file.shape.bytes());
      } catch (const Error&) {
      }
    }
  }
}

}  // namespace
}  // namespace ccslice::cli
