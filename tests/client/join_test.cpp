// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// `slice --share` and `join`: many workers make one stack, of the bytes of a single run.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <string>
#include <thread>
#include <vector>

#include "client/cli/base/exit_codes.h"
#include "client/cli/output/folder_lock.h"
#include "tests/client/command_line.h"
#include "tests/client/fake_slicer.h"

namespace ccslice::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

using Words = std::vector<std::string>;

class Join : public CommandLine {
 protected:
  /// The box in 160 layers, which are 10 blocks of 16.
  ProcessResult slice(const std::string& folder, const Words& more, const std::string& address = "") {
    Words words = {"slice", box_, "--pitch", "1,1,0.05", "-o", path(folder)};
    words.insert(words.end(), more.begin(), more.end());
    return start(words, address.empty() ? server_->address() : address)->wait();
  }
  /// All shares, in "NAME-1", "NAME-2", ...; returns their paths.
  Words slice_shares(const std::string& name, int count, const Words& more = {}, const std::string& address = "") {
    Words folders;
    for (int number = 1; number <= count; ++number) {
      Words words = more;
      words.insert(words.end(), {"--share", std::to_string(number) + "/" + std::to_string(count)});
      const std::string folder = name + "-" + std::to_string(number);
      const ProcessResult result = slice(folder, words, address);
      EXPECT_EQ(result.exit_code, cli::kExitOk) << result.err;
      folders.push_back(path(folder));
    }
    return folders;
  }
  ProcessResult join(const Words& shares, const std::string& folder, const Words& more = {}) {
    Words words = {"join", "-o", path(folder)};
    words.insert(words.end(), more.begin(), more.end());
    words.insert(words.end(), shares.begin(), shares.end());
    return run_alone(words);
  }
  void expect_joined(const Words& shares, const std::string& folder, const Words& more = {}) {
    const ProcessResult result = join(shares, folder, more);
    EXPECT_EQ(result.exit_code, cli::kExitOk) << result.err;
  }
  /// The same files with the same bytes.
  void expect_same(const std::string& a, const std::string& b) {
    const ProcessResult result = Process({"/usr/bin/diff", "-r", path(a), path(b)}, folder_.path()).wait();
    EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
    EXPECT_EQ(result.out, "");
    EXPECT_TRUE(fs::exists(path(a) + "/manifest.json"));
  }
  /// Joins them in another order than that of their layers.
  void expect_eight_shares_make(const std::vector<Words>& jobs) {
    for (std::size_t i = 0; i < jobs.size(); ++i) {
      SCOPED_TRACE(testing::PrintToString(jobs[i]));
      const std::string name = "job" + std::to_string(i);
      ASSERT_EQ(slice(name, jobs[i]).exit_code, cli::kExitOk);
      Words shares = slice_shares(name, 8, jobs[i]);
      std::rotate(shares.begin(), shares.begin() + 3, shares.end());
      expect_joined(shares, name + "-joined");
      expect_same(name, name + "-joined");
    }
  }
  /// Refused before or while it is joined: nothing is left that looks like layers.
  void expect_refused(const Words& shares, cli::ExitCode exit_code, const testing::Matcher<const std::string&>& said) {
    const ProcessResult result = join(shares, "refused");
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    EXPECT_THAT(result.err, said);
    EXPECT_TRUE(!fs::exists(path("refused")) || files_in("refused") == 0);
  }
};

TEST_F(Join, EightSharesMakeTheFolderOfOneRun) {
  expect_eight_shares_make(
      {{},
       {"--occupancy", "--channel", "gradient:u16", "--contours", "json", "--no-contact-sheet"},
       {"--channel", "gradient:f32", "--encoding", "tiff", "--contours", "csv"},
       {"--channel", "gradient:f32", "--encoding", "raw", "--contours", "svg"},
       {"--occupancy", "--encoding", "zstd", "--contour-tolerance", "0.01"},
       {"--all-channels"},
       {"--channel", "gradient", "--outside", "alpha", "--rotate", "z=30", "--row-order", "descending"}});
}

