// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The ccslice program: values from the files of volumes.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "client/cli/base/exit_codes.h"
#include "core/base/read_file.h"
#include "tests/client/command_line.h"

namespace ccslice::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// A cube of 10 mm, and 2 x 1 x 1 samples, 100 and 200, 5 mm apart: (2.5, 5, 5) and (7.5, 5, 5) with `place`.
class CommandLineVolumes : public CommandLine {
 protected:
  CommandLineVolumes() {
    cli::write_file(cube_,
                    "# vtk DataFile Version 3.0\ncube\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 double\n"
                    "0 0 0  10 0 0  10 10 0  0 10 0  0 0 10  10 0 10  10 10 10  0 10 10\n"
                    "CELLS 1 9\n8 0 1 2 3 4 5 6 7\nCELL_TYPES 1\n12\n");
  }

  ProcessResult run_cube(std::vector<std::string> command) {
    command.insert(command.begin() + 1, {cube_, "--as-meshed"});
    return run(command);
  }
  std::string put_nrrd(const std::string& name, const std::string& place) {
    cli::write_file(path(name),
                    "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 1 1\nencoding: ascii\n" + place + "\n\n100 200\n");
    return path(name);
  }
  const std::string kPlace = "space directions: (5,0,0) (0,10,0) (0,0,10)\nspace origin: (2.5,5,5)";

  ProcessResult probe(const std::string& volume, const std::string& at) {
    return run_cube({"probe", "--volume", volume, "--at", at});
  }

  const std::string cube_ = path("cube.vtk");
};

TEST_F(CommandLineVolumes, AreProbedWhereTheyLie) {
  const std::string file = put_nrrd("a.nrrd", kPlace);
  EXPECT_THAT(probe("v=" + file, "2.5,5,5").out, HasSubstr("v 100"));
  EXPECT_THAT(probe("v=" + file, "5,1,9").out, HasSubstr("v 150"));
  EXPECT_THAT(probe("v=" + file + ":nearest", "4.9,1,9").out, HasSubstr("v 100"));
  EXPECT_THAT(probe("v=" + file + ":spacing=1:outside=-3", "0.25,0.25,0.25").out, HasSubstr("v 125"));
  EXPECT_THAT(probe("v=" + file + ":spacing=1,1,1:outside=-3", "5,5,5").out, HasSubstr("v -3"));
  EXPECT_THAT(probe("v=" + file + ":origin=3.5,5,5", "3.5,5,5").out, HasSubstr("v 100"));
  EXPECT_THAT(probe("v=" + put_nrrd("b.nrrd", "spacings: 1 1 1") + ":fill", "5,5,5").out, HasSubstr("v 150"));
}

TEST_F(CommandLineVolumes, LieAsAPatientDoesUnlessTold) {
  const std::string file = put_nrrd("ras.nrrd",
                                    "space: RAS\nspace directions: (-5,0,0) (0,-10,0) (0,0,10)\n"
                                    "space origin: (-2.5,-5,5)");
  const ProcessResult lps = probe("v=" + file, "2.5,5,5");
  EXPECT_THAT(lps.out, HasSubstr("v 100"));
  EXPECT_THAT(lps.err, HasSubstr("LPS"));
  const ProcessResult ras = probe("v=" + file + ":ras:outside=-3", "2.5,5,5");
  EXPECT_THAT(ras.out, HasSubstr("v -3"));
  EXPECT_THAT(ras.err, Not(HasSubstr("LPS")));
}

TEST_F(CommandLineVolumes, FillThePartIfTheFileSaysNoPlace) {
  const std::string file = put_nrrd("a.nrrd", "content: x");
  const ProcessResult result = probe("v=" + file, "5,5,5");
  EXPECT_THAT(result.out, HasSubstr("v 150"));
  EXPECT_THAT(result.err, HasSubstr("fill the box round the part"));
  EXPECT_THAT(probe("v=" + file + ":fill", "5,5,5").err, Not(HasSubstr("note")));
}

