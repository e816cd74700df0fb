// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The ccslice program: pictures in files and in the terminal.

#include "tests/client/command_line.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/base/exit_codes.h"

namespace ccslice::client {
namespace {

using testing::HasSubstr;

TEST_F(CommandLine, DrawsCutsAndLayersInTheTerminal) {
  const std::vector<std::string> half_way = {"picture", box_, "--channel", "gradient", "--terminal", "--pixels", "48"};
  const ProcessResult result = run(half_way);
  ASSERT_EQ(result.exit_code, cli::kExitOk) << result.err;
  EXPECT_THAT(result.out, HasSubstr("....."));
  EXPECT_THAT(result.out, HasSubstr("@@@@@\n"));
  EXPECT_THAT(result.out, HasSubstr("gradient from 0.0125 to 0.9875, '.' to '@'"));
  const ProcessResult plane =
      run({"picture", box_, "--channel", "gradient", "--terminal", "--plane", "z=4", "--pixels", "48"});
  EXPECT_EQ(plane.out, result.out);
  const ProcessResult layer = run({"picture", box_, "--terminal", "--layer", "3", "--pitch", "0.05", "--pixels", "40"});
  ASSERT_EQ(layer.exit_code, cli::kExitOk) << layer.err;
  EXPECT_LE(layer.out.find('\n'), 40u);
  EXPECT_EQ(run({"picture", box_, "--terminal", "-o", path("t.png")}).exit_code, cli::kExitUsage);
  EXPECT_EQ(run({"picture", box_, "--terminal", "--sweep", "3"}).exit_code, cli::kExitUsage);
  EXPECT_EQ(run({"picture", box_, "--terminal", "--cut", "x=0.5"}).exit_code, cli::kExitUsage);
  EXPECT_THAT(run({"picture", box_}).err, HasSubstr("-o FILE.png, or --terminal"));
}

TEST_F(CommandLine, DrawsAPictureOfACutPart) {
  const std::vector<std::string> command = {"picture",  box_,       "--channel", "gradient",      "--cut",
                                            "x=0.5",    "--voxels", "24",        "--pixels",      "200",
                                            "--rotate", "x=90",     "-o",        path("box.png"), "--json"};
  const ProcessResult result = run(command);
  ASSERT_EQ(result.exit_code, cli::kExitOk) << result.err;
  EXPECT_EQ(json_at(result.out, "width").number_value(), 200);
  EXPECT_THAT(read_whole(path("box.png")), testing::StartsWith("\x89PNG"));
  EXPECT_EQ(run(command).exit_code, cli::kExitOutput) << "the file is there";
  EXPECT_EQ(run({"picture", box_, "--cut", "x=0.5", "--voxels", "24", "--pixels", "100", "--material", "a=#ff0000",
                 "--material", "b=#0000ff", "--map", "blend:gradient:0=a,1=b", "-o", path("printed.png")})
                .exit_code,
            cli::kExitOk);
  for (const char* cut : {"half", "x=2", "x=-0.1", "x=nan"}) {
    EXPECT_EQ(run({"picture", box_, "-o", path("b.png"), "--cut", cut}).exit_code, cli::kExitUsage) << cut;
  }
  EXPECT_EQ(run({"picture", box_, "-o", path("b.png"), "--view", "30"}).exit_code, cli::kExitUsage);
  EXPECT_EQ(run({"picture", box_, "-o", path("b.png"), "--cell-regions", "--channel", "gradient"}).exit_code,
            cli::kExitUsage);
}

TEST_F(CommandLine, DrawsPlanesAndLayers) {
  const std::vector<std::string> plane = {"picture",   box_,      "--plane",  "z=4", "--channel", "gradient",
                                          "--colours", "cividis", "--pixels", "100", "-o",        path("plane.png"),
                                          "--json"};
  const ProcessResult result = run(plane);
  ASSERT_EQ(result.exit_code, cli::kExitOk) << result.err;
  EXPECT_EQ(json_at(result.out, "width").number_value(), 100);
  EXPECT_GT(json_at(result.out, "pixels_inside").number_value(), 1000);
  EXPECT_EQ(json_at(result.out, "range").list_value().values_size(), 2);
  EXPECT_THAT(read_whole(path("plane.png")), testing::StartsWith("\x89PNG"));
  EXPECT_EQ(run(plane).exit_code, cli::kExitOutput) << "the file is there";
  EXPECT_THAT(run({"picture", box_, "--plane", "z=400", "-o", path("off.png")}).out, HasSubstr("misses the part"));
  std::vector<std::string> lined = plane;
  lined.insert(lined.end(), {"--lines", "3", "--force"});
  const std::string before = read_whole(path("plane.png"));
  EXPECT_EQ(run(lined).exit_code, cli::kExitOk);
  EXPECT_NE(read_whole(path("plane.png")), before);
  const std::vector<std::string> materials = {"--material",   "soft=#ff0000", "--material",
                                              "hard=#0000ff", "--map",        "blend:gradient:0=soft,1=hard"};
  const auto with_materials = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), materials.begin(), materials.end());
    return run(arguments);
  };
  EXPECT_EQ(with_materials({"picture", box_, "--plane", "0,0,4:1,0,1", "-o", path("mix.png")}).exit_code, cli::kExitOk);
  const ProcessResult layer =
      with_materials({"picture", box_, "--layer", "3", "--pitch", "0.5", "-o", path("layer.png")});
  ASSERT_EQ(layer.exit_code, cli::kExitOk) << layer.err;
  EXPECT_THAT(layer.out, testing::AllOf(HasSubstr("soft"), HasSubstr("hard"), HasSubstr("%")));
}

