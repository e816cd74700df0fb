// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/volume_files/read_nifti.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <string>

#include "tests/core/mesh/expect_error.h"
#include "tests/core/volume_files/volume_bytes.h"

namespace ccslice {
namespace {

using testing::ElementsAre;

/// A header by the offsets of nifti1.h, of 3 x 2 x 1 samples of 16 bits behind it.
class Nifti {
 public:
  explicit Nifti(bool big_endian = false) : big_endian_(big_endian) {
    set<std::int32_t>(0, 348);
    shape({3, 3, 2, 1});
    set<std::int16_t>(70, 4);
    for (std::size_t axis = 0; axis < 4; ++axis) set<float>(76 + 4 * axis, 1);
    set<float>(108, 352);
    bytes_.replace(344, 3, "n+1");
  }
  template <typename Number>
  Nifti& set(std::size_t at, Number number) {
    bytes_.replace(at, sizeof(Number), raw<Number>({number}, big_endian_));
    return *this;
  }
  Nifti& shape(const std::vector<std::int16_t>& dim) {
    for (std::size_t i = 0; i < dim.size(); ++i) set<std::int16_t>(40 + 2 * i, dim[i]);
    return *this;
  }
  Nifti& floats(std::size_t at, const std::vector<float>& numbers) {
    for (std::size_t i = 0; i < numbers.size(); ++i) set<float>(at + 4 * i, numbers[i]);
    return *this;
  }
  std::string with(const std::string& samples) const { return bytes_ + samples; }
  std::string text() const { return with(raw<std::int16_t>({1, 2, 3, -4, 5, 600}, big_endian_)); }

 private:
  bool big_endian_;
  std::string bytes_ = std::string(352, '\0');
};

TEST(ReadNifti, ReadsBothByteOrdersAndGzip) {
  expect_six_samples(read_nifti(Nifti().text()));
  expect_six_samples(read_nifti(Nifti(true).text()));
  expect_six_samples(read_nifti(gzipped(Nifti().text())));
  EXPECT_TRUE(is_nifti(Nifti().text()));
  EXPECT_FALSE(is_nifti("what else, which is long enough"));
}

TEST(ReadNifti, TurnsSformToLps) {
  Nifti file;
  file.set<std::int16_t>(254, 1).floats(280, {0, 2, 0, 10, 3, 0, 0, 20, 0, 0, 4, 30});
  const VolumeFile read = read_nifti(file.text());
  EXPECT_TRUE(read.is_lps);
  EXPECT_TRUE((*read.mm_of_index * Vec3(1, 10, 1)).isApprox(Vec3(-30, -23, 34)));
}

TEST(ReadNifti, TurnsQformToLps) {
  Nifti file;
  file.set<std::int16_t>(252, 1).floats(256, {0, 0, 0.70710678f, 10, 20, 30}).floats(76, {1, 2, 3, 4});
  // A quarter turn about z: axis i goes along y, axis j against x.
  EXPECT_TRUE((*read_nifti(file.text()).mm_of_index * Vec3(1, 1, 1)).isApprox(Vec3(-(10 - 3), -(20 + 2), 34), 1e-6));
  file.set<float>(76, -1);  // qfac
  EXPECT_TRUE((*read_nifti(file.text()).mm_of_index * Vec3(1, 1, 1)).isApprox(Vec3(-(10 - 3), -(20 + 2), 26), 1e-6));
  file.floats(256, {1, 0, 0});  // Half a turn about x, whose first number is 0.
  EXPECT_TRUE((*read_nifti(file.text()).mm_of_index * Vec3(0, 1, 0)).isApprox(Vec3(-10, -(20 - 3), 30), 1e-6));
}

TEST(ReadNifti, TakesSpacingAloneWithoutEither) {
  const VolumeFile read = read_nifti(Nifti().floats(76, {1, 2, 3, 0}).set<std::uint8_t>(123, 3).text());
  EXPECT_FALSE(read.is_lps);
  EXPECT_TRUE((*read.mm_of_index * Vec3(1, 1, 1)).isApprox(Vec3(0.002, 0.003, 0.001)));  // um
}

TEST(ReadNifti, HasSlopes) {
  const VolumeFile none = read_nifti(Nifti().floats(112, {0, 7}).text());
  EXPECT_EQ(none.slope, 1);
  EXPECT_EQ(none.intercept, 0);
  const VolumeFile scaled = read_nifti(Nifti().floats(112, {0.5, -1024}).text());
  EXPECT_EQ(scaled.slope, 0.5);
  EXPECT_EQ(scaled.intercept, -1024);
}

TEST(ReadNifti, MakesChannelsOfTimesAndColours) {
  const VolumeFile times = read_nifti(Nifti().shape({4, 2, 1, 1, 3}).set<std::int16_t>(70, 2).with("adbecf"));
  EXPECT_EQ(times.shape.channels, 3u);
  EXPECT_THAT(numbers_of(times), ElementsAre('a', 'b', 'c', 'd', 'e', 'f'));
  const VolumeFile colours = read_nifti(Nifti().shape({3, 2, 1, 1}).set<std::int16_t>(70, 128).with("abcdef"));
  EXPECT_EQ(colours.shape.channels, 3u);
  EXPECT_THAT(numbers_of(colours), ElementsAre('a', 'b', 'c', 'd', 'e', 'f'));
}

TEST(ReadNifti, SaysWhatIsWrong) {
  const auto refuses = [](const std::string& text, ErrorCode code, const std::string& part) {
    expect_error([&] { (void)read_nifti(text); }, code, part);
  };
  const ErrorCode syntax = ErrorCode::kFileSyntax, unsupported = ErrorCode::kFileUnsupported;
  refuses("short", unsupported, "NIfTI-1");
  std::string second = Nifti().text();
  second.replace(0, 4, raw<std::int32_t>({540}));
  EXPECT_TRUE(is_nifti(second));
  refuses(second, unsupported, "NIfTI-2");
  std::string detached = Nifti().text();
  detached.replace(344, 3, "ni1");
  refuses(detached, unsupported, "same file");
  refuses(Nifti().shape({0}).text(), syntax, "dim[0] is 0");
  refuses(Nifti().shape({3, 3, -2, 1}).text(), syntax, "dim[2]");
  refuses(Nifti().set<std::int16_t>(70, 32).text(), unsupported, "datatype 32");
  refuses(Nifti().set<float>(108, 12).text(), syntax, "vox_offset");
  refuses(Nifti().set<std::int16_t>(254, 1).floats(280, {std::numeric_limits<float>::quiet_NaN()}).text(), syntax,
          "isn't finite");
  refuses(Nifti().text().substr(0, 360), syntax, "cut off");
  refuses(gzipped(Nifti().text()).substr(0, 40), syntax, "ends too early");
  refuses(Nifti().shape({4, 3, 2, 1, 300}).text(), ErrorCode::kVolumeInvalid, "channels: 300");
  refuses(Nifti().shape({7, 32767, 32767, 32767, 32767, 32767, 32767, 32767}).text(), ErrorCode::kVolumeInvalid, "");
  refuses(Nifti().shape({4, 3, 2, 1, 2}).set<std::int16_t>(70, 128).text(), unsupported, "colours at several times");
}

}  // namespace
}  // namespace ccslice
