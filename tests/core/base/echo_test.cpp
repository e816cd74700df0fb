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

TEST(Echoed, ReplacesWhatATerminalWouldObey) {
  EXPECT_EQ(echoed("a\x1b[2J"), "a?[2J");
  EXPECT_EQ(echoed("a\b\b"), "a??");
  EXPECT_EQ(echoed("\xc2\x9b"
                   "2J"),
            "?2J")
      << "CSI as one character of C1";
  EXPECT_EQ(echoed("\x9b"
                   "2J \xff"),
            "?2J ?")
      << "the same without UTF-8";
  EXPECT_EQ(echoed("a\xe2\x80\xae"
                   "b"),
            "a?b")
      << "from right to left";
  EXPECT_EQ(echoed("H\xc3\xa4rte \xe2\x82\xac"), "H\xc3\xa4rte \xe2\x82\xac");
}

TEST(Harmless, IsWholeAndKeepsLines) {
  const std::string lines = "one\n\ttwo " + std::string(1000, 'x');
  EXPECT_EQ(harmless(lines), lines);
  EXPECT_EQ(harmless("a\rb\x1b[31m\xc2\x85"
                     "c\x9b"),
            "a?b?[31m?c?");
}

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
