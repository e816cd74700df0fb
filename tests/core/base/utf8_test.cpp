// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/base/utf8.h"

#include <gtest/gtest.h>

#include <string>

namespace ccslice {
namespace {

TEST(Utf8, IsToldFromOtherBytes) {
  for (const char* good : {"", "abc", "\xc3\xa4", "\xe2\x82\xac", "\xf0\x9f\x98\x80"}) EXPECT_TRUE(is_utf8(good));
  for (const char* bad : {"\x80", "\xc3", "\xc0\x80", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\xf8\x88\x80\x80\x80"}) {
    EXPECT_FALSE(is_utf8(bad));
  }
}

TEST(Utf8, SequencesAreCodePoints) {
  EXPECT_EQ(utf8_code_point("a"), 0x61u);
  EXPECT_EQ(utf8_code_point("\xc2\x9b"), 0x9bu);
  EXPECT_EQ(utf8_code_point("\xe2\x82\xac"), 0x20acu);
  EXPECT_EQ(utf8_code_point("\xf0\x9f\x98\x80"), 0x1f600u);
}

TEST(Utf8, IsMadeOfLatin1) {
  EXPECT_EQ(utf8_of_latin1("a\xd6z\x80\xff"), "a\xc3\x96z\xc2\x80\xc3\xbf");
  std::string all;
  for (int c = 0; c < 256; ++c) all += static_cast<char>(c);
  std::string rest = utf8_of_latin1(all);
  for (std::uint32_t c = 0; c < 256; ++c) {
    const std::size_t length = utf8_sequence_length(rest);
    EXPECT_EQ(utf8_code_point(std::string_view(rest).substr(0, length)), c);
    rest.erase(0, length);
  }
  EXPECT_EQ(rest, "");
}

TEST(Utf8, KnowsWhatATerminalObeys) {
  for (const std::uint32_t obeyed : {0x00u, 0x08u, 0x1bu, 0x7fu, 0x80u, 0x9bu, 0x9fu, 0x2028u, 0x202eu, 0x2066u}) {
    EXPECT_TRUE(is_control(obeyed)) << std::hex << obeyed;
  }
  for (const std::uint32_t shown : {0x20u, 0x7eu, 0xa0u, 0xe4u, 0x200du, 0x20acu, 0x1f600u}) {
    EXPECT_FALSE(is_control(shown)) << std::hex << shown;
  }
}

}  // namespace
}  // namespace ccslice