TEST_F(CommandLineVolumes, AreSlicedAndGoIntoJobFiles) {
  const std::string file = put_nrrd("a.nrrd", kPlace);
  const ProcessResult told = run_cube({"slice", "--pitch", "1", "--volume", "v=" + file, "--field", "w=v/100",
                                       "--channel", "w", "--write-job", path("job.json"), "-o", path("told")});
  ASSERT_EQ(told.exit_code, cli::kExitOk) << told.err;
  const std::string manifest = read_file_bytes(path("told/manifest.json"), 1 << 20);
  const ProcessResult again = run({"slice", cube_, "--as-meshed", "--job", path("job.json"), "-o", path("again")});
  ASSERT_EQ(again.exit_code, cli::kExitOk) << again.err;
  EXPECT_EQ(read_file_bytes(path("again/manifest.json"), 1 << 20), manifest);
  EXPECT_EQ(json_at(manifest, "slice_job.fields.0.volume.index_to_mm.3").number_value(), 2.5);
  // A path in place of the id takes the file's place, and one that the job says counts more.
  const std::string job = read_file_bytes(path("job.json"), 1 << 20);
  const std::string id = json_at(job, "fields.0.volume.volume_id").string_value();
  std::string by_path = job;
  by_path.replace(by_path.find(id), id.size(), "a.nrrd");
  cli::write_file(path("by_path.json"), by_path);
  const ProcessResult named = run({"slice", cube_, "--as-meshed", "--job", path("by_path.json"), "-o", path("named")});
  ASSERT_EQ(named.exit_code, cli::kExitOk) << named.err;
  EXPECT_EQ(read_file_bytes(path("named/manifest.json"), 1 << 20), manifest);
}

TEST_F(CommandLineVolumes, StandInForThoseThatAJobNamesByIds) {
  const std::string file = put_nrrd("a.nrrd", kPlace);
  const ProcessResult planned = run_cube({"plan", "--pitch", "1", "--volume", "v=" + file + ":outside=5", "--channel",
                                          "v", "--write-job", path("job.json")});
  ASSERT_EQ(planned.exit_code, cli::kExitOk) << planned.err;
  SetUpTestSuite();  // Another server, which lacks both.
  const std::vector<std::string> job = {"plan", cube_, "--as-meshed", "--job", path("job.json")};
  const ProcessResult missing = run(job);
  EXPECT_EQ(missing.exit_code, cli::kExitRefused) << missing.err;
  std::vector<std::string> with_file = job;
  with_file.insert(with_file.end(), {"--volume", "v=" + file});
  const ProcessResult found = run(with_file);
  EXPECT_EQ(found.exit_code, cli::kExitOk) << found.err;
  cli::write_file(path("other.nrrd"), "NRRD0001\ntype: uchar\ndimension: 3\nsizes: 1 1 1\nencoding: raw\n\na");
  with_file.back() = "v=" + path("other.nrrd");
  EXPECT_THAT(run(with_file).err, HasSubstr("give the file that the job was written with"));
  with_file.back() = "w=" + file;
  EXPECT_THAT(run(with_file).err, HasSubstr("has no volume 'w'"));
}

TEST_F(CommandLineVolumes, OfAJobKeepTheJobsSlope) {
  std::string header(352, '\0');  // A NIfTI file of one sample, 100, with the slope 3.
  const auto put = [&](std::size_t at, const std::string& bytes) { header.replace(at, bytes.size(), bytes); };
  put(0, std::string("\x5c\1\0\0", 4));
  put(40, std::string("\3\0\1\0\1\0\1\0", 8));
  put(70, std::string("\2\0", 2));
  put(108, std::string("\0\0\xb0\x43", 4));
  put(112, std::string("\0\0\x40\x40", 4));
  put(344, "n+1");
  cli::write_file(path("a.nii"), header + "d");
  const auto value_with = [&](const std::string& slope) {
    cli::write_file(path("job.json"), R"({"parts": [{"mesh_id": "cube.vtk"}], "grid": {"pitch": {"x_mm": 5, "y_mm": 5,
        "z_mm": 5}}, "fields": [{"name": "v", "volume": {"volume_id": "a.nii")" +
                                          slope + R"(}}],
        "planes": [{"channel": {"name": "v"}}]})");
    const ProcessResult sliced = run({"slice", "--job", path("job.json"), "--as-meshed", "--force", "-o", path("out")});
    EXPECT_EQ(sliced.exit_code, cli::kExitOk) << sliced.err;
    return json_at(read_file_bytes(path("out/manifest.json"), 1 << 20), "planes.0.value_range.1").number_value();
  };
  EXPECT_EQ(value_with(""), 300);
  EXPECT_EQ(value_with(R"(, "slope": 2)"), 200);
}