TEST_F(CommandLine, DrawsLayersOfSeveralParts) {
  const std::vector<std::string> layer = {"--layer", "3", "--pitch", "0.5", "--json"};
  const auto pixels_inside = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "picture");
    arguments.insert(arguments.end(), layer.begin(), layer.end());
    const ProcessResult result = run(arguments);
    EXPECT_EQ(result.exit_code, cli::kExitOk) << result.err;
    return json_at(result.out, "pixels_inside").number_value();
  };
  const double one = pixels_inside({box_, "-o", path("one.png")});
  EXPECT_EQ(pixels_inside({box_, box_, "--at", "0,0,0", "--at", "30,0,0", "-o", path("two.png")}), 2 * one);
  EXPECT_EQ(pixels_inside({box_, "--at", "0,0,0", "--at", "30,0,0", "-o", path("copies.png")}), 2 * one);
  EXPECT_THAT(run({"picture", box_, box_, "-o", path("no.png")}).err, HasSubstr("--layer"));
  EXPECT_THAT(run({"picture", box_, "--plane", "z=1", "--at", "1,1,1", "-o", path("no.png")}).err,
              HasSubstr("--layer"));
}

TEST_F(CommandLine, SweepsThroughThePart) {
  ASSERT_EQ(run({"picture", box_, "--sweep", "7", "--channel", "gradient", "-o", path("sheet.png")}).exit_code,
            cli::kExitOk);
  const ProcessResult animated = run({"picture", box_, "--sweep", "5", "--plane", "x=0", "--animate", "--pixels", "64",
                                      "--channel", "gradient", "-o", path("sweep.png")});
  ASSERT_EQ(animated.exit_code, cli::kExitOk) << animated.err;
  EXPECT_THAT(read_whole(path("sweep.png")), HasSubstr("acTL"));
}

TEST_F(CommandLine, PicturesNameTheOptionThatIsWrong) {
  const auto error_of = [&](std::vector<std::string> arguments, cli::ExitCode code = cli::kExitUsage) {
    arguments.insert(arguments.begin(), {"picture", box_, "-o", path("p.png")});
    const ProcessResult result = run(arguments);
    EXPECT_EQ(result.exit_code, code) << testing::PrintToString(arguments) << result.err;
    return result.err;
  };
  EXPECT_THAT(error_of({"--animate"}), HasSubstr("--animate is for a sweep (--sweep)"));
  EXPECT_THAT(error_of({"--plane", "up"}), HasSubstr("--plane takes"));
  EXPECT_THAT(error_of({"--plane", "z=1", "--layer", "2"}), HasSubstr("--plane is for a cut (--plane) or a sweep"));
  EXPECT_THAT(error_of({"--plane", "z=1", "--animate"}), HasSubstr("--sweep"));
  EXPECT_THAT(error_of({"--plane", "z=1", "--lines", "17"}), HasSubstr("--lines"));
  EXPECT_THAT(error_of({"--plane", "z=1", "--show", "mix"}), HasSubstr("--material"));
  EXPECT_THAT(error_of({"--plane", "z=1", "--show", "channel"}), HasSubstr("--channel NAME"));
  EXPECT_THAT(error_of({"--plane", "z=1", "--channel", "nothing"}, cli::kExitRefused), HasSubstr("--channel"));
  EXPECT_THAT(error_of({"--plane", "z=1", "--channel", "gradient", "--range", "1,1"}), HasSubstr("--range"));
  EXPECT_THAT(error_of({"--layer", "999", "--pitch", "1"}, cli::kExitRefused), HasSubstr("--layer"));
  EXPECT_FALSE(fs::exists(path("p.png")));
}

