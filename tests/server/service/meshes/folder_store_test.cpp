// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/meshes/folder_store.h"

#include <gtest/gtest.h>

#include <fstream>
#include <thread>

#include "server/service/meshes/mesh_id.h"
#include "tests/server/service/stored_bytes.h"
#include "tests/support/temporary_folder.h"

namespace ccslice::server {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

class FolderStoreTest : public ::testing::Test {
 protected:
  static std::string write(FolderStore& store, const std::string& bytes) {
    const std::string id = mesh_id_of(bytes);
    store.write(id, {bytes.substr(0, bytes.size() / 2), bytes.substr(bytes.size() / 2)}, [] {});
    return id;
  }
  fs::path path_of(const std::string& id) const {
    const std::string digits = id.substr(7);
    return folder_ / digits.substr(0, 2) / digits.substr(2, 2) / digits;
  }
  void make_old(const std::string& id, std::chrono::hours age) const {
    fs::last_write_time(path_of(id), fs::file_time_type::clock::now() - age);
  }

  const TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path();
};

TEST_F(FolderStoreTest, GivesBackWhatWasWritten) {
  FolderStore store(folder_ / "made" / "by it", 1 << 20);
  EXPECT_FALSE(store.contains(mesh_id_of("one")));
  const std::string id = write(store, "one");
  EXPECT_TRUE(store.contains(id));
  EXPECT_EQ(stored_bytes(store, id), "one");
  FolderStore other(folder_ / "made" / "by it", 1 << 20);
  EXPECT_EQ(stored_bytes(other, id), "one");
  EXPECT_TRUE(other.erase(id));
  EXPECT_FALSE(store.erase(id));
  EXPECT_EQ(stored_bytes(store, id), std::nullopt);
}

TEST_F(FolderStoreTest, DropsTheLeastRecentlyUsed) {
  FolderStore store(folder_, 100);
  const std::string first = write(store, std::string(40, 'a')), second = write(store, std::string(40, 'b'));
  make_old(first, 3h);
  make_old(second, 2h);
  EXPECT_TRUE(store.contains(first));  // Used now.
  const std::string third = write(store, std::string(40, 'c'));
  EXPECT_TRUE(store.contains(first));
  EXPECT_FALSE(store.contains(second));
  EXPECT_TRUE(store.contains(third));
  make_old(third, 1h);
  EXPECT_EQ(store.last_used(10, [] {}), (std::vector<std::string>{first, third}));
  EXPECT_EQ(store.last_used(1, [] {}), (std::vector<std::string>{first}));
  EXPECT_THROW(write(store, std::string(101, 'd')), StoreError);
  EXPECT_TRUE(store.contains(first));
}

TEST_F(FolderStoreTest, LeavesStrangersAlone) {
  FolderStore store(folder_, 100);
  std::ofstream(folder_ / "README") << std::string(200, 'x');
  const std::string id = mesh_id_of("a link");
  fs::create_directories(path_of(id).parent_path());
  fs::create_symlink(folder_ / "README", path_of(id));
  EXPECT_FALSE(store.contains(id));
  EXPECT_EQ(stored_bytes(store, id), std::nullopt);
  const std::string folder_id = mesh_id_of("a folder");
  fs::create_directories(path_of(folder_id));
  EXPECT_FALSE(store.contains(folder_id));
  EXPECT_FALSE(store.erase(folder_id));
  EXPECT_THROW(write(store, "a folder"), StoreError);
  write(store, std::string(90, 'a'));
  write(store, std::string(90, 'b'));
  EXPECT_TRUE(fs::exists(folder_ / "README"));
  EXPECT_TRUE(fs::is_symlink(path_of(id)));
  write(store, "a link");  // In the link's place, not in the file's that it names.
  EXPECT_EQ(stored_bytes(store, id), "a link");
  EXPECT_EQ(fs::file_size(folder_ / "README"), 200u);
}

TEST_F(FolderStoreTest, DropsWhatWasLeftHalfWritten) {
  FolderStore store(folder_, 100);
  const std::string id = write(store, "whole");
  const auto leave = [&](const std::string& name) {
    std::ofstream(path_of(id).parent_path() / name) << "half";
    return path_of(id).parent_path() / name;
  };
  const fs::path abandoned = leave("." + id.substr(7) + ".abcdef.tmp"),
                 young = leave("." + id.substr(7) + ".ghijkl.tmp"), strangers = leave(".session.tmp");
  for (const fs::path& path : {abandoned, strangers}) {
    fs::last_write_time(path, fs::file_time_type::clock::now() - 2h);
  }
  EXPECT_EQ(store.last_used(10, [] {}).size(), 1u);
  EXPECT_FALSE(fs::exists(abandoned));
  EXPECT_TRUE(fs::exists(young));
  EXPECT_TRUE(fs::exists(strangers));
}

TEST_F(FolderStoreTest, NoticesThatItsFolderHasGone) {
  FolderStore store(folder_ / "made", 100);
  store.check();
  EXPECT_TRUE(fs::is_empty(folder_ / "made")) << "a check leaves nothing";
  fs::remove(folder_ / "made");
  EXPECT_THROW(store.check(), StoreError);
  fs::create_directory(folder_ / "made");
  store.check();
}

TEST_F(FolderStoreTest, RefusesFoldersThatTakeNoFiles) {
  std::ofstream(folder_ / "file") << "x";
  try {
    const FolderStore store(folder_ / "file", 100);
    ADD_FAILURE();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("--mesh-store: files can't be made in"), std::string::npos);
  }
}

TEST_F(FolderStoreTest, ManyMayWriteTheSameMesh) {
  const std::string bytes(1 << 20, 'm');
  const std::string id = mesh_id_of(bytes);
  std::vector<std::thread> writers;
  for (int i = 0; i < 4; ++i) {
    writers.emplace_back([&] {
      FolderStore store(folder_, 1 << 30);
      for (int round = 0; round < 5; ++round) {
        write(store, bytes);
        EXPECT_EQ(stored_bytes(store, id), bytes);
      }
    });
  }
  for (std::thread& writer : writers) writer.join();
  std::size_t files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder_)) files += entry.is_regular_file() ? 1 : 0;
  EXPECT_EQ(files, 1u);
}

}  // namespace
}  // namespace ccslice::server
