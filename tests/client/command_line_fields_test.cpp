// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The ccslice program: values by formulas, and what is cut out by them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "client/cli/base/exit_codes.h"
#include "core/base/read_file.h"
#include "tests/client/command_line.h"

namespace ccslice::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class CommandLineFields : public CommandLine {
 protected:
  /// What `slice` wrote of this job, as JSON.
  std::string manifest_of(std::vector<std::string> options, const std::string& folder) {
    options.insert(options.begin(), {"slice", box_, "--pitch", "0.5", "-o", path(folder)});
    const ProcessResult result = run(options);
    EXPECT_EQ(result.exit_code, cli::kExitOk) << result.err;
    return read_file_bytes(path(folder) + "/manifest.json", 1 << 20);
  }
  double voxels_of(const std::string& manifest) { return json_at(manifest, "voxel_count").number_value(); }
};

TEST_F(CommandLineFields, CutOutWhatAFormulaSays) {
  const double all = voxels_of(manifest_of({"--occupancy"}, "all"));
  const std::vector<std::string> cut = {"--occupancy", "--field", "half = x", "--cut-where", "half > 6"};
  const std::string manifest = manifest_of(cut, "cut");
  const double left = voxels_of(manifest), cut_out = json_at(manifest, "voxels_cut").number_value();
  EXPECT_GT(left, 0);
  EXPECT_GT(cut_out, 0);
  EXPECT_EQ(left + cut_out, all);
  EXPECT_EQ(json_at(manifest, "slice_job.cut").string_value(), "cut-where");
}

TEST_F(CommandLineFields, GoIntoJobFilesAndOutOfThem) {
  const std::vector<std::string> options = {"--channel",   "wave",     "--field",     "world:wave=sin(x)*z",
                                            "--cut-where", "wave > 1", "--write-job", path("job.json")};
  const std::string told = manifest_of(options, "told");
  const ProcessResult again = run({"slice", box_, "--job", path("job.json"), "-o", path("again")});
  ASSERT_EQ(again.exit_code, cli::kExitOk) << again.err;
  EXPECT_EQ(read_file_bytes(path("again/manifest.json"), 1 << 20), told);
  const ProcessResult twice = run({"slice", box_, "--job", path("job.json"), "--field", "a=x", "-o", path("twice")});
  EXPECT_EQ(twice.exit_code, cli::kExitUsage);
  EXPECT_THAT(twice.err, HasSubstr("--field"));
}

TEST_F(CommandLineFields, AreProbedAndPictured) {
  const ProcessResult probed = run({"probe", box_, "--at", "5,5,5", "--field", "far=x + 100*y"});
  EXPECT_EQ(probed.exit_code, cli::kExitOk) << probed.err;
  EXPECT_THAT(probed.out, HasSubstr("far 505"));
  for (const std::vector<std::string>& picture : std::vector<std::vector<std::string>>{
           {"--channel", "far", "--plane", "z=5"},
           {"--channel", "far", "--sweep", "3"},
           {"--plane", "z=5", "--cut-where", "x > 6"},
           {"--channel", "far", "--cut-where", "gyroid(x/5, y/5, z/5) < 0"},
           {"--channel", "far", "--cut-where", "gyroid(x/5, y/5, z/5) < 0", "--plane", "z=5"}}) {
    std::vector<std::string> command = {"picture", box_, "--field", "far=x + 100*y", "--force", "-o", path("a.png")};
    command.insert(command.end(), picture.begin(), picture.end());
    const ProcessResult drawn = run(command);
    EXPECT_EQ(drawn.exit_code, cli::kExitOk) << drawn.err;
  }
}

TEST_F(CommandLineFields, AreRefusedByTheirOptionAndName) {
  const auto plan = [&](std::vector<std::string> options) {
    options.insert(options.begin(), {"plan", box_, "--pitch", "1"});
    const ProcessResult result = run(options);
    EXPECT_NE(result.exit_code, cli::kExitOk);
    return result.err;
  };
  EXPECT_THAT(plan({"--field", "gyroid(x,y,z)"}), HasSubstr("--field takes NAME=FORMULA"));
  EXPECT_THAT(plan({"--field", " =x"}), HasSubstr("--field takes NAME=FORMULA"));
  EXPECT_THAT(plan({"--field", "a=b", "--field", "b=x"}), HasSubstr("those before it only"));
  EXPECT_THAT(plan({"--field", "a=gyriod(x,y,z)", "--channel", "a"}),
              AllOf(HasSubstr("--field"), HasSubstr("\"a\", column 1"), HasSubstr("gyroid")));
  EXPECT_THAT(plan({"--cut-where", "1/x"}), HasSubstr("clamp"));
  EXPECT_THAT(plan({"--cut-where", "x <"}), HasSubstr("\"cut-where\", column 4"));
}

TEST_F(CommandLineFields, AreOnContactSheetsAndMixMaterials) {
  const ProcessResult sliced =
      run({"slice", box_, "--pitch", "0.5", "--field", "share=mod(floor(x/2), 2)", "--cut-where", "z > 5", "--material",
           "soft=#ff0000", "--material", "hard=#0000ff", "--map", "blend:share:0=soft,1=hard", "-o", path("sheet")});
  EXPECT_EQ(sliced.exit_code, cli::kExitOk) << sliced.err;
  EXPECT_THAT(sliced.out, AllOf(HasSubstr("contact sheet: "), HasSubstr("materials: soft "), HasSubstr("cut out: ")));
  EXPECT_THAT(sliced.err, testing::Not(HasSubstr("no contact sheet")));
}

