// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Files and folders that the command line writes, one by one: whole or not at all, and by one job at a time.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cerrno>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>

#include "client/cli/base/json.h"
#include "client/cli/base/output_file.h"
#include "client/cli/base/text_values.h"
#include "client/cli/options/job.h"
#include "client/cli/output/folder_lock.h"
#include "client/cli/output/layer_folder.h"
#include "client/cli/output/zip_file.h"
#include "client/job.h"
#include "core/base/error.h"
#include "tests/client/process.h"

namespace ccslice::cli {
namespace {

namespace fs = std::filesystem;
using client::read_whole;
using client::TemporaryFolder;
using testing::ElementsAre;
using testing::HasSubstr;

TEST(OutputFile, AppearsWholeOrNotAtAll) {
  const TemporaryFolder folder;
  write_file(folder.path() / "a", "first");
  EXPECT_EQ(read_whole(folder.path() / "a"), "first");
  EXPECT_THROW(write_file(folder.path() / "no" / "such" / "folder", "x"), Error);
  fs::create_directories(folder.path() / "taken" / "inside");
  EXPECT_THROW(write_file(folder.path() / "taken", "x"), Error);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 2)
      << "no temporary file stays";
}

TEST(OutputFile, IsNeverWrittenThroughALinkThatSomebodyPlanted) {
  const TemporaryFolder folder;
  write_file(folder.path() / "victim", "precious");
  for (const char* name : {".a.part", "a"}) fs::create_symlink("victim", folder.path() / name);
  write_file(folder.path() / "a", "mine");
  ZipFile(folder.path() / "a").finish();
  EXPECT_EQ(read_whole(folder.path() / "victim"), "precious");
  EXPECT_FALSE(fs::is_symlink(folder.path() / "a"));
  EXPECT_THROW(open_to_append(folder.path() / ".a.part"), Error);
}

TEST(OutputFile, TemporaryNamesTellWhatTheFileWasToBecome) {
  EXPECT_EQ(final_name_of_temporary(".layer_0001.png.0123abcd.part"), "layer_0001.png");
  for (const char* other : {"", ".part", ".0123abcd.part", "layer_0001.png", "layer_0001.png.0123abcd.part"}) {
    EXPECT_EQ(final_name_of_temporary(other), "") << other;
  }
  const TemporaryFolder folder;
  const NewFile unfinished(folder.path() / "a");
  EXPECT_EQ(final_name_of_temporary(fs::directory_iterator(folder.path())->path().filename().string()), "a");
}

TEST(OutputFile, IsRemovedByAProgramThatEndsOnTheSpot) {
  const TemporaryFolder folder;
  write_file(folder.path() / "whole", "kept");
  NewFile one(folder.path() / "a"), other(folder.path() / "b");
  one.write("half");
  remove_unfinished_files();
  EXPECT_THROW(one.finish(), Error);
  EXPECT_THAT(std::vector<fs::directory_entry>(fs::directory_iterator(folder.path()), {}),
              testing::ElementsAre(fs::directory_entry(folder.path() / "whole")));
}

client::Layer layer_of(std::uint32_t index, const std::vector<v1::PlaneSpec>& planes) {
  client::Layer layer;
  layer.index = index;
  for (const v1::PlaneSpec& spec : planes) layer.planes.push_back({spec, "bytes", "", {}});
  layer.contours.push_back({{0, 0, 1.5, 0, 0, 1}, {1, 1, 1}, {0, 0, 0, 0, 0, 0}});
  return layer;
}

TEST(LayerFolder, NamesFilesByLayerAndPlane) {
  const TemporaryFolder folder;
  const auto planes = parse_planes({.occupancy = true, .channels = {"a b:f32", "a_b", "../evil"}}, false);
  LayerFolder layers(folder.path() / "out", {planes, {ContourFormat::kCsv}, 123'456}, Existing::kRefuse, {"job", 50});
  layers.write(layer_of(42, planes));
  layers.finish({}, client::job_of("id", {}), {});
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder.path() / "out")) names.push_back(entry.path().filename());
  EXPECT_THAT(names, testing::UnorderedElementsAre("layer_000042_occupancy.png", "layer_000042_a_b.zst",
                                                   "layer_000042_a_b_2.png", "layer_000042_.._evil.png",
                                                   "layer_000042_contours.csv", "manifest.json"));
  EXPECT_EQ(read_whole(folder.path() / "out" / "layer_000042_contours.csv"), "loop,x_mm,y_mm\n0,0,0\n0,1.5,0\n0,0,1\n");
}

TEST(LayerFiles, DrawContoursAsOnePathInMm) {
  client::Layer layer = layer_of(3, {});
  layer.z_mm = 0.35;
  layer.contours.push_back({{0.25, 0.25, 0.25, 0.5, 0.5, 0.25}, {}, {}});
  const LayerFiles files({}, {ContourFormat::kSvg, false, {-1, 0, 4, 2.5}}, 10);
  const std::vector<LayerFile> made = files.of(layer);
  ASSERT_EQ(made.size(), 1u);
  EXPECT_EQ(made[0].name, "layer_0003_contours.svg");
  EXPECT_EQ(made[0].bytes,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"4mm\" height=\"2.5mm\" viewBox=\"-1 -2.5 4 2.5\">\n"
            "<title>layer 3, z = 0.35 mm</title>\n"
            "<path fill-rule=\"evenodd\" d=\"M0,0L1.5,0L0,-1Z\nM0.25,-0.25L0.25,-0.5L0.5,-0.25Z\n\"/>\n</svg>\n");
  for (std::size_t i = 0; i < 2; ++i) layer.contours[i].cell_region = static_cast<std::uint32_t>(i + 1);
  EXPECT_THAT(LayerFiles({}, {ContourFormat::kSvg, true, {-1, 0, 4, 2.5}}, 10).of(layer)[0].bytes,
              testing::AllOf(HasSubstr("id=\"cell-region-1\""), HasSubstr("id=\"cell-region-2\"")));
}

TEST(LayerFiles, NameFacesAndParametersOfContoursAsJson) {
  const std::string text = LayerFiles({}, {ContourFormat::kJson}, 10).of(layer_of(3, {}))[0].bytes;
  EXPECT_THAT(text, HasSubstr("\"faces\":[1,1,1],\"parameters\":[0,0,0,0,0,0]}]"));
}

TEST(LayerFolder, RefusesToMixRuns) {
  const TemporaryFolder folder;
  const auto planes = parse_planes({}, false);
  const JobKey job{"job", 10};
  write_file(folder.path() / "notes.txt", "mine");
  { LayerFolder(folder.path(), {planes, {}, 10}, Existing::kRefuse, job).write(layer_of(3, planes)); }
  EXPECT_THROW(LayerFolder(folder.path(), {planes, {}, 10}, Existing::kRefuse, job), Error);
  { LayerFolder(folder.path(), {planes, {}, 10}, Existing::kReplace, job).write(layer_of(4, planes)); }
  EXPECT_FALSE(fs::exists(folder.path() / "layer_0003_occupancy.png"));
  EXPECT_TRUE(fs::exists(folder.path() / "layer_0004_occupancy.png"));
  EXPECT_TRUE(fs::exists(folder.path() / "notes.txt"));
}

TEST(LayerFolder, IsForOneJobAtATime) {
  const TemporaryFolder folder;
  const auto planes = parse_planes({}, false);
  const auto open = [&](Existing existing) { LayerFolder(folder.path(), {planes, {}, 10}, existing, {"job", 10}); };
  {
    LayerFolder first(folder.path(), {planes, {}, 10}, Existing::kRefuse, {"job", 10});
    first.write(layer_of(0, planes));
    for (const Existing existing : {Existing::kRefuse, Existing::kReplace, Existing::kResume}) {
      EXPECT_THROW(open(existing), Error);
      EXPECT_THROW(refuse_used_folder(folder.path(), existing), Error);
    }
    EXPECT_TRUE(fs::exists(folder.path() / "layer_0000_occupancy.png"));
  }
  EXPECT_FALSE(fs::exists(folder.path() / FolderLock::kName));
  write_file(folder.path() / FolderLock::kName, "");  // As a job that was killed leaves it.
  write_file(folder.path() / ".layer_0001_occupancy.png.0123abcd.part", "half");
  EXPECT_NO_THROW(refuse_used_folder(folder.path(), Existing::kResume));
  EXPECT_NO_THROW(open(Existing::kResume));
  EXPECT_FALSE(fs::exists(folder.path() / ".layer_0001_occupancy.png.0123abcd.part"));
}

TEST(FolderLock, SaysWhereItExcludesNobody) {
  const TemporaryFolder folder;
  const auto no_locks = [](int, int) {
    errno = ENOLCK;
    return -1;
  };
  {
    const FolderLock held(folder.path());
    EXPECT_TRUE(held.excludes_others());
    EXPECT_FALSE(FolderLock(folder.path(), no_locks).excludes_others());
  }
  EXPECT_FALSE(fs::exists(folder.path() / FolderLock::kName));
}

TEST(LayerFolder, GoesOnAfterTheLayersThatAreWhole) {
  const TemporaryFolder folder;
  const auto planes = parse_planes({}, false);
  const auto open = [&](const std::string& job, std::uint32_t layers) {
    return LayerFolder(folder.path(), {planes, {ContourFormat::kCsv}, 10}, Existing::kResume, {job, layers});
  };
  const auto finished = [&](std::uint32_t layers) { return open("job", layers).finished().layers; };
  EXPECT_EQ(finished(10), 0u) << "nothing is there yet";
  {
    LayerFolder layers = open("job", 10);
    for (std::uint32_t i = 0; i < 4; ++i) layers.write(layer_of(i, planes));
  }
  EXPECT_THROW(open("another", 10), Error);
  EXPECT_EQ(finished(10), 4u);
  EXPECT_EQ(finished(4), 3u) << "one layer is always sliced";
  EXPECT_EQ(finished(10), 3u) << "the journal was written anew";
  write_file(folder.path() / "layer_0002_occupancy.png", "bytez");
  EXPECT_EQ(finished(10), 2u) << "a file has changed";
  fs::remove(folder.path() / "layer_0000_contours.csv");
  EXPECT_EQ(finished(10), 0u) << "a file has gone";
}

TEST(LayerFolder, ManifestsOfInterruptedJobsAreTheSame) {
  const TemporaryFolder whole, parts;
  const auto planes = parse_planes({}, false);
  LayerFolder at_once(whole.path(), {planes, {ContourFormat::kJson}, 3}, Existing::kRefuse, {"job", 3});
  {
    LayerFolder(parts.path(), {planes, {ContourFormat::kJson}, 3}, Existing::kRefuse, {"job", 3})
        .write(layer_of(0, planes));
  }
  LayerFolder resumed(parts.path(), {planes, {ContourFormat::kJson}, 3}, Existing::kResume, {"job", 3});
  for (std::uint32_t i = 0; i < 3; ++i) at_once.write(layer_of(i, planes));
  for (std::uint32_t i = 1; i < 3; ++i) resumed.write(layer_of(i, planes));
  at_once.finish({}, client::job_of("id", {}), {});
  resumed.finish({}, client::job_of("id", {}), {});
  EXPECT_EQ(read_whole(whole.path() / "manifest.json"), read_whole(parts.path() / "manifest.json"));
  EXPECT_FALSE(fs::exists(parts.path() / "journal.jsonl"));
}

TEST(WriteFile, LeavesNothingWhereTheDiskIsFull) {
  const TemporaryFolder folder;
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{4096, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  std::string message;
  try {
    write_file(folder.path() / "layer.png", std::string(100'000, 'x'));
  } catch (const Error& error) {
    message = error.what();
    EXPECT_EQ(error.code(), ErrorCode::kFileUnwritable);
  }
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, old_handler);
  EXPECT_THAT(message, testing::HasSubstr("layer.png: File too large"));
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST(WriteFile, OnTheDiskIsWrittenAlike) {
  const TemporaryFolder folder;
  write_file_on_disk(folder.path() / "a", "first");
  EXPECT_EQ(read_whole(folder.path() / "a"), "first");
  EXPECT_NO_THROW(sync_folder(folder.path()));
  EXPECT_THROW(write_file_on_disk(folder.path() / "no" / "a", "x"), Error);
  EXPECT_THROW(sync_folder(folder.path() / "no"), Error);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 1);
}

TEST(ZipFile, OfMoreEntriesThan16BitsCountIsRead) {
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "many.zip";
  constexpr int kEntries = 66'000;
  ZipFile zip(path);
  for (int i = 0; i < kEntries; ++i) zip.add_stored("layer_" + std::to_string(i) + ".png", std::to_string(i));
  const std::uint64_t size = zip.finish();
  EXPECT_EQ(size, fs::file_size(path));
  const client::ProcessResult result =
      client::Process({"/usr/bin/python3", "-c",
                       "import sys, zipfile\n"
                       "archive = zipfile.ZipFile(sys.argv[1])\n"
                       "assert archive.testzip() is None\n"
                       "assert all(archive.read(f'layer_{i}.png') == b'%d' % i for i in range(66000))\n"
                       "print(len(archive.namelist()))",
                       path.string()},
                      folder.path())
          .wait();
  EXPECT_EQ(result.out, "66000\n") << result.err;
}

}  // namespace
}  // namespace ccslice::cli