TEST_F(CommandLine, PicturesRefuseOptionsThatTheyMakeNothingOf) {
  const std::vector<std::string> materials = {"--material", "a=#ff0000", "--material",
                                              "b=#00ff00",  "--map",     "blend:gradient:0=a,1=b"};
  const std::vector<std::vector<std::string>> space = {
      {"--colours", "grey"}, {"--pitch", "1"},      {"--printer", "j750-hq"},     {"--box", "0,0,0,1,1,1"},
      {"--range", "0,1"},    {"--at", "1,1,1"},     {"--extent", "1,1,1"},        {"--dpi", "300"},
      {"--frame-ms", "50"},  {"--show", "channel"}, {"--halftone", "white-noise"}};
  const std::vector<std::vector<std::string>> layer = {
      {"--pixels", "640"}, {"--voxels", "20"}, {"--cut", "x=0.5"}, {"--no-legend"}, {"--colours", "grey"}};
  const std::vector<std::vector<std::string>> plane = {
      {"--pitch", "1"}, {"--box-voxels", "0,0,0,1,1,1"}, {"--animate"}, {"--view", "1,2"}, {"--seed", "3"}};
  const auto refuse_all = [&](const std::vector<std::string>& picture,
                              const std::vector<std::vector<std::string>>& unfit) {
    for (const std::vector<std::string>& option : unfit) {
      std::vector<std::string> arguments = {"picture", box_};
      arguments.insert(arguments.end(), picture.begin(), picture.end());
      arguments.insert(arguments.end(), option.begin(), option.end());
      const ProcessResult result = run(arguments);
      EXPECT_EQ(result.exit_code, cli::kExitUsage) << testing::PrintToString(arguments);
      EXPECT_THAT(result.err, HasSubstr(option.front() + " is for ")) << testing::PrintToString(arguments);
      EXPECT_THAT(result.err, HasSubstr("or leave " + option.front() + " out"));
    }
  };
  refuse_all({"-o", path("p.png")}, space);
  refuse_all({"-o", path("p.png"), "--layer", "1", "--pitch", "1"}, layer);
  refuse_all({"-o", path("p.png"), "--plane", "z=1"}, plane);
  refuse_all({"--terminal", "--channel", "gradient"}, {{"--colours", "viridis"}, {"--force"}, {"-o", path("p.png")}});
  std::vector<std::string> printed = {"-o", path("p.png"), "--channel", "gradient"};
  printed.insert(printed.end(), materials.begin(), materials.end());
  std::vector<std::string> shown = printed;
  shown.insert(shown.end(), {"--plane", "z=1", "--show", "mix"});
  for (const auto& [arguments, option] : {std::pair(printed, "--material"), {shown, "--channel"}}) {
    std::vector<std::string> command = {"picture", box_};
    command.insert(command.end(), arguments.begin(), arguments.end());
    EXPECT_THAT(run(command).err, HasSubstr(std::string(option) + " is for "));
  }
  EXPECT_FALSE(fs::exists(path("p.png")));
}

TEST_F(CommandLine, PicturesTakeAsManyCharactersAsAreAskedFor) {
  const auto columns = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"picture", box_, "--terminal", "--plane", "z=4"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const std::string out = run(arguments).out;
    std::size_t most = 0;
    for (std::size_t at = 0; at < out.size(); at = out.find('\n', at) + 1)
      most = std::max(most, out.find('\n', at) - at);
    return most;
  };
  EXPECT_GT(columns({"--pixels", "640"}), 600u);
  EXPECT_LE(columns({}), 80u);
}

TEST_F(CommandLine, HelpSaysWhichPicturesAnOptionIsFor) {
  const std::string help = run_alone({"picture", "--help"}).out;
  const auto folded = [&] {
    std::string text;
    for (const char c : help) {
      if (c != '\n' && (c != ' ' || !text.ends_with(' '))) text += c;
      if (c == '\n') text += text.ends_with(' ') ? "" : " ";
    }
    return text;
  }();
  EXPECT_THAT(folded, HasSubstr("this many pixels wide. For a cut, a layer or a sweep"));
  EXPECT_THAT(folded, HasSubstr("For a cut, a layer or a sweep; the values of a channel; a file"));
}

TEST_F(CommandLine, DrawsALayerOfAJobOfAFile) {
  const std::vector<std::string> said = {"--pitch",    "0.5",       "--at",       "0,0,0",
                                         "--at",       "30,0,0",    "--material", "a=#ff0000",
                                         "--material", "b=#00ff00", "--map",      "blend:gradient:0=a,1=b"};
  std::vector<std::string> plan = {"plan", box_, "--write-job", path("job.json")};
  std::vector<std::string> drawn = {"picture", box_, "--layer", "3", "-o", path("said.png")};
  plan.insert(plan.end(), said.begin(), said.end());
  drawn.insert(drawn.end(), said.begin(), said.end());
  ASSERT_EQ(run(plan).exit_code, cli::kExitOk);
  ASSERT_EQ(run(drawn).exit_code, cli::kExitOk);
  const ProcessResult again = run({"picture", "--job", path("job.json"), "--layer", "3", "-o", path("again.png")});
  ASSERT_EQ(again.exit_code, cli::kExitOk) << again.err;
  EXPECT_THAT(again.out, testing::AllOf(HasSubstr("a "), HasSubstr("b "), HasSubstr("%")));
  EXPECT_EQ(read_whole(path("again.png")), read_whole(path("said.png")));
  EXPECT_THAT(run({"picture", "--job", path("job.json"), "-o", path("no.png")}).err, HasSubstr("--job is for a layer"));
  EXPECT_THAT(run({"picture", "--job", path("job.json"), "--layer", "3", "--pitch", "1", "-o", path("no.png")}).err,
              HasSubstr("--job says the whole job"));
  EXPECT_THAT(run({"picture", "-o", path("no.png")}).err, HasSubstr("MESH"));
}

}  // namespace
}  // namespace ccslice::client
