// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/tray/tray_writer.h"

#include <gtest/gtest.h>

#include <string>

#include "client/cli/tray/tray_package.h"
#include "tests/client/cli/package_files.h"
#include "tests/support/temporary_folder.h"

namespace ccslice::cli {
namespace {

TEST(TrayWriter, WritesWhatIsReadAgainToTheLastBit) {
  client::Surface surface;
  surface.points_mm = {{0.1, 1.0 / 3, -7e-9}, {100, 0, 0}, {0, 100, 0}, {0, 0, 100}};
  surface.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  Placement placement = motion(Vec3(1, 2, 3), 77, Vec3(120.3, 240, -10));
  placement.linear() *= 1.5;
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "tray.3mf";
  const std::uint64_t bytes =
      write_tray({{"a <b>", surface, {placement, Placement::Identity()}}, {"c", surface, {placement}}}, path);
  EXPECT_EQ(bytes, std::filesystem::file_size(path));
  const TrayPackage package = read_tray_package(path, 1 << 20);
  ASSERT_EQ(package.instances.size(), 3u);
  EXPECT_EQ(package.instances[0].name, "a <b>");
  EXPECT_EQ(package.instances[1].label, "object 1 'a <b>' (copy 2)");
  EXPECT_EQ(package.instances[2].name, "c");
  EXPECT_EQ(package.instances[0].placement.matrix(), placement.matrix());
  EXPECT_EQ(package.instances[1].placement.matrix(), Placement::Identity().matrix());
  ASSERT_EQ(package.instances[0].points->size(), 4u);
  EXPECT_EQ(package.instances[0].points->at(0), Vec3(0.1, 1.0 / 3, -7e-9));
}

}  // namespace
}  // namespace ccslice::cli