TEST_F(Join, EightSharesOfMaterialsAndOfPartsOfAJobDoToo) {
  const Words two = {"--material", "VeroCY-V", "--material",
                     "VeroMGT-V",  "--map",    "blend:gradient:0=VeroCY-V,1=VeroMGT-V"};
  const auto with_two = [&](Words words) {
    words.insert(words.end(), two.begin(), two.end());
    return words;
  };
  expect_eight_shares_make({with_two({"--masks"}),
                            with_two({"--encoding", "png-rgba", "--halftone", "error-diffusion"}),
                            {"--layers", "21..155", "--channel", "gradient"},
                            {"--box", "3,3,0.93,9,9,7.4", "--channel", "gradient"},
                            with_two({"--format", "grabcad", "--box", "3,3,0.93,9,9,7.4"}),
                            // The lower half of both copies is left empty.
                            {"--at", "0,0,0", "--at", "30,0,0", "--material", "a=#ff0000", "--material", "void",
                             "--field", "k=z-4", "--where", "k<0=void", "--occupancy"}});
}

TEST_F(Join, WhatIsJoinedStaysWhenTheSharesGo) {
  const Words shares = slice_shares("part", 2, {"--channel", "gradient"});
  const ProcessResult joined = join(shares, "out", {"--json"});
  ASSERT_EQ(joined.exit_code, cli::kExitOk) << joined.err;
  EXPECT_EQ(json_at(joined.out, "layers").number_value(), 160);
  EXPECT_EQ(json_at(joined.out, "shares").number_value(), 2);
  EXPECT_EQ(json_at(joined.out, "files").number_value(), 161) << "with the contact sheet";
  EXPECT_EQ(json_at(joined.out, "linked_files").number_value(), 161);
  EXPECT_EQ(json_at(joined.out, "contact_sheet").string_value(), path("out/contact_sheet.png"));
  EXPECT_EQ(fs::hard_link_count(path("out/layer_0100_gradient.png")), 2u);
  for (const std::string& share : shares) fs::remove_all(share);
  ASSERT_EQ(slice("whole", {"--channel", "gradient"}).exit_code, cli::kExitOk);
  expect_same("whole", "out");
  EXPECT_EQ(slice("out", {"--channel", "gradient", "--resume", "--json"}).exit_code, cli::kExitOk)
      << "it is as if it had been sliced there";
}

TEST_F(Join, LinksOfOtherFilesAreCopied) {
  const Words shares = slice_shares("part", 2, {"--no-contact-sheet"});
  fs::create_directory(path("elsewhere"));
  fs::rename(path("part-2/layer_0100_occupancy.png"), path("elsewhere/picture"));
  fs::create_symlink("../elsewhere/picture", path("part-2/layer_0100_occupancy.png"));
  const ProcessResult joined = join(shares, "out", {"--json"});
  ASSERT_EQ(joined.exit_code, cli::kExitOk) << joined.err;
  EXPECT_EQ(json_at(joined.out, "files").number_value(), 160);
  EXPECT_EQ(json_at(joined.out, "linked_files").number_value(), 159);
  EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(path("out/layer_0100_occupancy.png"))));
}

TEST_F(Join, ASharesManifestSaysWhichItIs) {
  const ProcessResult result = slice("part", {"--share", "2/3"});
  ASSERT_EQ(result.exit_code, cli::kExitOk) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("share 2/3, layers 48 to 95 of 0 to 159"), HasSubstr("ccslice join"),
                                Not(HasSubstr("contact sheet"))));
  const std::string manifest = read_whole(path("part/manifest.json"));
  EXPECT_EQ(json_at(manifest, "share.number").number_value(), 2);
  EXPECT_EQ(json_at(manifest, "layers").list_value().values_size(), 48);
  EXPECT_EQ(files_in("part"), 48u + 1);
  const ProcessResult again = slice("part", {"--share", "2/3", "--resume", "--json"});
  EXPECT_EQ(json_at(again.out, "share.job.layers").number_value(), 160);
  EXPECT_TRUE(json_at(again.out, "complete_before").bool_value());
  for (const Words& other : {Words{"--share", "3/3"}, {"--share", "1/2"}, {"--layers", "48..95"}}) {
    Words words = other;
    words.push_back("--resume");
    const ProcessResult refused = slice("part", words);
    EXPECT_EQ(refused.exit_code, cli::kExitOutput);
    EXPECT_THAT(refused.err, HasSubstr("another job"));
  }
  const ProcessResult packed = run({"package", path("part"), "-o", path("part.gcvf")});
  EXPECT_EQ(packed.exit_code, cli::kExitInput);
  EXPECT_THAT(packed.err, HasSubstr("a share of a job; make the job of all its shares first, with ccslice join"));
}