TEST_F(CommandLineVolumes, ArePicturedAndPlanned) {
  const std::string file = put_nrrd("a.nrrd", kPlace);
  const ProcessResult picture =
      run_cube({"picture", "--volume", "v=" + file, "--channel", "v", "--plane", "z=5", "-o", path("a.png")});
  EXPECT_EQ(picture.exit_code, cli::kExitOk) << picture.err;
  EXPECT_THAT(picture.out, HasSubstr("v from 1"));
  const ProcessResult plan = run_cube({"plan", "--pitch", "1", "--volume", "v=" + file + ":spacing=1"});
  EXPECT_THAT(plan.out + plan.err, HasSubstr("field 'v' has no samples"));
}

TEST_F(CommandLineVolumes, AreRefusedWithTheRemedy) {
  const std::string file = put_nrrd("a.nrrd", kPlace);
  const auto refuses = [&](const std::string& volume, int code, const std::string& part) {
    const ProcessResult result = probe(volume, "5,5,5");
    EXPECT_EQ(result.exit_code, code) << result.err;
    EXPECT_THAT(result.err, HasSubstr(part));
  };
  refuses("v", cli::kExitUsage, "--volume takes NAME=FILE");
  refuses("=a.nrrd", cli::kExitUsage, "--volume takes NAME=FILE");
  refuses("v=:nearest", cli::kExitUsage, "--volume takes NAME=FILE");
  refuses("v=" + file + ":channel=-1", cli::kExitUsage, "channel=-1");
  refuses("v=" + file + ":spacing=1,2", cli::kExitUsage, "spacing=");
  refuses("v=" + file + ":spacing=x", cli::kExitUsage, "--volume");
  refuses("v=" + file + ":fill:spacing=1", cli::kExitUsage, "fill takes the part's place");
  refuses("v=" + file + ":ras", cli::kExitUsage, "ras is for files");
  refuses("v=" + put_nrrd("b.nrrd", "content: x") + ":origin=1,2,3", cli::kExitUsage, "spacing=");
  refuses("v=" + file + ":near", cli::kExitUsage, "'near' isn't an option; they are outside=VALUE");
  refuses("v=" + file + ":xyz", cli::kExitInput, "leave xyz out");
  refuses("v=" + path("none"), cli::kExitInput, "none");
  refuses("v=" + cube_, cli::kExitInput, "not a volume that can be read");
  refuses("v=" + file + ":channel=1", cli::kExitRefused, "last channel is 0");
}

TEST_F(CommandLineVolumes, AreUploadedAgainWhereTheServerHasLostThem) {
  const std::string file = put_nrrd("a.nrrd", kPlace);
  const std::vector<std::string> command = {"slice", "--pitch", "1",       "--volume", "v=" + file, "--channel",
                                            "v",     "-o",      path("a"), "--layers", "0..2"};
  ASSERT_EQ(run_cube(command).exit_code, cli::kExitOk);
  SetUpTestSuite();  // Another server.
  std::vector<std::string> resumed = command;
  resumed.push_back("--resume");
  const ProcessResult result = run_cube(resumed);
  EXPECT_EQ(result.exit_code, cli::kExitOk) << result.err;
}

}  // namespace
}  // namespace ccslice::client
