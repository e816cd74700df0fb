// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output/point_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "client/cli/base/text_values.h"
#include "core/base/error.h"

namespace ccslice::cli {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class PointFileTest : public testing::Test {
 protected:
  PointFileTest() { std::filesystem::create_directories(folder_); }
  ~PointFileTest() override { std::filesystem::remove_all(folder_); }

  std::string file_of(const std::string& text) {
    std::ofstream(path_, std::ios::binary) << text;
    return path_;
  }

  std::vector<double> all_of(const std::string& text, std::size_t most) {
    PointFile file(file_of(text));
    std::vector<double> all;
    for (std::vector<double> next = file.next(most); !next.empty(); next = file.next(most)) {
      EXPECT_LE(next.size(), 3 * most);
      all.insert(all.end(), next.begin(), next.end());
    }
    return all;
  }

  std::string error_of(const std::string& text) {
    try {
      all_of(text, 4096);
    } catch (const std::exception& error) {
      return error.what();
    }
    return {};
  }

  const std::filesystem::path folder_ = std::filesystem::temp_directory_path() / ("points-" + std::to_string(getpid()));
  const std::string path_ = folder_ / "points.csv";
};

TEST_F(PointFileTest, ReadsPointsHoweverTheyAreWritten) {
  for (const std::size_t most : {std::size_t{1}, std::size_t{2}, std::size_t{100}}) {
    EXPECT_THAT(all_of("1,2,3\n# a comment, 7 8 9\n4 5\t6\r\n\n-1e3, +.5,0 7 8 9", most),
                ElementsAre(1, 2, 3, 4, 5, 6, -1000, 0.5, 0, 7, 8, 9));
    EXPECT_TRUE(all_of("", most).empty());
    EXPECT_TRUE(all_of("# nothing\n", most).empty());
  }
}

TEST_F(PointFileTest, ReadsWhatIsLongerThanABlock) {
  std::string text;
  for (int i = 0; i < 100'000; ++i) {
    text += std::to_string(i) + ",0," + std::string(static_cast<std::size_t>(i % 17), ' ') + "1\n";
  }
  const std::vector<double> points = all_of(text, 4096);
  ASSERT_EQ(points.size(), 300'000u);
  for (std::size_t i = 0; i < 100'000; ++i) ASSERT_EQ(points[3 * i], static_cast<double>(i));
}

TEST_F(PointFileTest, NamesTheLine) {
  std::string long_text;
  for (int i = 0; i < 100'000; ++i) long_text += "1 2 3\n";
  EXPECT_THAT(error_of(long_text + "1 2 x\n"), AllOf(HasSubstr("100001"), HasSubstr("'x'")));
  EXPECT_THAT(error_of("1 2 3\n4 5 nan\n"), AllOf(HasSubstr("line 2"), HasSubstr("nan")));
  EXPECT_THAT(error_of("1 2 3\n4 5\n"), HasSubstr("must hold three coordinates a point"));
  EXPECT_THAT(error_of(std::string(3 << 20, '1')), HasSubstr("line 1 has more than"));
  EXPECT_THROW(PointFile(folder_ / "nowhere"), Error);
  EXPECT_THROW(PointFile{folder_}, Error);
}

TEST_F(PointFileTest, ReadsPipes) {
  ASSERT_EQ(mkfifo(path_.c_str(), 0600), 0);
  std::thread writer([&] {
    std::ofstream pipe(path_);
    pipe << "1 2 3\n4 5 ";
    pipe.flush();
    pipe << "6\n";
  });
  PointFile file(path_);
  EXPECT_THAT(file.next(4096), ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_TRUE(file.next(4096).empty());
  writer.join();
}

}  // namespace
}  // namespace ccslice::cli