TEST_F(Join, ShareArchivesCanBeUnpackedAndJoined) {
  ASSERT_EQ(slice("whole", {}).exit_code, cli::kExitOk);
  for (const char* number : {"1", "2"}) {
    const ProcessResult streamed = run(
        {"slice", box_, "--pitch", "1,1,0.05", "--layers", "0..159", "-o", "-", "--share", number + std::string("/2")});
    ASSERT_EQ(streamed.exit_code, cli::kExitOk) << streamed.err;
    const std::string archive = path(number + std::string(".tar")), folder = path(number);
    cli::write_file(archive, streamed.out);
    fs::create_directory(folder);
    ASSERT_EQ(Process({"/bin/tar", "-xf", archive, "-C", folder}, folder_.path()).wait().exit_code, 0);
  }
  expect_joined({path("1"), path("2")}, "out");
  expect_same("whole", "out");
}

TEST_F(Join, AnInterruptedShareGoesOnAndEndsWithTheSameBytes) {
  FakeSlicer fake;
  const Words job = {"--encoding", "zstd", "--no-contact-sheet", "--attempts", "1"};
  ASSERT_EQ(slice("whole", job, fake.address()).exit_code, cli::kExitOk);
  Words shares = slice_shares("part", 1, {"--encoding", "zstd", "--no-contact-sheet", "--resume"}, fake.address());
  expect_joined(shares, "one");
  expect_same("whole", "one");
  shares.clear();
  for (int number = 1; number <= 2; ++number) {
    Words words = job;
    words.insert(words.end(), {"--resume", "--share", std::to_string(number) + "/2"});
    shares.push_back("q" + std::to_string(number));
    fake.before_layer = [](std::uint32_t layer, grpc::ServerContext&) {
      return layer % 16 != 3 ? grpc::Status::OK : grpc::Status(grpc::StatusCode::UNAVAILABLE, "gone");
    };
    const ProcessResult cut_short = slice(shares.back(), words, fake.address());
    EXPECT_EQ(cut_short.exit_code, cli::kExitUnreachable) << cut_short.err;
    expect_refused({path(shares.back())}, cli::kExitInput,
                   AllOf(HasSubstr(path(shares.back()) + " isn't complete"), HasSubstr("--resume")));
    fake.before_layer = {};
    const ProcessResult resumed = slice(shares.back(), words, fake.address());
    EXPECT_EQ(resumed.exit_code, cli::kExitOk) << resumed.err;
    EXPECT_THAT(resumed.err, HasSubstr("layers were there already"));
    shares.back() = path(shares.back());
  }
  expect_joined(shares, "out");
  expect_same("whole", "out");
}

TEST_F(Join, EqualDoublesDoNoHarm) {
  ASSERT_EQ(slice("whole", {}).exit_code, cli::kExitOk);
  Words shares = slice_shares("part", 4);
  ASSERT_EQ(slice("again", {"--share", "2/4"}).exit_code, cli::kExitOk);
  ASSERT_EQ(slice("half", {"--share", "1/2"}).exit_code, cli::kExitOk);
  shares.insert(shares.end(), {path("again"), shares[3], path("half")});
  expect_joined(shares, "out");
  expect_same("whole", "out");
  expect_joined({path("half"), shares[2], shares[3]}, "thirds");
  expect_same("whole", "thirds");
}

TEST_F(Join, DoublesOfOtherBytesAreRefused) {
  const Words shares = slice_shares("part", 2);
  ASSERT_EQ(slice("other", {"--share", "2/2"}).exit_code, cli::kExitOk);
  std::string manifest = read_whole(path("other/manifest.json"));
  const std::size_t digest = manifest.rfind("\"sha256\":\"") + 10;
  manifest[digest] = manifest[digest] == '0' ? '1' : '0';
  fs::remove(path("other/manifest.json"));
  cli::write_file(path("other/manifest.json"), manifest);
  expect_refused({shares[0], shares[1], path("other")}, cli::kExitInput,
                 AllOf(HasSubstr(shares[1] + " and " + path("other")), HasSubstr("layer 159"),
                       HasSubstr("different bytes; slice that share anew")));
}