TEST_F(CommandLineFields, SayThatContoursAreOfTheWholePart) {
  const ProcessResult plan = run({"plan", box_, "--pitch", "1", "--cut-where", "x > 6"});
  EXPECT_THAT(plan.out + plan.err, testing::Not(HasSubstr("contours are those of the whole part")));
  const ProcessResult sliced =
      run({"slice", box_, "--pitch", "1", "--cut-where", "x > 6", "--contours", "csv", "-o", path("c")});
  EXPECT_EQ(sliced.exit_code, cli::kExitOk) << sliced.err;
  EXPECT_THAT(sliced.out + sliced.err, HasSubstr("contours are those of the whole part"));
}

TEST_F(CommandLineFields, ThatLeaveNothingHaveNoPicture) {
  const ProcessResult drawn = run({"picture", box_, "--cut-where", "1", "-o", path("nothing.png")});
  EXPECT_EQ(drawn.exit_code, cli::kExitUsage);
  EXPECT_THAT(drawn.err, HasSubstr("--cut-where leaves nothing"));
}

TEST_F(CommandLineFields, MakeShellsInOrderFromTheSurface) {
  const std::vector<std::string> materials = {"--material",  "core=#ff0000", "--material",
                                              "mid=#00ff00", "--material",   "skin=#0000ff"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.end(), materials.begin(), materials.end());
    return more;
  };
  const std::string manifest = manifest_of(with({"--shell", "1=skin", "--shell", "0.5=mid"}), "shells");
  EXPECT_THAT(manifest, HasSubstr("\"name\":\"--shell\",\"formula\":\"distance(1.5)\""));
  const auto usage = [&](const std::string& shell) {
    const ProcessResult result = run(with({"slice", box_, "--pitch", "0.5", "-o", path("no"), "--shell", shell}));
    EXPECT_EQ(result.exit_code, cli::kExitUsage);
    return result.err;
  };
  EXPECT_THAT(usage("skin"), HasSubstr("--shell takes MM=MATERIAL, as in '0.5=VeroBlack', not 'skin'"));
  EXPECT_THAT(usage("-1=skin"), HasSubstr("--shell takes 0.001 to 1000000 mm, not '-1'"));
  const ProcessResult unknown = run(with({"slice", box_, "--pitch", "0.5", "-o", path("no"), "--shell", "1=bark"}));
  EXPECT_THAT(unknown.err, AllOf(HasSubstr("--where, --shell or --keep-out"), HasSubstr("bark")));
}

// The box is 24 x 16 x 8 mm: a millimetre below its surface lie 44 x 28 x 12 of its voxels.
TEST_F(CommandLineFields, KeepNothingBelowTheSurface) {
  const std::vector<std::string> hollow = {"--material", "skin=#0000ff",  "--material", "void",       "--occupancy",
                                           "--map",      "material:void", "--keep-out", "void=1:skin"};
  const std::string manifest = manifest_of(hollow, "hollow");
  constexpr double kAll = 48 * 32 * 16, kInner = 44 * 28 * 12;
  EXPECT_EQ(voxels_of(manifest), kAll - kInner);
  EXPECT_EQ(json_at(manifest, "materials.0.voxel_count").number_value(), kAll - kInner);
  EXPECT_EQ(json_at(manifest, "materials.1.voxel_count").number_value(), kInner);
  EXPECT_TRUE(json_at(manifest, "materials.1.leaves_empty").bool_value());
  const auto refused = [&](const std::vector<std::string>& options) {
    std::vector<std::string> all = {"slice",    box_,         "--pitch",   "0.5",        "-o",
                                    path("no"), "--material", "a=#0000ff", "--material", "b=#00ff00"};
    all.insert(all.end(), options.begin(), options.end());
    const ProcessResult result = run(all);
    EXPECT_NE(result.exit_code, cli::kExitOk) << result.out;
    return result.err;
  };
  EXPECT_THAT(refused({"--keep-out", "a=1"}), HasSubstr("--keep-out takes MATERIAL=MM:INSTEAD, as in"));
  EXPECT_THAT(refused({"--keep-out", "a=0:b"}), HasSubstr("--keep-out takes 0.001 to 1000000 mm, not '0'"));
  EXPECT_THAT(refused({"--keep-out", "a=1:b", "--keep-out", "b=1:a"}), HasSubstr("is kept out itself"));
  EXPECT_THAT(refused({"--keep-out", "region:core=a=1:b"}),
              HasSubstr("region:... of --map, --where, --shell or --keep-out: there is no cell region \"core\""));
  const ProcessResult nothing = run({"slice", box_, "--pitch", "0.5", "-o", path("nothing"), "--material", "a=#0000ff",
                                     "--material", "void", "--map", "material:void"});
  EXPECT_EQ(nothing.exit_code, cli::kExitOk) << nothing.err;
  EXPECT_THAT(nothing.err, HasSubstr("nothing is printed: every voxel of these layers is cut out or left empty"));
  const ProcessResult drawn = run({"picture", box_, "--material", "a=#0000ff", "--material", "void", "--map",
                                   "material:void", "-o", path("p.png")});
  EXPECT_EQ(drawn.exit_code, cli::kExitUsage);
  EXPECT_THAT(drawn.err, HasSubstr("--material void leaves nothing"));
  const ProcessResult packed = run({"slice", box_, "--pitch", "0.5", "-o", path("graded"), "--material", "a=#0000ff",
                                    "--material", "void", "--where", "gradient<0.5=void", "--channel", "gradient"});
  ASSERT_EQ(packed.exit_code, cli::kExitOk) << packed.err;
  EXPECT_THAT(run({"package", path("graded"), "-o", path("graded.3mf")}).err,
              HasSubstr("voxels that the layers leave empty aren't empty in it"));
}

}  // namespace
}  // namespace ccslice::client
