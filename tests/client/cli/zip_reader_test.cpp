// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/tray/zip_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <random>
#include <string>

#include "core/base/error.h"
#include "tests/client/cli/package_files.h"
#include "tests/client/process.h"

namespace ccslice::cli {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class ZipReaderTest : public testing::Test {
 protected:
  static std::string error_of(const std::function<void()>& action) {
    try {
      action();
    } catch (const Error& error) {
      return std::string(reason(error.code())) + " " + error.what();
    }
    return "no error";
  }

  TemporaryFolder folder_;
  const std::string path_ = (folder_.path() / "plate.3mf").string();
};

TEST_F(ZipReaderTest, ReadsWhatIsThereInAnyCaseOfLetters) {
  write_package(path_, {{"3D/3dmodel.model", "<model/>"}, {"empty", ""}});
  ZipReader zip(path_, 1 << 20);
  EXPECT_TRUE(zip.has("3D/3dmodel.model"));
  EXPECT_TRUE(zip.has("3d/3DModel.model"));
  EXPECT_FALSE(zip.has("3D"));
  EXPECT_EQ(zip.read("3D/3DModel.model"), "<model/>");
  EXPECT_EQ(zip.read("empty"), "");
}

TEST_F(ZipReaderTest, RefusesWhatUnpacksToMoreThanIsAllowed) {
  write_package(path_, {{"a", std::string(600'000, '\0')}, {"b", std::string(600'000, '\0')}});
  EXPECT_LT(std::filesystem::file_size(path_), 10'000u);
  ZipReader zip(path_, 1'000'000);
  EXPECT_EQ(zip.read("a").size(), 600'000u);
  EXPECT_THAT(error_of([&] { zip.read("b"); }),
              AllOf(HasSubstr("MESH_TOO_LARGE"), HasSubstr("with b"), HasSubstr("--max-file-bytes")));
  EXPECT_THAT(error_of([&] { ZipReader(path_, 10); }), HasSubstr("more than 10 bytes"));
}

TEST_F(ZipReaderTest, NeverReadsMoreThanTheArchiveSays) {
  write_package(path_, {{"a", std::string(100'000, 'x')}});
  std::string bytes = client::read_whole(path_);
  // The size in the central directory, which is what counts: 24 bytes behind its signature.
  const std::size_t directory = bytes.find("PK\x01\x02");
  bytes.replace(directory + 24, 4, std::string("\x10\0\0\0", 4));
  std::ofstream(path_, std::ios::binary) << bytes;
  ZipReader zip(path_, 1 << 20);
  EXPECT_THAT(error_of([&] { zip.read("a"); }), AllOf(HasSubstr("FILE_SYNTAX"), HasSubstr("damaged")));
}

TEST_F(ZipReaderTest, NamesFilesThatAreNoArchives) {
  std::ofstream(path_) << "solid ring";
  EXPECT_THAT(error_of([&] { ZipReader(path_, 100); }), AllOf(HasSubstr("plate.3mf"), HasSubstr("no 3MF package")));
  EXPECT_THAT(error_of([&] { ZipReader("/no/such.3mf", 100); }), HasSubstr("FILE_UNREADABLE"));
  EXPECT_THAT(error_of([&] { ZipReader(folder_.path(), 100); }), HasSubstr("FILE_UNREADABLE"));
}

TEST_F(ZipReaderTest, DamagedArchivesAreErrorsOnly) {
  write_package(path_, {{"a", "a text that is in the archive twice, twice"}, {"b", std::string(5000, 'b')}});
  const std::string whole = client::read_whole(path_);
  constexpr unsigned kSeed = 17;
  std::mt19937 random(kSeed);
  int errors = 0;
  for (int round = 0; round < 200; ++round) {
    std::string bytes = whole;
    for (int i = 0; i < 1 + round % 4; ++i) bytes[random() % bytes.size()] = static_cast<char>(random());
    if (round % 5 == 0) bytes.resize(random() % bytes.size());
    std::ofstream(path_, std::ios::binary) << bytes;
    const std::string error = error_of([&] {
      ZipReader zip(path_, 1 << 20);
      for (const char* const name : {"a", "b"}) {
        if (zip.has(name)) zip.read(name);
      }
    });
    errors += error != "no error";
  }
  EXPECT_GT(errors, 50);
}

}  // namespace
}  // namespace ccslice::cli
