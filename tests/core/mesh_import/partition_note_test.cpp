// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/partition_note.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace ccslice {
namespace {

namespace fs = std::filesystem;

class PartitionNote : public testing::Test {
 protected:
  PartitionNote() : folder_(fs::path(testing::TempDir()) / "ccslice_partition_note") {
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "pieces");
  }
  ~PartitionNote() override { fs::remove_all(folder_); }

  void write(const std::string& name, const std::string& text = "") const { std::ofstream(folder_ / name) << text; }
  std::vector<std::string> notes_of(const std::string& name) const {
    MeshFile file;
    add_partition_note((folder_ / name).string(), file);
    return file.warnings;
  }

  const fs::path folder_;
};

TEST_F(PartitionNote, NamesThePvtuThatHasThePiece) {
  write("part.pvtu", "<Piece Source=\"pieces/a.vtu\"/><Piece Source=\"pieces/b.vtu\"/>");
  write("pieces/a.vtu");
  EXPECT_THAT(notes_of("pieces/a.vtu"),
              testing::ElementsAre(testing::HasSubstr(
                  "this is one piece of 'part.pvtu' only, and not the whole part: give that file instead")));
  EXPECT_TRUE(notes_of("pieces/c.vtu").empty()) << "not in it";
  write("part.pvtu", "<Piece Source=\"pieces/a.vtu\"/>");
  EXPECT_TRUE(notes_of("pieces/a.vtu").empty()) << "the only one";
}

TEST_F(PartitionNote, NamesTheFirstByNameAndWaitsForNoPipe) {
  for (int piece = 9; piece >= 0; --piece) write("part_" + std::to_string(piece) + ".vtu");
  ASSERT_EQ(mkfifo((folder_ / "part.pvtu").c_str(), 0600), 0);
  EXPECT_THAT(notes_of("part_5.vtu"), testing::ElementsAre(testing::HasSubstr("'part_0.vtu' stands beside it")));
}

TEST_F(PartitionNote, NamesFilesThatDifferByTheirNumber) {
  for (const char* name : {"part_0.vtu", "part_1.vtu", "other_0.vtu", "u_p0.vtu", "u_p1.vtu", "x0.vtu", "x1.vtu"})
    write(name);
  EXPECT_THAT(notes_of("part_0.vtu"), testing::ElementsAre(testing::HasSubstr("'part_1.vtu' stands beside it")));
  EXPECT_THAT(notes_of("u_p1.vtu"), testing::ElementsAre(testing::HasSubstr("'u_p0.vtu' stands beside it")));
  for (const char* alone : {"other_0.vtu", "x0.vtu", "none.vtu"}) EXPECT_TRUE(notes_of(alone).empty()) << alone;
  EXPECT_TRUE(notes_of("nowhere/part_0.vtu").empty());
}

}  // namespace
}  // namespace ccslice
