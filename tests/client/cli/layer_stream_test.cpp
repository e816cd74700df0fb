// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// `slice -o -`: layers on standard output.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "client/cli/base/exit_codes.h"
#include "tests/client/command_line.h"

namespace ccslice::client {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class LayerStreamTest : public CommandLine {
 protected:
  std::vector<std::string> job(const std::vector<std::string>& more) const {
    std::vector<std::string> words = {"slice", box_, "--pitch", "0.5"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  /// The job in a shell's words, so that its output can go elsewhere.
  ProcessResult run_in_shell(const std::string& rest) {
    const std::string command = std::string(CCSLICE_BINARY) + " slice " + box_ +
                                " --pitch 0.2 --encoding raw --server " + server_->address() + " -o - " + rest;
    return Process({"/bin/bash", "-c", command}, folder_.path()).wait();
  }
};

TEST_F(LayerStreamTest, AnArchiveHoldsWhatTheFolderWould) {
  const std::vector<std::string> planes = {"--occupancy", "--channel=gradient:u16", "--contours=csv", "--layers=3..6"};
  std::vector<std::string> into_folder = job(planes), to_stdout = job(planes);
  into_folder.insert(into_folder.end(), {"-o", path("folder")});
  to_stdout.insert(to_stdout.end(), {"-o", "-"});
  ASSERT_EQ(run(into_folder).exit_code, cli::kExitOk);
  const ProcessResult streamed = run(to_stdout);
  ASSERT_EQ(streamed.exit_code, cli::kExitOk) << streamed.err;
  EXPECT_THAT(streamed.err, HasSubstr("4 layers, "));
  EXPECT_THAT(streamed.err, HasSubstr("-> standard output"));
  cli::write_file(path("layers.tar"), streamed.out);
  fs::create_directory(path("unpacked"));
  const ProcessResult compared =
      Process({"/bin/sh", "-c",
               "cd " + folder_.path().string() +
                   " && tar -xf layers.tar -C unpacked && diff -r folder unpacked && tar -tf layers.tar | tail -n 1"},
              folder_.path())
          .wait();
  EXPECT_EQ(compared.out, "manifest.json\n") << compared.err;
  EXPECT_EQ(files_in("unpacked"), 4u * 3 + 2);
  EXPECT_EQ(run(to_stdout).out, streamed.out) << "the same bytes each time";
}

TEST_F(LayerStreamTest, OneLayerOfOneFileComesAsItIs) {
  ASSERT_EQ(run(job({"--layers=3", "-o", path("folder")})).exit_code, cli::kExitOk);
  const ProcessResult result = run(job({"--layers=3", "-o", "-", "--quiet"}));
  ASSERT_EQ(result.exit_code, cli::kExitOk) << result.err;
  EXPECT_EQ(result.out, read_whole(path("folder/layer_0003_occupancy.png")));
  EXPECT_EQ(result.err, "");
  const ProcessResult outline = run(job({"--layers=3", "--contours=csv", "-o", "-"}));
  EXPECT_THAT(outline.out, testing::StartsWith("loop,x_mm,y_mm\n0,"));
  EXPECT_THAT(outline.err, HasSubstr("1 layer, "));
  const ProcessResult two = run(job({"--layers=3", "--occupancy", "--channel=gradient", "-o", "-"}));
  EXPECT_THAT(two.out, testing::StartsWith("layer_0003_occupancy.png")) << "two files need an archive";
}

TEST_F(LayerStreamTest, AReaderThatGoesAwayAndAFullDiskAreOneSentence) {
  const ProcessResult gone = run_in_shell("| head -c 1000 >/dev/null; exit ${PIPESTATUS[0]}");
  EXPECT_EQ(gone.exit_code, cli::kExitOutput);
  EXPECT_THAT(gone.err, HasSubstr("ccslice: cannot write to standard output: Broken pipe\n"));
  const ProcessResult full = run_in_shell(">/dev/full");
  EXPECT_EQ(full.exit_code, cli::kExitOutput);
  EXPECT_THAT(full.err, HasSubstr("ccslice: cannot write to standard output: No space left on device\n"));
}

TEST_F(LayerStreamTest, WhatCannotBeStreamedIsRefusedBeforeAnythingIsWritten) {
  for (const auto& [option, why] :
       {std::pair("--resume", "--resume goes on in a folder"), std::pair("--json", "leave out --json")}) {
    const ProcessResult result = run(job({"-o", "-", option}));
    EXPECT_EQ(result.exit_code, cli::kExitUsage) << option;
    EXPECT_THAT(result.err, HasSubstr(why));
    EXPECT_THAT(result.out, Not(HasSubstr("ustar")));
  }
  const ProcessResult wrong = run(job({"-o", "-", "--layers=900"}));
  EXPECT_EQ(wrong.exit_code, cli::kExitUsage);
  EXPECT_THAT(wrong.out, IsEmpty());
}

}  // namespace
}  // namespace ccslice::client