TEST_F(Join, MissingSharesAreNamed) {
  const Words shares = slice_shares("part", 5);
  expect_refused({shares[0], shares[1], shares[3], shares[4]}, cli::kExitInput,
                 HasSubstr("share 3/5 is missing: slice with --share 3/5, and name the folder too"));
  expect_refused({shares[1], shares[2]}, cli::kExitInput, HasSubstr("shares 1/5, 4/5, 5/5 are missing"));
  ASSERT_EQ(slice("half", {"--share", "1/2"}).exit_code, cli::kExitOk);
  expect_refused({path("half"), shares[3]}, cli::kExitInput, HasSubstr("share 2/2 is missing: slice with --share 2/2"));
}

TEST_F(Join, SharesOfDifferentJobsAreRefused) {
  const std::string first = slice_shares("part", 2, {"--channel", "gradient", "--contours", "json"})[0];
  const auto refused = [&](const std::string& name, const std::string& said, const Words& job) {
    SCOPED_TRACE(name);
    Words words = job;
    words.insert(words.end(), {"--share", "2/2"});
    const ProcessResult sliced = slice(name, words);
    ASSERT_EQ(sliced.exit_code, cli::kExitOk) << sliced.err;
    expect_refused({first, path(name)}, cli::kExitInput,
                   AllOf(HasSubstr(first + " and " + path(name) + " are of different jobs: "), HasSubstr(said),
                         HasSubstr("; slice all shares with the same options")));
  };
  const Words same = {"--channel", "gradient", "--contours", "json"};
  const auto and_also = [&](Words more) {
    more.insert(more.begin(), same.begin(), same.end());
    return more;
  };
  refused("planes", "their planes differ", {"--contours", "json"});
  refused("samples", "their planes differ", {"--channel", "gradient:u16", "--contours", "json"});
  refused("layout", "their layouts differ", and_also({"--flip", "x"}));
  refused("region", "their regions differ", and_also({"--box", "0,0,0,9,9,8"}));
  refused("mesh", "their meshes differ", and_also({"--grade", "more=z"}));
  refused("placement", "their parts, or their placements, differ",
          and_also({"--scale=-1,1,1", "--translate", "24,0,0"}));
  refused("layers", "one has layers 0 to 159, the other layers 0 to 150", and_also({"--layers", "0..150"}));
  refused("tolerance", "their tolerances, contours or other options differ", and_also({"--contour-tolerance", "0.01"}));
  refused("contours", "their tolerances, contours or other options differ",
          {"--channel", "gradient", "--contours", "csv"});
  const Words materials = {"--material", "a=#ff0000", "--material", "b=#00ff00", "--map"};
  const auto mapped = [&](const std::string& map) {
    Words words = materials;
    words.push_back(map);
    return words;
  };
  const std::string printed = slice_shares("printed", 2, mapped("blend:gradient:0=a,1=b"))[0];
  slice_shares("otherwise", 2, mapped("blend:gradient:0=b,1=a"));
  expect_refused({printed, path("otherwise-2")}, cli::kExitInput,
                 HasSubstr("their materials, maps or halftones differ"));
  ASSERT_EQ(slice("finer", and_also({"--pitch", "0.5,0.5,0.05", "--share", "2/2"})).exit_code, cli::kExitUsage)
      << "--pitch is there twice";
}

