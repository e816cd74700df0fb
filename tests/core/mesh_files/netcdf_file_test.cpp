// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/netcdf_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/error.h"
#include "tests/core/mesh/expect_error.h"

namespace ccslice {
namespace {

std::string be(std::uint64_t value, int size = 4) {
  std::string bytes;
  for (int i = size - 1; i >= 0; --i) bytes += static_cast<char>(value >> (8 * i));
  return bytes;
}

std::string name_of(std::string_view text) {
  return be(text.size()) + std::string(text) + std::string((4 - text.size() % 4) % 4, '\0');
}

constexpr std::string_view kNothing("\0\0\0\0\0\0\0\0", 8);

struct Variable {
  std::string name;
  std::vector<unsigned> dimensions;
  unsigned type;
  std::uint64_t begin;  // In the data.
};

/// A classic file over the dimensions "n" (without a size: records), "two" and "three".
std::string file_of(const std::vector<Variable>& variables, const std::string& data, std::uint64_t records = 0) {
  const auto with_data_at = [&](std::uint64_t data_at) {
    std::string bytes = "CDF\x01" + be(records) + be(10) + be(3) + name_of("n") + be(0) + name_of("two") + be(2) +
                        name_of("three") + be(3) + std::string(kNothing) + be(11) + be(variables.size());
    for (const Variable& variable : variables) {
      bytes += name_of(variable.name) + be(variable.dimensions.size());
      for (const unsigned dimension : variable.dimensions) bytes += be(dimension);
      bytes += std::string(kNothing) + be(variable.type) + be(0) + be(variable.begin + data_at);
    }
    return bytes;
  };
  return with_data_at(with_data_at(0).size()) + data;
}

std::vector<double> all(const NetcdfNumbers& numbers) {
  std::vector<double> values;
  for (std::uint64_t i = 0; i < numbers.size(); ++i) values.push_back(numbers[i]);
  return values;
}

TEST(NetcdfFile, NumbersOfEveryTypeAreRead) {
  const struct {
    unsigned type;
    std::string bytes;
    double first, second;
  } cases[] = {{1, "\xff\x02", -1, 2},
               {2, "a\xff", 97, 255},
               {3, be(0xfffe, 2) + be(3, 2), -2, 3},
               {4, be(0xfffffffd) + be(7), -3, 7},
               {5, be(0x3fc00000) + be(0xc0000000), 1.5, -2},
               {6, be(0x3ff8000000000000, 8) + be(0xc000000000000000, 8), 1.5, -2},
               {7, "\xff\x02", 255, 2},
               {8, be(0xfffe, 2) + be(3, 2), 65534, 3},
               {9, be(0xfffffffd) + be(7), 4294967293, 7},
               {10, be(~std::uint64_t{0}, 8) + be(7, 8), -1, 7},
               {11, be(std::uint64_t{1} << 60, 8) + be(7, 8), 1152921504606846976.0, 7}};
  for (const auto& item : cases) {
    const std::string bytes = file_of({{"v", {1}, item.type, 0}}, item.bytes);
    NetcdfFile file(bytes);
    EXPECT_THAT(all(file.numbers(*file.variable("v"))), testing::ElementsAre(item.first, item.second)) << item.type;
  }
}

TEST(NetcdfFile, ShapesAndDimensionsAreThoseOfTheHeader) {
  const std::string bytes = file_of({{"v", {1, 2}, 4, 0}}, std::string(24, '\0'));
  const NetcdfFile file(bytes);
  EXPECT_EQ(file.dimension("two"), 2u);
  EXPECT_EQ(file.dimension("four"), std::nullopt);
  EXPECT_EQ(file.variable("w"), nullptr);
  ASSERT_NE(file.variable("v"), nullptr);
  EXPECT_THAT(file.variable("v")->shape, testing::ElementsAre(2, 3));
  EXPECT_FALSE(file.variable("v")->has_records);
}

/// Slabs of several variables are padded to four bytes, those of a single one aren't.
TEST(NetcdfFile, TheLastRecordIsRead) {
  const std::string padded =
      file_of({{"a", {0, 1}, 2, 0}, {"b", {0}, 4, 4}}, "ab" + be(0, 2) + be(1) + "cd" + be(0, 2) + be(2), 2);
  NetcdfFile file(padded);
  EXPECT_EQ(file.record_count(), 2u);
  EXPECT_EQ(file.numbers(*file.variable("a")).bytes(), "cd");
  EXPECT_THAT(all(file.numbers(*file.variable("b"))), testing::ElementsAre(2));
  const std::string single = file_of({{"a", {0, 1}, 2, 0}}, "abcdef", 3);
  NetcdfFile alone(single);
  EXPECT_EQ(alone.numbers(*alone.variable("a")).bytes(), "ef");
  const std::string stream = file_of({{"a", {0, 1}, 2, 0}}, "abcdef", 0xffffffff);
  EXPECT_EQ(NetcdfFile(stream).record_count(), 3u) << "streams don't count their records";
  const std::string none = file_of({{"a", {0, 1}, 2, 0}}, "", 0);
  NetcdfFile empty(none);
  EXPECT_EQ(empty.numbers(*empty.variable("a")).size(), 0u);
}

TEST(NetcdfFile, TextsEndAtTheirZeros) {
  const std::string bytes = file_of({{"t", {1, 2}, 2, 0}, {"v", {1}, 4, 8}}, std::string("ab\0c  \0\0", 8) + be(0, 8));
  NetcdfFile file(bytes);
  EXPECT_THAT(file.texts(*file.variable("t")), testing::ElementsAre("ab", "c"));
  expect_error([&] { file.texts(*file.variable("v")); }, ErrorCode::kFileSyntax, "no rows of characters");
}

TEST(NetcdfFile, DamageIsNamed) {
  const auto expect = [](const std::string& bytes, const std::string& part) {
    expect_error(
        [&] {
          NetcdfFile file(bytes);
          for (const char* name : {"v", "w"}) {
            if (const NetcdfVariable* variable = file.variable(name)) (void)file.numbers(*variable);
          }
        },
        ErrorCode::kFileSyntax, part);
  };
  const std::string numbers(8, '\1');
  const std::string whole = file_of({{"v", {1}, 4, 0}}, numbers);
  expect("CD", "end of the file");
  expect("CDF\x04" + whole.substr(4), "a version, 1, 2 or 5");
  for (std::size_t size = 4; size < whole.size(); size += 4) expect(whole.substr(0, size), "end of the file");
  expect(file_of({{"v", {7}, 4, 0}}, numbers), "the number of a dimension, found '7'");
  expect(file_of({{"v", {1, 0}, 4, 0}}, numbers), "a dimension that has a size");
  expect(file_of({{"v", {1}, 12, 0}}, numbers), "a type from 1 to 11, found '12'");
  expect(file_of({{"v", {1}, 4, 4}}, numbers), "'v' goes beyond the end of the file");
  expect(file_of({{"v", {1}, 4, 0xffffff00}}, numbers), "'v' goes beyond the end of the file");
  expect(file_of({{"v", std::vector<unsigned>(50, 2), 6, 0}}, numbers), "'v' goes beyond the end of the file");
  const std::string much(400, '\1');
  expect(file_of({{"v", {2, 2, 2, 2}, 4, 0}, {"w", {2, 2, 2, 2}, 4, 0}}, much), "'w' shares bytes with others");
}

}  // namespace
}  // namespace ccslice
