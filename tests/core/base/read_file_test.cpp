// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/base/read_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "core/base/error.h"

namespace ccslice {
namespace {

namespace fs = std::filesystem;

ErrorCode code_of(const std::string& path, std::uint64_t max_bytes) {
  try {
    read_file_bytes(path, max_bytes);
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find(path), std::string::npos) << error.what();
    return error.code();
  }
  ADD_FAILURE() << path << " is read";
  return ErrorCode::kInternal;
}

TEST(ReadFile, ReturnsAllBytesUpToTheLimit) {
  const std::string path = (fs::path(testing::TempDir()) / "ccslice_read_file").string();
  const std::string bytes("a\0b\r\n\xff", 6);
  std::ofstream(path, std::ios::binary) << bytes;
  EXPECT_EQ(read_file_bytes(path, 6), bytes);
  EXPECT_EQ(code_of(path, 5), ErrorCode::kMeshTooLarge);
  fs::resize_file(path, std::uintmax_t{3} << 40);  // Sparse: nothing of it is read.
  EXPECT_EQ(code_of(path, std::uint64_t{8} << 30), ErrorCode::kMeshTooLarge);
  fs::remove(path);
}

TEST(ReadFile, NamesWhatCannotBeRead) {
  EXPECT_EQ(code_of("/no/such/file", 10), ErrorCode::kFileUnreadable);
  EXPECT_EQ(code_of(testing::TempDir(), 10), ErrorCode::kFileUnreadable);
  EXPECT_EQ(code_of("/dev/zero", 10), ErrorCode::kFileUnreadable);
}

}  // namespace
}  // namespace ccslice