TEST_F(Join, SharesOfDifferentEnginesAndGridsAreRefused) {
  FakeSlicer fake;
  const Words job = {"--encoding", "zstd", "--no-contact-sheet"};
  const Words shares = slice_shares("part", 2, job, fake.address());
  fake.engine_version = "engine-2";
  const Words newer = slice_shares("newer", 2, job, fake.address());
  fake.engine_version = "engine-1";
  fake.pitch_drift_mm = 1e-9;
  const Words drifted = slice_shares("drifted", 2, job, fake.address());
  const auto refused = [&](const std::string& other, const std::string& reason, const std::string& said) {
    const ProcessResult result = join({shares[0], other}, "refused", {"--json"});
    EXPECT_EQ(result.exit_code, cli::kExitMismatch) << result.err;
    EXPECT_EQ(json_at(result.out, "error.reason").string_value(), reason);
    EXPECT_THAT(result.err, AllOf(HasSubstr(shares[0] + " and " + other), HasSubstr(said)));
    EXPECT_FALSE(fs::exists(path("refused")));
  };
  refused(newer[1], "ENGINE_MIXED", "are of two engines, engine-1 and engine-2; slice all shares");
  refused(drifted[1], "GRID_MIXED", "have different grids; slice all shares");
}

TEST_F(Join, DamagedFilesAreNamedWithTheirShare) {
  const Words shares = slice_shares("part", 2, {"--occupancy", "--contours", "csv"});
  const std::string picture = path("part-2/layer_0100_occupancy.png"), sheet = path("part-1/contact_sheet.png"),
                    outline = path("part-2/layer_0100_contours.csv"), manifest = path("part-2/manifest.json");
  const auto refused = [&](const std::string& file, const std::string& bytes, const std::string& said) {
    SCOPED_TRACE(said);
    const std::string before = read_whole(file);
    cli::write_file(file, bytes);
    expect_refused(shares, cli::kExitInput, HasSubstr(said));
    cli::write_file(file, before);
  };
  const std::string whole = read_whole(picture);
  refused(picture, whole.substr(0, 20),
          picture + " has 20 bytes instead of " + std::to_string(whole.size()) +
              "; slice that share anew: --share 2/2 --force");
  std::string changed = whole;
  changed.back() ^= 1;
  refused(picture, changed, picture + " has changed since: its SHA-256 is another one");
  refused(outline, "", outline + " has 0 bytes instead of");
  refused(sheet, "x", sheet + " has changed since");
  refused(manifest, read_whole(manifest).substr(0, 2000), manifest + " isn't a manifest of layers: was it cut short?");
  refused(manifest, "{}", manifest + " isn't a manifest of layers");
  fs::remove(picture);
  expect_refused(shares, cli::kExitInput, HasSubstr(picture + " can't be read: No such file"));
  cli::write_file(picture, whole);
  expect_joined(shares, "refused");
}

TEST_F(Join, ManifestsThatNameOtherFilesAreRefused) {
  const Words shares = slice_shares("part", 2, {"--no-contact-sheet"});
  const std::string manifest = path("part-2/manifest.json"), before = read_whole(manifest);
  const auto refused = [&](const std::string& from, const std::string& to, const std::string& said) {
    SCOPED_TRACE(to);
    std::string text = before;
    ASSERT_NE(text.find(from), std::string::npos);
    text.replace(text.find(from), from.size(), to);
    cli::write_file(manifest, text);
    expect_refused(shares, cli::kExitInput, AllOf(HasSubstr(manifest), HasSubstr(said)));
  };
  refused("layer_0100_occupancy.png", "manifest.json", "names manifest.json, which isn't a layer's file");
  refused("\"layer\":100,", "\"layer\":101,", "doesn't have the layers of its share in order");
  refused("\"first_layer\":80,", "\"first_layer\":79,", "doesn't have the layers of its share");
  refused("\"number\":2,", "\"number\":3,", "doesn't say which share it is");
  refused("\"slice_job\":", "\"jobs\":", "isn't as it was written");
  refused("\"format_version\":3", "\"format_version\":1", "another version of ccslice");
  refused("\"share\":", "\"shares\":", "isn't that of a share: slice one with --share I/N");
}

TEST_F(Join, FoldersThatAreNoSharesAreRefused) {
  const Words shares = slice_shares("part", 2);
  ASSERT_EQ(slice("range", {"--layers", "80..159"}).exit_code, cli::kExitOk);
  expect_refused({shares[0], path("range")}, cli::kExitInput, HasSubstr("isn't that of a share: slice one with"));
  expect_refused({shares[0], path("nowhere")}, cli::kExitInput, HasSubstr(path("nowhere") + " isn't there"));
  fs::create_directory(path("empty"));
  expect_refused({shares[0], path("empty")}, cli::kExitInput, HasSubstr(path("empty") + " holds no manifest.json"));
  expect_refused({shares[0], box_}, cli::kExitInput, HasSubstr(box_ + " holds no manifest.json"));
  const ProcessResult none = run_alone({"join", "-o", path("refused")});
  EXPECT_EQ(none.exit_code, cli::kExitUsage);
  EXPECT_THAT(none.err, HasSubstr("SHARE is required"));
}

