// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// `slice --format grabcad`: what GrabCAD Voxel Print takes, and what it doesn't.

#include "client/cli/output/grabcad.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <map>
#include <string>
#include <vector>

#include "client/cli/base/exit_codes.h"
#include "client/cli/options/resins.h"
#include "core/base/types.h"
#include "tests/client/command_line.h"

namespace ccslice::client {
namespace {

using testing::HasSubstr;
using testing::Not;

class Grabcad : public CommandLine {
 protected:
  /// The box by height: soft at the bottom, hard at the top, in layers of half its height.
  std::vector<std::string> job(const std::string& output, const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words = {"slice",
                                      box_,
                                      "--grade=g=z:0..1",
                                      "--dpi=60,30",
                                      "--layer-height=0.1",
                                      "--format=grabcad",
                                      "--map=blend:g:0=VeroCY-V,1=VeroMGT-V",
                                      "-o",
                                      path(output)};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  const std::vector<std::string> two_ = {"--material=VeroCY-V", "--material=VeroMGT-V"};

  /// The width, the height, and what follows them in the header of a PNG file: bits, colour type, ...
  static std::array<std::uint32_t, 4> png_header(const std::string& bytes) {
    const auto number = [&](std::size_t at) {
      std::uint32_t value = 0;
      for (std::size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes.at(at + i));
      return value;
    };
    return {number(16), number(20), static_cast<unsigned char>(bytes.at(24)), static_cast<unsigned char>(bytes.at(25))};
  }
};

TEST_F(Grabcad, AFolderHasPicturesFromZeroWithoutGaps) {
  const ProcessResult result = run(job("out", two_));
  ASSERT_EQ(result.exit_code, cli::kExitOk) << result.err;
  const auto layers =
      static_cast<std::size_t>(json_at(read_whole(path("out/manifest.json")), "grid.layers").number_value());
  ASSERT_GT(layers, 9u) << "numbers of one and of two digits";
  const std::array<std::uint32_t, 4> first = png_header(read_whole(path("out/slice_0.png")));
  for (std::size_t layer = 0; layer < layers; ++layer) {
    const std::string picture = read_whole(path("out/slice_" + std::to_string(layer) + ".png"));
    ASSERT_FALSE(picture.empty()) << layer;
    EXPECT_EQ(png_header(picture), first) << layer;
  }
  EXPECT_EQ(first[2], 8u) << "bits";
  EXPECT_EQ(first[3], 6u) << "RGBA";
  EXPECT_EQ(files_in("out"), layers + 2) << "the contact sheet and the manifest, too";
  EXPECT_EQ(json_at(read_whole(path("out/manifest.json")), "layout.row_order").string_value(), "descending");
  EXPECT_THAT(result.err, HasSubstr("without --printer"));
  EXPECT_THAT(result.err, Not(HasSubstr("no resins")));
}

TEST_F(Grabcad, TheUsersRowOrderStays) {
  ASSERT_EQ(run(job("out", {two_[0], two_[1], "--row-order=ascending"})).exit_code, cli::kExitOk);
  EXPECT_EQ(json_at(read_whole(path("out/manifest.json")), "layout.row_order").string_value(), "ascending");
}

TEST_F(Grabcad, PartsOfAJobAreNumberedAsTheWhole) {
  ASSERT_EQ(run(job("whole", two_)).exit_code, cli::kExitOk);
  ASSERT_EQ(run(job("part", {two_[0], two_[1], "--layers=3..4"})).exit_code, cli::kExitOk);
  EXPECT_EQ(read_whole(path("part/slice_3.png")), read_whole(path("whole/slice_3.png")));
  EXPECT_FALSE(fs::exists(path("part/slice_0.png")));
  // A region is a job of its own: its first layer is number 0.
  ASSERT_EQ(run(job("region", {two_[0], two_[1], "--box-voxels=0,0,3,2,2,4"})).exit_code, cli::kExitOk);
  EXPECT_TRUE(fs::exists(path("region/slice_0.png")));
  EXPECT_FALSE(fs::exists(path("region/slice_4.png")));
}

TEST_F(Grabcad, AnArchiveIsMadeOfTheFolder) {
  ASSERT_EQ(run(job("out", two_)).exit_code, cli::kExitOk);
  EXPECT_EQ(run({"package", path("out"), "-o", path("out.gcvf")}).exit_code, cli::kExitOk);
}

TEST_F(Grabcad, SixMaterialsAndVoidArePacked) {
  std::vector<std::string> more = {two_[0], two_[1], "--where=g<0.2=void"};
  for (const char* name : {"a=#010101", "b=#020202", "c=#030303", "d=#040404"}) {
    more.push_back("--material=" + std::string(name));
  }
  for (const char* colour : {"", "=#00000000"}) {
    std::vector<std::string> all = more;
    all.push_back("--material=void" + std::string(colour));
    all.push_back("--force");
    const ProcessResult sliced = run(job("out", all));
    ASSERT_EQ(sliced.exit_code, cli::kExitOk) << sliced.err;
    EXPECT_THAT(sliced.err, Not(HasSubstr("'void'"))) << "no resin";
    const ProcessResult packed = run({"package", path("out"), "--force", "-o", path("out.gcvf")});
    EXPECT_EQ(packed.exit_code, cli::kExitOk) << packed.err;
  }
  EXPECT_THAT(run(job("red", {two_[0], two_[1], "--material=void=#ff0000"})).err, HasSubstr("write --material void"));
}

TEST_F(Grabcad, AnotherRunIsRefusedOrReplaces) {
  ASSERT_EQ(run(job("out", two_)).exit_code, cli::kExitOk);
  EXPECT_EQ(run(job("out", two_)).exit_code, cli::kExitOutput);
  ASSERT_EQ(run(job("out", {two_[0], two_[1], "--layers=0..1", "--force"})).exit_code, cli::kExitOk);
  EXPECT_FALSE(fs::exists(path("out/slice_2.png"))) << "the earlier run's";
}

TEST_F(Grabcad, WhatItDoesntTakeIsRefusedByName) {
  const auto refused = [&](const std::vector<std::string>& more, const std::string& said) {
    const ProcessResult result = run(job("out", more));
    EXPECT_EQ(result.exit_code, cli::kExitUsage) << said;
    EXPECT_THAT(result.err, HasSubstr(said));
    EXPECT_FALSE(fs::exists(path("out")));
  };
  for (const char* option : {"--occupancy", "--masks", "--all-channels", "--cell-regions", "--channel=g",
                             "--encoding=png", "--contours=json"}) {
    const std::string name = std::string(option).substr(0, std::string(option).find('='));
    refused({two_[0], two_[1], option}, name);
  }
  refused({two_[0], "--material=VeroMGT-V=#ff00ff80"}, "opaque");
  refused({two_[0], two_[1], "--background=#00000000"}, "opaque");
  refused({two_[0], two_[1], "--material=a=#010101", "--material=b=#020202", "--material=c=#030303",
           "--material=d=#040404", "--material=e=#050505"},
          "at most 6");
  refused({two_[0], "--material=Unknown"}, "Unknown");
  std::vector<std::string> bare = {"slice", box_, "--pitch=1", "--format=grabcad", "-o", path("out")};
  const ProcessResult result = run(bare);
  EXPECT_EQ(result.exit_code, cli::kExitUsage);
  EXPECT_THAT(result.err, HasSubstr("VeroCY-V")) << "the names that it may have";
}

TEST_F(Grabcad, ABackgroundOfAMaterialsColourIsRefused) {
  const ProcessResult result = run(job("out", {two_[0], two_[1], "--background=#00ffff"}));
  EXPECT_EQ(result.exit_code, cli::kExitUsage);
  EXPECT_THAT(result.err, HasSubstr("--material"));
  EXPECT_THAT(result.err, HasSubstr("background"));
  EXPECT_FALSE(fs::exists(path("out")));
}

TEST_F(Grabcad, WarnsOfUnknownNamesAndFewLayers) {
  const ProcessResult result = run({"slice", box_, "--pitch=1", "--format=grabcad", "--material=gum=#ff8800",
                                    "--map=material:gum", "-o", path("out")});
  ASSERT_EQ(result.exit_code, cli::kExitOk) << result.err;
  EXPECT_THAT(result.err, HasSubstr("'gum'"));
  EXPECT_THAT(result.err, HasSubstr("no fewer than 30"));
  EXPECT_EQ(run({"slice", box_, "--pitch=1", "--format=grabcad", "--material=gum=#ff8800", "--map=material:gum",
                 "--quiet", "-o", path("quiet")})
                .err,
            "");
}

TEST(Resins, HaveColoursOfTheirOwn) {
  std::map<std::uint32_t, int> uses;
  for (const char* name : {"VeroCY-V", "VeroMGT-V", "VeroYL-V", "VUltraWhite", "VeroUltraClear", "VeroClear",
                           "VeroPureWht", "VeroBlack", "Agilus30Clr", "Agilus30Wht", "Agilus30Blk"}) {
    const std::optional<std::uint32_t> colour = cli::resin_colour(name);
    ASSERT_TRUE(colour) << name;
    EXPECT_EQ(*colour & 0xff, 0xffu) << name;
    EXPECT_NE(*colour, 0x000000ffu) << name << " is the background";
    EXPECT_EQ(++uses[*colour], 1) << name;
    EXPECT_THAT(cli::resin_names(), HasSubstr(name));
  }
  EXPECT_FALSE(cli::resin_colour("veroCY-V"));
}

}  // namespace
}  // namespace ccslice::client
