// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/base/echo.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/base/number_text.h"

namespace ccslice {
namespace {

TEST(Echoed, KeepsWhatIsShort) {
  EXPECT_EQ(echoed(""), "");
  EXPECT_EQ(echoed("stiffness"), "stiffness");
  EXPECT_EQ(echoed(std::string(64, 'x')), std::string(64, 'x'));
}

TEST(Echoed, CutsWhatIsLong) {
  EXPECT_EQ(echoed(std::string(65, 'x')), std::string(64, 'x') + "...");
  EXPECT_EQ(echoed(std::string(1 << 20, 'x')), std::string(64, 'x') + "...");
}

TEST(Echoed, NeverCutsACharacterInTwo) {
  const std::string two = "\xc3\xa9", three = "\xe2\x82\xac", four = "\xf0\x9f\x98\x80";
  for (const std::string& character : {two, three, four}) {
    for (int shift = 0; shift < 4; ++shift) {
      std::string text(static_cast<std::size_t>(shift), 'x');
      while (text.size() < 100) text += character;
      const std::string echo = echoed(text);
      ASSERT_TRUE(echo.ends_with("..."));
      EXPECT_EQ((echo.size() - 3 - static_cast<std::size_t>(shift)) % character.size(), 0u);
      EXPECT_GT(echo.size(), 60u);
      EXPECT_LE(echo.size(), 67u);
    }
  }
  EXPECT_EQ(echoed(std::string(100, '\x80')), "...") << "no UTF-8 at all";
}

TEST(Echoed, ReplacesControlCharacters) { EXPECT_EQ(echoed(std::string("a\n\0b\x7f", 5)), "a??b?"); }

TEST(EchoedList, NamesTheFirstAndCountsTheRest) {
  std::vector<std::string> items = {"1", "2", "3"};
  EXPECT_EQ(echoed_list(items, 3), "1, 2, 3");
  EXPECT_EQ(echoed_list(items, 100'000), "1, 2, 3 and 99997 more");
  items.assign(20, "x");
  EXPECT_EQ(echoed_list(items, 20), "x, x, x, x, x, x, x, x and 12 more");
}

TEST(NumberText, HasTheDigitsThatTellANumberFromItsNeighbours) {
  EXPECT_EQ(number_text(0.1), "0.1");
  EXPECT_EQ(number_text(100000), "100000");
  EXPECT_EQ(number_text(1e-9), "1e-09");
  EXPECT_EQ(number_text(5e-324), "4.940656458e-324");
  EXPECT_EQ(number_text(1000.0000000000001), "1000.0000000000001");
  EXPECT_EQ(number_text(1.0 / 3, 4), "0.3333");
}

}  // namespace
}  // namespace ccslice
