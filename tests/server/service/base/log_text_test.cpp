// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/base/log_text.h"

#include <gtest/gtest.h>

namespace ccslice::server {
namespace {

TEST(LogText, KeepsOrdinaryTextAsItIs) {
  EXPECT_EQ(to_log_line("layers 3+4: \"Härte\" \\ 5 µm"), "layers 3+4: \"Härte\" \\ 5 µm");
  EXPECT_EQ(to_log_json("Härte 5 µm"), "Härte 5 µm");
}

TEST(LogText, LetsNobodyForgeALineOrMoveTheCursor) {
  EXPECT_EQ(to_log_line("a\n2026-11-21 info: forged\r\x1b[2J"), "a\\x0a2026-11-21 info: forged\\x0d\\x1b[2J");
  EXPECT_EQ(to_log_line("\x7f|\xc2\x9b"), "\\x7f|\\xc2\\x9b") << "DEL, and CSI as one character";
  EXPECT_EQ(to_log_json("\"\\\n\xc2\x9b"), "\\\"\\\\\\u000a\\u009b");
}

TEST(LogText, EscapesWhatIsNotUtf8) {
  EXPECT_EQ(to_log_line("\xff|\xc3"), "\\xff|\\xc3");
  EXPECT_EQ(to_log_line("\xc0\xafx\xe2\x82"), "\\xc0\\xafx\\xe2\\x82") << "overlong, cut off";
  EXPECT_EQ(to_log_line("\xed\xa0\x80"), "\\xed\\xa0\\x80") << "a surrogate";
  EXPECT_EQ(to_log_line("€ 𝄞"), "€ 𝄞");
  EXPECT_EQ(to_log_json("\xff"), "\xef\xbf\xbd");
}

TEST(LogText, IsBounded) {
  EXPECT_EQ(to_log_line(std::string(kMaxLogTextBytes, 'x')).size(), kMaxLogTextBytes);
  const std::string cut = to_log_line(std::string(4 << 20, '\n'));
  EXPECT_LT(cut.size(), kMaxLogTextBytes + 10);
  EXPECT_TRUE(cut.ends_with("..."));
  EXPECT_LT(to_log_json(std::string(4 << 20, '"')).size(), kMaxLogTextBytes + 10);
}

}  // namespace
}  // namespace ccslice::server
