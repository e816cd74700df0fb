// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/text_scanner.h"
#include "core/base/similar_name.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <limits>
#include <random>
#include <sstream>

namespace ccslice {
namespace {

using testing::HasSubstr;

/// What a call throws: its code and message.
std::pair<ErrorCode, std::string> thrown(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    return {error.code(), error.what()};
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

TEST(TextScanner, ReadsTokensWithTheirLines) {
  TextScanner scanner("  one\ttwo # not this\n\r\n#nor this\nthree");
  EXPECT_EQ(scanner.next("a word"), "one");
  EXPECT_EQ(scanner.line(), 1u);
  EXPECT_EQ(scanner.peek(), "two");
  EXPECT_EQ(scanner.next("a word"), "two");
  EXPECT_FALSE(scanner.at_end());
  EXPECT_EQ(scanner.next("a word"), "three");
  EXPECT_EQ(scanner.line(), 4u);
  EXPECT_TRUE(scanner.at_end());
  EXPECT_EQ(scanner.peek(), "");
  const auto [code, message] = thrown([&] { scanner.next("a word"); });
  EXPECT_EQ(code, ErrorCode::kFileSyntax);
  EXPECT_THAT(message, HasSubstr("line 4: expected a word, found the end of the file"));
}

TEST(TextScanner, NamesLinesOfTheFileThatItsTextIsAPartOf) {
  TextScanner scanner("1\nx");
  scanner.start_at_line(70);
  scanner.real("a number");
  EXPECT_EQ(scanner.line(), 70u);
  EXPECT_THAT(thrown([&] { scanner.real("a number"); }).second, HasSubstr("line 71"));
}

TEST(TextScanner, ReadsHashesWhereNoCommentsAre) {
  TextScanner scanner("#1 # 2", TextScanner::Comments::kNone);
  EXPECT_EQ(scanner.next(""), "#1");
  EXPECT_EQ(scanner.next(""), "#");
  EXPECT_EQ(scanner.next(""), "2");
}

TEST(TextScanner, RealsAreTheNearestDoubles) {
  constexpr std::uint32_t kSeed = 20261123;
  std::mt19937_64 random(kSeed);
  std::ostringstream text;
  text.precision(17);
  std::vector<double> expected;
  while (expected.size() < 2000) {
    double value;
    const std::uint64_t bits = random();
    std::memcpy(&value, &bits, sizeof value);
    if (!std::isnormal(value)) continue;
    expected.push_back(value);
    text << value << (random() % 5 == 0 ? '\n' : ' ');
  }
  const std::string written = text.str();
  TextScanner scanner(written);
  for (const double value : expected) ASSERT_EQ(scanner.real("a number"), value) << "seed " << kSeed;
  TextScanner others("+1.5 -0 1e-400 -1e-400 .5 5. 1E2");
  for (const double value : {1.5, 0.0, 0.0, 0.0, 0.5, 5.0, 100.0}) EXPECT_EQ(others.real("a number"), value);
}

TEST(TextScanner, RefusesWhatIsNoFiniteNumber) {
  for (const char* text : {"foo", "1.5mm", "0x10", "1,5", "--1", "+", "1e", "+-1"}) {
    TextScanner scanner(text);
    const auto [code, message] = thrown([&] { scanner.real("a coordinate"); });
    EXPECT_EQ(code, ErrorCode::kFileSyntax) << text;
    EXPECT_THAT(message, HasSubstr("line 1: expected a coordinate, found " + in_quotes(text)));
  }
  for (const char* text : {"nan", "inf", "-inf", "1e400", "-1e400"}) {
    TextScanner scanner(text);
    EXPECT_EQ(thrown([&] { scanner.real("a coordinate"); }).first, ErrorCode::kMeshNonFinite) << text;
  }
  TextScanner scanner("1e39");
  EXPECT_EQ(thrown([&] { scanner.real_float("a value"); }).first, ErrorCode::kMeshNonFinite);
}

TEST(TextScanner, CountsAreWholeNumbersThatDoublesHold) {
  TextScanner scanner("0 9007199254740992 12 13");
  EXPECT_EQ(scanner.count(""), 0u);
  EXPECT_EQ(scanner.count(""), std::uint64_t{1} << 53);
  EXPECT_EQ(scanner.count_up_to("", 12), 12u);
  const auto [code, message] = thrown([&] { scanner.count_up_to("the number of cells", 12); });
  EXPECT_EQ(code, ErrorCode::kMeshTooLarge);
  EXPECT_THAT(message, HasSubstr("the number of cells is 13, at most 12"));
  for (const char* text : {"-1", "+1", "1.0", "9007199254740993", "99999999999999999999", "x"}) {
    TextScanner refused(text);
    EXPECT_EQ(thrown([&] { refused.count("a count"); }).first, ErrorCode::kFileSyntax) << text;
  }
}

TEST(TextScanner, TakesLinesAndParagraphs) {
  TextScanner scanner("head # of it  \nnext\nof this\n  \nlast one\n\n\nend", TextScanner::Comments::kFromHash);
  EXPECT_EQ(scanner.rest_of_line(), "head # of it");
  scanner.skip_paragraph();
  EXPECT_EQ(scanner.next(""), "last");
  EXPECT_THAT(thrown([&] { scanner.end_line(); }).second,
              HasSubstr("line 5: expected the end of the line, found ' one'"));
  EXPECT_EQ(scanner.next(""), "end");
  EXPECT_EQ(scanner.line(), 8u);
  scanner.end_line();
  EXPECT_TRUE(scanner.at_end());
}

TEST(TextScanner, TakesBytesAsTheyAre) {
  const std::string text("head\n\0 \n#tail", 13);
  TextScanner scanner(text);
  scanner.name_byte_offsets();
  EXPECT_EQ(scanner.next(""), "head");
  scanner.end_line();
  EXPECT_EQ(scanner.bytes(4, "values"), std::string("\0 \n#", 4));
  EXPECT_THAT(thrown([&] { scanner.bytes(5, "values"); }).second, HasSubstr("byte 9: expected values"));
  EXPECT_THAT(thrown([&] { scanner.bytes(std::numeric_limits<std::uint64_t>::max(), "values"); }).second,
              HasSubstr("byte 9: expected values, found the end of the file"));
  EXPECT_EQ(scanner.bytes(4, "values"), "tail");
  EXPECT_TRUE(scanner.at_end());
}

TEST(TextScanner, PassesOverTokensThatAreThere) {
  TextScanner scanner("1 2 3");
  scanner.skip(2, "a number");
  EXPECT_EQ(scanner.mark(), 1u);
  EXPECT_THAT(thrown([&] { scanner.skip(1u << 30, "a number"); }).second, HasSubstr("expected a number"));
}

TEST(TextScanner, MessagesShowTokensShortAndPrintable) {
  EXPECT_EQ(printable("a\x01\xc3z"), "a??z");
  EXPECT_EQ(printable(std::string(40, 'x')), std::string(40, 'x'));
  EXPECT_EQ(printable(std::string(41, 'x')), std::string(40, 'x') + "...");
  EXPECT_EQ(in_quotes("Faces"), "'Faces'");
  EXPECT_TRUE(equals_ignoring_case("FaCes", "fAcEs"));
  EXPECT_FALSE(equals_ignoring_case("Faces", "Face"));
  EXPECT_FALSE(equals_ignoring_case("[", "{"));
}

}  // namespace
}  // namespace ccslice
