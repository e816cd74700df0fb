// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/volume_files/header_lines.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/mesh/expect_error.h"

namespace ccslice {
namespace {

using testing::ElementsAre;

TEST(HeaderLines, ReadsLinesOfEitherEnd) {
  HeaderLines lines("one \r\ntwo\n\nfour");
  EXPECT_EQ(lines.next(), "one");
  EXPECT_EQ(lines.next(), "two");
  EXPECT_EQ(lines.line(), 2u);
  EXPECT_EQ(lines.offset(), 10u);
  EXPECT_EQ(lines.next(), "");
  EXPECT_EQ(lines.next(), "four");
  EXPECT_TRUE(lines.at_end());
}

TEST(HeaderLines, TakesWordsAndNumbers) {
  HeaderLines lines("x");
  (void)lines.next();
  EXPECT_EQ(trimmed("\t a b \r"), "a b");
  EXPECT_EQ(trimmed("  "), "");
  EXPECT_EQ(lower_case("LeFt-1"), "left-1");
  EXPECT_THAT(words_of(" a  b\tc "), ElementsAre("a", "b", "c"));
  EXPECT_THAT(numbers_of("1 -2.5 3e2", 3, lines), ElementsAre(1, -2.5, 300));
  EXPECT_THAT(counts_of("4294967295 0", 0, lines), ElementsAre(4294967295u, 0u));
}

TEST(HeaderLines, NamesTheLine) {
  HeaderLines lines("x\ny");
  (void)lines.next();
  (void)lines.next();
  const auto refuses = [&](const auto& read, const std::string& part) {
    expect_error(read, ErrorCode::kFileSyntax, "line 2: " + part);
  };
  refuses([&] { (void)numbers_of("1 b", 2, lines); }, "expected a number, found 'b'");
  refuses([&] { (void)numbers_of("1 nan", 2, lines); }, "expected a number, found 'nan'");
  refuses([&] { (void)numbers_of("1 2", 3, lines); }, "expected 3 numbers, found 2");
  refuses([&] { (void)numbers_of("", 0, lines); }, "expected numbers, found 0");
  refuses([&] { (void)counts_of("4294967296", 1, lines); }, "expected a whole number");
  refuses([&] { (void)counts_of("-1", 1, lines); }, "expected a whole number");
  refuses([&] { lines.fail("no"); }, "no");
}

}  // namespace
}  // namespace ccslice
