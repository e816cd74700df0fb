// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/options/job_file.h"

#include <gmock/gmock.h>
#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <string>

#include "client/cli/base/message_json.h"
#include "client/cli/base/text_values.h"
#include "client/job.h"
#include "core/base/error.h"
#include "tests/support/temporary_folder.h"

namespace ccslice::cli {
namespace {

using google::protobuf::util::MessageDifferencer;
using testing::HasSubstr;

v1::SliceJob job_with_everything() {
  v1::Placement placement;
  for (const double entry : {0.1, 1.0 / 3, 0.0, -7e-300, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 5e200}) {
    placement.add_matrix(entry);
  }
  v1::SliceJob job = client::job_of("sha256:ab", placement);
  job.mutable_grid()->mutable_pitch()->set_x_mm(25.4 / 600);
  job.mutable_parts(0)->set_name("\xc3\xa4 \"part\"");
  job.mutable_parts(0)->set_halftone_seed(18446744073709551615u);
  job.add_planes()->mutable_channel()->set_name("hardness");
  job.mutable_contours();
  return job;
}

class JobFile : public testing::Test {
 protected:
  std::string write(const std::string& text) const {
    std::ofstream(path_) << text;
    return path_;
  }
  std::string error_of(const std::string& text) const {
    try {
      read_job_file(write(text));
    } catch (const UsageError& error) {
      return error.what();
    }
    return "is read";
  }

  TemporaryFolder folder_;
  const std::string path_ = (folder_.path() / "job.json").string();
};

TEST_F(JobFile, ComesBackAsItWasWritten) {
  const v1::SliceJob job = job_with_everything();
  write_job_file(path_, job);
  EXPECT_TRUE(MessageDifferencer::Equals(read_job_file(path_), job));
  EXPECT_TRUE(MessageDifferencer::Equals(read_job_file(write(protobuf_json(job))), job));
}

TEST_F(JobFile, KeepsAnotherJobThatIsThere) {
  v1::SliceJob job = job_with_everything();
  write_job_file(path_, job);
  write_job_file(path_, job);
  job.clear_planes();
  EXPECT_THROW(write_job_file(path_, job), Error);
  EXPECT_EQ(read_job_file(path_).planes_size(), 1);
}

TEST_F(JobFile, TakesNamesOfTheContractAndOfJson) {
  EXPECT_EQ(read_job_file(write(R"({"parts": [{"mesh_id": "a.ccmesh"}]})")).parts(0).mesh_id(), "a.ccmesh");
  EXPECT_EQ(read_job_file(write(R"({"parts": [{"meshId": "a.ccmesh"}]})")).parts(0).mesh_id(), "a.ccmesh");
}

TEST_F(JobFile, NamesTheFileAndWhatIsWrong) {
  for (const auto& [text, what] : {std::pair("", "isn't a SliceJob"),
                                   {"[]", "isn't a SliceJob"},
                                   {"{}", "no parts"},
                                   {R"({"parts": [{"mesh_id": "a"}], "pitch": 1})", "pitch"},
                                   {R"({"parts": [{"mesh_id": 7e}]})", "isn't a SliceJob"},
                                   {R"({"parts": [{"halftone_seed": -1}]})", "halftone_seed"}}) {
    EXPECT_THAT(error_of(text), testing::AllOf(HasSubstr(path_), HasSubstr(what))) << text;
  }
  EXPECT_THROW(read_job_file("/no/such/file"), Error);
}

TEST_F(JobFile, MayBeginWithAMarkOfUtf8) {
  EXPECT_EQ(read_job_file(write("\xef\xbb\xbf{\"parts\": [{\"mesh_id\": \"a\"}]}")).parts(0).mesh_id(), "a");
}

TEST_F(JobFile, RefusesDeepNestsAtOnce) {
  const auto start = std::chrono::steady_clock::now();
  for (const char* const opening : {"[", "{\"parts\":[", "[[{\"a\":"}) {
    std::string text;
    while (text.size() < (6u << 20)) text += opening;
    EXPECT_THAT(error_of(text), testing::AllOf(HasSubstr(path_), HasSubstr("nested deeper")));
  }
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(5));
  EXPECT_EQ(read_job_file(write(R"({"parts": [{"mesh_id": "\")" + std::string(99, '[') + R"("}]})")).parts_size(), 1);
}

TEST_F(JobFile, IsKnownByItsFirstMember) {
  for (const char* const text :
       {R"({"parts": []})", " \n{ \"grid\": {}", "\xef\xbb\xbf{\"meshId\": 1, \"parts\": []}"}) {
    EXPECT_EQ(is_job_file(write(text)), std::string(text).find("meshId") == std::string::npos) << text;
  }
  for (const char* const text :
       {"", "{}", "[{\"parts\": 1}]", R"({"positions": [1], "parts": []})", "{\"parts", "solid"}) {
    EXPECT_EQ(is_job_file(write(text)), std::string(text) == "{\"parts") << text;
  }
  write_job_file((folder_.path() / "written.json").string(), job_with_everything());
  EXPECT_TRUE(is_job_file((folder_.path() / "written.json").string()));
  EXPECT_FALSE(is_job_file(folder_.path().string()));
  EXPECT_FALSE(is_job_file("/no/such/file"));
}

TEST_F(JobFile, IsReplacedWhereThatIsAskedFor) {
  v1::SliceJob job = job_with_everything();
  replace_job_file(path_, job);
  job.clear_planes();
  replace_job_file(path_, job);
  EXPECT_TRUE(MessageDifferencer::Equals(read_job_file(path_), job));
}

TEST_F(JobFile, NamesMeshesBesideItself) {
  EXPECT_EQ(mesh_name_beside("jobs/tray.json", "jobs/a.vtk"), "a.vtk");
  EXPECT_EQ(mesh_name_beside("tray.json", "meshes/a.vtk"), "meshes/a.vtk");
  EXPECT_EQ(mesh_name_beside("/no/jobs/tray.json", "/no/a.vtk"), "../a.vtk");
  EXPECT_EQ(mesh_path("jobs/tray.json", mesh_name_beside("jobs/tray.json", "a.vtk")), "jobs/../a.vtk");
}

TEST_F(JobFile, HasPathsBesideItself) {
  EXPECT_EQ(mesh_path("jobs/tray.json", "a/b.vtk"), "jobs/a/b.vtk");
  EXPECT_EQ(mesh_path("tray.json", "b.vtk"), "b.vtk");
  EXPECT_EQ(mesh_path("jobs/tray.json", "/b.vtk"), "/b.vtk");
}

}  // namespace
}  // namespace ccslice::cli
