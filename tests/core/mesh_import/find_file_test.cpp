// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/find_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <string>

namespace ccslice {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::IsEmpty;

class FindFiles : public testing::Test {
 protected:
  FindFiles() {
    fs::create_directories(folder_ / "Sub");
    write("Sub/mesh.inp");
  }
  ~FindFiles() override { fs::remove_all(folder_); }
  void write(const std::string& name) const { std::ofstream(folder_ / name) << name; }

  const fs::path folder_ = fs::path(testing::TempDir()) / ("ccslice_find_files_" + std::to_string(getpid()));
};

TEST_F(FindFiles, TakeSlashesAndBackslashesInAnyCase) {
  for (const char* name :
       {"Sub/mesh.inp", "Sub\\mesh.inp", "sub/MESH.INP", ".\\SUB\\Mesh.Inp", "Sub\\..\\sub\\mesh.inp"}) {
    const auto found = find_files(folder_, name);
    ASSERT_EQ(found.size(), 1u) << name;
    EXPECT_TRUE(fs::equivalent(found[0], folder_ / "Sub/mesh.inp")) << name;
  }
  const std::string absolute = (folder_ / "sub").string() + "/MESH.inp";
  EXPECT_EQ(find_files("elsewhere", absolute).size(), 1u);
}

TEST_F(FindFiles, PreferTheNameAsWritten) {
  write("Sub/MESH.INP");
  write("Sub\\mesh.inp");
  EXPECT_THAT(find_files(folder_, "Sub/mesh.inp"), ElementsAre(folder_ / "Sub/mesh.inp"));
  EXPECT_THAT(find_files(folder_, "Sub/MESH.INP"), ElementsAre(folder_ / "Sub/MESH.INP"));
  EXPECT_THAT(find_files(folder_, "Sub\\mesh.inp"), ElementsAre(folder_ / "Sub\\mesh.inp"));
  EXPECT_THAT(find_files(folder_, "Sub/Mesh.inp"), ElementsAre(folder_ / "Sub/MESH.INP", folder_ / "Sub/mesh.inp"));
}

TEST_F(FindFiles, FindNoFoldersAndNothingThatIsNotThere) {
  EXPECT_THAT(find_files(folder_, "sub"), IsEmpty());
  EXPECT_THAT(find_files(folder_, "Sub\\other.inp"), IsEmpty());
  EXPECT_THAT(find_files(folder_ / "none", "mesh.inp"), IsEmpty());
  EXPECT_THAT(find_files(folder_, ""), IsEmpty());
  std::string around;
  for (int i = 0; i < 100'000; ++i) around += "./";
  EXPECT_THAT(find_files(folder_, around + "Sub/mesh.inp"), IsEmpty()) << "longer than any path";
}

TEST_F(FindFiles, AreThoseBelowAllowedFolders) {
  FileOrigin origin;
  origin.path = (folder_ / "Sub" / "job.inp").string();
  const fs::path sub = folder_ / "Sub";
  write("beside.inp");
  EXPECT_THAT(NamedFiles(origin).find(sub, "MESH.inp").files, ElementsAre(fs::canonical(sub / "mesh.inp")));
  for (const char* outside : {"../beside.inp", "..\\none.inp", "/etc/passwd", "/etc/none"}) {
    const NamedFiles::Found found = NamedFiles(origin).find(sub, outside);
    EXPECT_TRUE(found.files.empty() && found.is_outside) << outside << " whether it is there or not";
  }
  const NamedFiles::Found none = NamedFiles(origin).find(sub, "none.inp");
  EXPECT_TRUE(none.files.empty() && !none.is_outside);
  fs::create_symlink(folder_ / "beside.inp", sub / "link.inp");
  EXPECT_TRUE(NamedFiles(origin).find(sub, "link.inp").is_outside);
  origin.includes = folder_.string();
  EXPECT_THAT(NamedFiles(origin).find(sub, "../beside.inp").files, ElementsAre(fs::canonical(folder_ / "beside.inp")));
}

}  // namespace
}  // namespace ccslice