TEST_F(Join, AShareThatIsBeingSlicedIsNotComplete) {
  FakeSlicer fake;
  fake.before_layer = [](std::uint32_t layer, grpc::ServerContext& context) {
    while (layer == 3 && !context.IsCancelled()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return grpc::Status::OK;
  };
  const auto process =
      start({"slice", box_, "--pitch", "1,1,0.05", "--encoding", "zstd", "--share", "1/2", "-o", path("part")},
            fake.address());
  while (!fs::exists(path("part/layer_0002_occupancy.zst"))) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  expect_refused({path("part")}, cli::kExitInput,
                 HasSubstr(path("part") + " isn't complete: wait until slice has ended there, or go on with it"));
  process->send_signal(SIGINT);
  EXPECT_EQ(process->wait().exit_code, cli::kExitInterrupted);
}

TEST_F(Join, TheJobsFolderIsToBeNewOrEmpty) {
  const Words shares = slice_shares("part", 2);
  const auto refused = [&](const std::string& folder, const std::string& said) {
    const ProcessResult result = join(shares, folder);
    EXPECT_EQ(result.exit_code, cli::kExitOutput) << result.err;
    EXPECT_THAT(result.err, AllOf(HasSubstr(path(folder)), HasSubstr(said)));
  };
  fs::create_directory(path("out"));
  expect_joined(shares, "out");
  refused("out", "files of an earlier run; take another folder, or --force to replace them");
  cli::write_file(path("out/layer_0900_occupancy.png"), "of another job");
  expect_joined(shares, "out", {"--force"});
  EXPECT_FALSE(fs::exists(path("out/layer_0900_occupancy.png")));

  fs::create_directory(path("mine"));
  cli::write_file(path("mine/notes.txt"), "mine");
  refused("mine", "isn't empty; take another folder, or --force to write beside what is in it");
  expect_joined(shares, "mine", {"--force"});
  EXPECT_EQ(read_whole(path("mine/notes.txt")), "mine");

  refused("box.ccmesh", "Not a directory");
  EXPECT_THAT(join(shares, "../../../../../../../proc/nowhere").err, HasSubstr("cannot make the folder"));
  fs::create_directory(path("busy"));
  const cli::FolderLock lock(path("busy"));
  refused("busy", "another job is writing to");
}

TEST_F(Join, AShareIsNeverTheJobsFolder) {
  const Words shares = slice_shares("part", 2);
  for (const char* folder : {"part-2", "part-2/", "part-1/../part-2"}) {
    const ProcessResult result = join(shares, folder, {"--force"});
    EXPECT_EQ(result.exit_code, cli::kExitUsage);
    EXPECT_THAT(result.err, HasSubstr("is the folder of a share; name another one"));
  }
  Words to_stdout = {"join", "-o", "-"};
  to_stdout.insert(to_stdout.end(), shares.begin(), shares.end());
  EXPECT_EQ(run_alone(to_stdout).exit_code, cli::kExitUsage);
  expect_joined(shares, "out");
}

TEST_F(Join, SharesThatAreNoneAreRefusedBeforeAnythingIsWritten) {
  for (const char* share : {"", "/", "0/4", "5/4", "1/0", "4", "a/b", "1/11", "1/161"}) {
    const ProcessResult result = slice("part", {"--share", share});
    EXPECT_EQ(result.exit_code, cli::kExitUsage) << share;
    EXPECT_THAT(result.err, HasSubstr("--share"));
    EXPECT_FALSE(fs::exists(path("part")));
  }
  EXPECT_THAT(slice("part", {"--share", "11/11"}).err, HasSubstr("no more than 10 shares"));
  EXPECT_THAT(slice("part", {"--share", "1/2", "--layers", "0..15"}).err,
              HasSubstr("layers 0 to 15 make no more than 1"));
}

}  // namespace
}  // namespace ccslice::client
