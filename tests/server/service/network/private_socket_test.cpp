// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/network/private_socket.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <thread>

namespace ccslice::server {
namespace {

namespace fs = std::filesystem;

fs::path folder_of(const PrivateSocket& socket) {
  EXPECT_TRUE(socket.address().starts_with("unix:/")) << socket.address();
  return fs::path(socket.address().substr(5)).parent_path();
}

TEST(PrivateSocket, IsInAFolderOfItsOwnThatOthersCantEnter) {
  const PrivateSocket one, other;
  EXPECT_NE(one.address(), other.address());
  struct stat status = {};
  ASSERT_EQ(stat(folder_of(one).c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 07777, 0700u);
  EXPECT_EQ(status.st_uid, geteuid());
}

TEST(PrivateSocket, LeavesNothingBehind) {
  fs::path folder;
  {
    const PrivateSocket socket;
    folder = folder_of(socket);
    EXPECT_TRUE(fs::is_directory(folder));
  }
  EXPECT_FALSE(fs::exists(folder));
}

TEST(PrivateSocket, SaysWhichNameIsTooLong) {
  const fs::path deep = fs::temp_directory_path() / ("ccslice_" + std::string(100, 'd'));
  fs::create_directories(deep);
  const char* const before = std::getenv("TMPDIR");
  const std::string kept = before == nullptr ? "" : before;
  setenv("TMPDIR", deep.c_str(), 1);
  try {
    const PrivateSocket socket;
    ADD_FAILURE() << socket.address();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("set TMPDIR"), std::string::npos) << error.what();
  }
  EXPECT_TRUE(fs::is_empty(deep));
  kept.empty() ? unsetenv("TMPDIR") : setenv("TMPDIR", kept.c_str(), 1);
  fs::remove_all(deep);
}

TEST(PrivateSocket, WaitsUntilTheOtherEndIsClosed) {
  std::array<int, 2> ends;
  ASSERT_EQ(pipe(ends.data()), 0);
  bool over = false;
  std::thread waiting([&] {
    wait_for_end_of_input(ends[0]);
    over = true;
  });
  EXPECT_EQ(write(ends[1], "ignored", 7), 7);
  close(ends[1]);
  waiting.join();
  EXPECT_TRUE(over);
  close(ends[0]);
}

}  // namespace
}  // namespace ccslice::server
