// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/volume_files/data_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/core/mesh/expect_error.h"
#include "tests/support/temporary_folder.h"

namespace ccslice {
namespace {

TEST(DataFile, IsReadFromTheHeadersFolderAlone) {
  const TemporaryFolder folder;
  const std::filesystem::path inner = folder.path() / "inner";
  std::filesystem::create_directories(inner / "below");
  std::ofstream(inner / "a.raw") << "abc";
  std::ofstream(inner / "below" / "b.raw") << "def";
  std::ofstream(folder.path() / "secret") << "secret";
  std::filesystem::create_symlink(folder.path() / "secret", inner / "link");
  const std::string header = (inner / "a.nhdr").string();
  EXPECT_EQ(read_data_file(header, "a.raw", 100), "abc");
  EXPECT_EQ(read_data_file(header, "./A.RAW", 100), "abc");
  EXPECT_EQ(read_data_file(header, "below/b.raw", 100), "def");
  for (const std::string name : {"../secret", "/etc/passwd", "link", "/etc/nothing"}) {
    expect_error([&] { (void)read_data_file(header, name, 100); }, ErrorCode::kFileUnsupported,
                 "isn't in the header's folder");
  }
  expect_error([&] { (void)read_data_file(header, "c.raw", 100); }, ErrorCode::kFileUnreadable, "c.raw");
  expect_error([&] { (void)read_data_file(header, "http://host/a.raw", 100); }, ErrorCode::kFileUnreadable, "http");
  expect_error([&] { (void)read_data_file("", "a.raw", 100); }, ErrorCode::kFileUnsupported, "another file");
  expect_error([&] { (void)read_data_file(header, "a.raw", 2); }, ErrorCode::kMeshTooLarge, "");
}

}  // namespace
}  // namespace ccslice
