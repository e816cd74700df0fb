// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/commands/help.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <string>

#include "client/cli/base/option_of_field.h"
#include "client/cli/commands/program.h"

namespace ccslice::cli {
namespace {

using testing::HasSubstr;

TEST(Help, FindsWhatWasMeant) {
  const std::vector<std::string> names = {"slice", "join", "plan", "picture", "probe"};
  EXPECT_EQ(closest_name("slce", names), "slice");
  EXPECT_EQ(closest_name("silce", names), "slice");
  EXPECT_EQ(closest_name("plann", names), "plan");
  EXPECT_EQ(closest_name("pict", names), "picture") << "cut short";
  EXPECT_EQ(closest_name("frobnicate", names), "");
  EXPECT_EQ(closest_name("", names), "");
  EXPECT_EQ(closest_name("slice", {}), "");
}

/// An app of one command with one option.
struct SmallApp {
  SmallApp() {
    app.require_subcommand(1);
    app.add_subcommand("slice", "Slice a mesh")->add_option("--pitch", pitch, "Voxel pitch")->required();
    CLI::App* const plan = app.add_subcommand("plan", "Say what slicing would give");
    plan->add_option("--seed", seed, "Another pattern");
    plan->add_option("--shift", shift, "So many voxels");
  }
  std::string error_of(std::vector<std::string> arguments) {
    std::reverse(arguments.begin(), arguments.end());
    try {
      app.parse(arguments);
    } catch (const CLI::ParseError& error) {
      return describe_parse_error(app, error);
    }
    return "no error";
  }

  CLI::App app{"A program", "ccslice"};
  double pitch = 0;
  unsigned seed = 0;
  int shift = 0;
};

TEST(Help, ErrorsSayWhatWasMeantAndWhereHelpIs) {
  EXPECT_THAT(SmallApp().error_of({"slce"}), HasSubstr("unknown command slce; did you mean slice?\nccslice --help"));
  EXPECT_THAT(SmallApp().error_of({"slice", "--pitch=1", "--pich=2"}),
              HasSubstr("unknown option --pich; did you mean --pitch?\nccslice slice --help"));
  EXPECT_THAT(SmallApp().error_of({"slice", "--pich", "1"}), HasSubstr("did you mean --pitch?"));
  EXPECT_THAT(SmallApp().error_of({"slice", "--pitch=1", "more"}), HasSubstr("unexpected argument more"));
  EXPECT_THAT(SmallApp().error_of({"slice"}), HasSubstr("--pitch is required"));
  EXPECT_THAT(SmallApp().error_of({"sl\x1b[31mce"}), testing::Not(HasSubstr("\x1b")));
}

TEST(Help, ErrorsSayThatOptionsStandBehindTheirCommand) {
  EXPECT_THAT(SmallApp().error_of({"--pitch", "1", "slice"}),
              HasSubstr("--pitch stands behind its command, as in ccslice slice --pitch\nccslice slice --help"));
  EXPECT_THAT(SmallApp().error_of({"--seed=1", "plan"}), HasSubstr("--seed stands behind its command"));
  EXPECT_THAT(SmallApp().error_of({"--pitch", "1"}), HasSubstr("unknown option --pitch\n"));
  EXPECT_THAT(SmallApp().error_of({"--pitch", "1", "plan"}), HasSubstr("unknown option --pitch\n"));
}

TEST(Help, ErrorsSayWhichNumbersAnOptionTakes) {
  EXPECT_THAT(SmallApp().error_of({"slice", "--pitch", "0.2mm"}), HasSubstr("--pitch takes a number, not '0.2mm'"));
  EXPECT_THAT(SmallApp().error_of({"plan", "--seed=-1"}), HasSubstr("--seed takes a whole number from 0 on, not '-1'"));
  EXPECT_THAT(SmallApp().error_of({"plan", "--shift", "1.5"}), HasSubstr("--shift takes a whole number, not '1.5'"));
  EXPECT_THAT(SmallApp().error_of({"plan", "--shift", "\x1b[31m"}), testing::Not(HasSubstr("\x1b")));
}

TEST(Help, IsAsWideAsTheTerminal) {
  for (const std::size_t columns : {std::size_t{60}, std::size_t{100}}) {
    SmallApp small;
    CLI::App* const command = small.app.get_subcommand("slice");
    int unused = 0;
    command->add_option("--a-name-that-is-wider-than-its-column", unused, std::string(30, 'w') + " is one word");
    std::string words;
    for (int i = 0; i < 60; ++i) words += (i ? " word" : "word") + std::to_string(i);
    command->add_option("--long", unused, words);
    command->formatter(std::make_shared<HelpFormatter>(columns));
    std::istringstream help(command->help());
    std::size_t widest = 0;
    std::string text;
    for (std::string line; std::getline(help, line);) {
      widest = std::max(widest, line.size());
      text += line + " ";
    }
    EXPECT_LE(widest, columns);
    EXPECT_GT(widest, columns - 10);
    for (int i = 0; i < 60; ++i) EXPECT_THAT(text, HasSubstr("word" + std::to_string(i) + " "));
  }
}

TEST(Help, OfEveryCommandFitsANarrowTerminal) {
  constexpr std::size_t kColumns = 60;
  Program program;
  const auto formatter = std::make_shared<HelpFormatter>(kColumns);
  std::vector<CLI::App*> apps = program.app.get_subcommands([](CLI::App*) { return true; });
  apps.push_back(&program.app);
  for (CLI::App* app : apps) {
    app->formatter(formatter);
    std::istringstream help(app->help());
    for (std::string line; std::getline(help, line);) {
      const std::size_t word = line.find_first_not_of(' ');
      const bool one_word = word != std::string::npos && line.find(' ', word) == std::string::npos;
      EXPECT_TRUE(one_word || line.size() <= kColumns) << app->get_name() << ": " << line;
    }
  }
}

TEST(Help, ExamplesGoOnBeforeAnOptionAndProseIsFilled) {
  EXPECT_EQ(wrapped_footer("Examples:\n  ccslice models", 60), "Examples:\n  ccslice models\n");
  EXPECT_EQ(wrapped_footer("Some words of prose that are too long.\n\nMore.", 20),
            "Some words of prose\nthat are too long.\n\nMore.\n");
  const std::string example = "  ccslice slice part.vtk --pitch 0.05 --box 10,10,0,30,20,4 --occupancy -o corner";
  EXPECT_EQ(wrapped_footer(example, 60),
            "  ccslice slice part.vtk --pitch 0.05 \\\n"
            "      --box 10,10,0,30,20,4 --occupancy -o corner\n");
  EXPECT_EQ(wrapped_footer(example, 100), example + "\n");
  EXPECT_EQ(wrapped_footer("  ccslice slice part.mesh --pitch 0.1 -o - | tar -xf -", 50),
            "  ccslice slice part.mesh --pitch 0.1 -o - | tar \\\n      -xf -\n");
  const std::string value = "  ccslice slice part.vtk --output=" + std::string(60, 'x') + " --force";
  EXPECT_EQ(wrapped_footer(value, 60),
            "  ccslice slice part.vtk \\\n      --output=" + std::string(60, 'x') + " \\\n      --force\n");
}

TEST(OptionOfField, FieldsBecomeTheOptionsThatSetThem) {
  EXPECT_EQ(option_of_field("job.grid.pitch.x_mm"), "--pitch");
  EXPECT_EQ(option_of_field("plane.layer.job.grid.pitch.x_mm"), "--pitch");
  EXPECT_EQ(option_of_field("grid.pitch.x_mm"), "--pitch") << "as other fields' messages have it";
  EXPECT_EQ(option_of_field("job.parts[0].placements[0].matrix[3]"), "--at, --rotate, --scale, --translate");
  EXPECT_EQ(option_of_field("placement.matrix"), "--rotate, --scale, --translate");
  EXPECT_EQ(option_of_field("job.tolerances.contour_mm"), "--contour-tolerance");
  EXPECT_EQ(option_of_field("job.tolerances.channel"), "--channel-tolerance");
  EXPECT_EQ(option_of_field("job.contours.by_cell_region"), "--contours-by-cell-region");
  EXPECT_EQ(option_of_field("job.parts"), "");
  EXPECT_EQ(option_of_field("nojob.grid.pitch"), "");
  EXPECT_EQ(option_of_field("printer.name"), "--printer");
  EXPECT_EQ(option_of_field("job.planes[12].channel.name"), "--channel");
  EXPECT_EQ(option_of_field("planes[0].channels"), "--all-channels");
  EXPECT_EQ(option_of_field("printing.materials[3].rgba"), "--material");
  EXPECT_EQ(option_of_field("printing.cell_region_maps[0].map.blend"), "--map region:...");
  EXPECT_EQ(option_of_field("job.printing.map.overrides[2].channel"), "--where, --shell or --keep-out");
  EXPECT_EQ(option_of_field("printing.cell_region_maps[0].map.overrides[2].channel"), "--where, --shell or --keep-out");
  EXPECT_EQ(option_of_field("region.voxels"), "--box-voxels");
  EXPECT_EQ(option_of_field("regional"), "");
  EXPECT_EQ(option_of_field(""), "");
  EXPECT_EQ(in_terms_of_options("job.grid.pitch.x_mm: -1 is wrong"), "--pitch: -1 is wrong");
  EXPECT_EQ(in_terms_of_options("cells[3]: is wrong"), "cells[3]: is wrong");
  EXPECT_EQ(in_terms_of_options("no field at all"), "no field at all");
}

TEST(OptionOfField, FieldsWithinAMessageBecomeOptionsToo) {
  EXPECT_EQ(in_terms_of_options("grid.extent.columns: too many; use a grid.pitch.x_mm of at least 0.1, or less"),
            "--extent: too many; use a --pitch of at least 0.1, or less");
  EXPECT_EQ(in_terms_of_options("printing.map.blend: there is no \"x\"; printing.materials has \"a\", \"b\""),
            "--map: there is no \"x\"; --material has \"a\", \"b\"");
  EXPECT_EQ(in_terms_of_options("grid.pitch.y_mm: choose grid.pitch.x_mm."), "--pitch: choose --pitch.");
  const std::string named = "a channel \"grid.pitch\", and one \"of grid.pitch\" more";
  EXPECT_EQ(in_terms_of_options("planes: " + named), "--channel: " + named) << "what users named stays";
  EXPECT_EQ(in_terms_of_options("planes: plane 2 of the region, 0.5 wide"),
            "--channel: plane 2 of the region, 0.5 wide")
      << "words that are no fields stay";
}

}  // namespace
}  // namespace ccslice::cli
