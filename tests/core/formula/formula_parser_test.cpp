// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/formula/formula_parser.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "core/formula/formula.h"
#include "core/formula/formula_error.h"

namespace ccslice {
namespace {

using testing::HasSubstr;

std::string complaint(const std::string& text) {
  const std::vector<std::string> channels = {"Core", "Shell thickness", "x", "sin"};
  try {
    parse_formula(text, channels);
  } catch (const FormulaError& error) {
    const std::string start = "column " + std::to_string(error.column()) + ": ";
    EXPECT_EQ(std::string(error.what()).substr(0, start.size()), start);
    return error.what();
  }
  return "none";
}

std::string text_times(const std::string& text, std::size_t times) {
  std::string all;
  for (std::size_t i = 0; i < times; ++i) all += text;
  return all;
}

TEST(FormulaParser, NamesTheNearestName) {
  EXPECT_EQ(complaint("1 + 2*gyriod(x, y, z)"), "column 7: no function is called \"gyriod\"; did you mean \"gyroid\"?");
  EXPECT_EQ(complaint("Cor + 1"), "column 1: no channel or coordinate is called \"Cor\"; did you mean \"Core\"?");
  EXPECT_EQ(complaint("2 * core"), "column 5: no channel or coordinate is called \"core\"; did you mean \"Core\"?");
  EXPECT_EQ(complaint("thta"), "column 1: no channel or coordinate is called \"thta\"; did you mean \"theta\"?");
  EXPECT_EQ(complaint("\"Shel thickness\""),
            "column 1: no channel is called \"Shel thickness\"; did you mean \"Shell thickness\"?");
  EXPECT_EQ(complaint("\"y\""),
            "column 1: no channel is called \"y\"; the channels are \"Core\", \"Shell thickness\", \"x\", \"sin\"");
  EXPECT_THAT(complaint("frobnicate(1)"), HasSubstr("column 1: no function is called \"frobnicate\"; write one of min, "
                                                    "max, clamp, abs"));
  EXPECT_THROW(parse_formula("u", {}), FormulaError);
}

TEST(FormulaParser, ReadsDistancesBehindTheChannels) {
  const std::vector<std::string> channels = {"Core"};
  const ParsedFormula parsed =
      parse_formula("distance(2) + Core * interface_distance(0.5) - distance(2) + distance(3)", channels);
  EXPECT_THAT(parsed.inputs, testing::ElementsAre("Core"));
  EXPECT_THAT(parsed.distances,
              testing::ElementsAre(FormulaDistance{false, 2}, FormulaDistance{true, 0.5}, FormulaDistance{false, 3}));
  std::vector<std::uint16_t> read;
  for (const Instruction& instruction : parsed.program.instructions) {
    if (instruction.op == Op::kInput) read.push_back(instruction.operands[0].index);
  }
  EXPECT_THAT(read, testing::UnorderedElementsAre(0, 1, 2, 3));
}

TEST(FormulaParser, SaysHowDistancesAreWritten) {
  for (const char* text : {"distance", "distance()", "distance(x)", "distance(0)", "distance(-1)", "distance(1, 2)",
                           "distance(1 + 1)", "distance(1e-60)", "distance(1e20)"}) {
    EXPECT_EQ(complaint(text),
              "column 1: \"distance\" takes how far the distance is wanted, a number of mm from 0.001 to 1e6, as in "
              "\"distance(2)\"")
        << text;
  }
  EXPECT_THAT(complaint("1 + interface_distance(z)"), HasSubstr("as in \"interface_distance(2)\""));
  EXPECT_THAT(complaint("distanc(2)"), HasSubstr("did you mean \"distance\"?"));
}

TEST(FormulaParser, CountsCharactersAndNotBytes) {
  EXPECT_EQ(complaint("\"\xC3\xA4\xE2\x82\xAC\" + 1").substr(0, 9), "column 1:");
  EXPECT_EQ(complaint("1 + \xE2\x82\xAC"),
            "column 5: \"\xE2\x82\xAC\" is no part of formulas; names with other characters than letters, digits and _ "
            "are written in double quotes");
}

TEST(FormulaParser, SaysWhatIsMissing) {
  EXPECT_EQ(complaint("(x + 1"), "column 7: \")\" is missing before the end of the formula, for the \"(\" of column 1");
  EXPECT_EQ(complaint("min(1, 2"),
            "column 9: \")\" or \",\" is missing before the end of the formula, for the \"(\" of column 4");
  EXPECT_EQ(complaint("(1,5)"),
            "column 3: \")\" is missing before \",\", for the \"(\" of column 1; decimal numbers are written with "
            "\".\"");
  EXPECT_EQ(complaint("x)"), "column 2: \")\" has no \"(\" before it; remove it");
  EXPECT_EQ(complaint("1,5"),
            "column 2: \",\" parts the values of functions only; decimal numbers are written with \".\"");
  EXPECT_EQ(complaint(" "), "column 2: the formula is empty; write a number, a coordinate or the name of a channel");
  EXPECT_EQ(complaint("x +"), "column 4: a value is missing before the end of the formula: a number, a name or \"(\"");
  EXPECT_EQ(complaint("x * / 2"), "column 5: a value is missing before \"/\": a number, a name or \"(\"");
  EXPECT_EQ(complaint("and 2"), "column 1: a value is missing before \"and\": a number, a name or \"(\"");
  EXPECT_EQ(complaint("x y"), "column 3: an operator such as \"*\" is missing before \"y\"");
  EXPECT_EQ(complaint("3(4)"), "column 2: an operator such as \"*\" is missing before \"(\"");
  EXPECT_EQ(complaint("2x"), "column 2: \"*\" is missing behind the number \"2\"");
  EXPECT_EQ(complaint("Core(2)"), "column 5: \"*\" is missing behind \"Core\", which is no function");
  EXPECT_EQ(complaint("y(2)"), "column 2: \"*\" is missing behind \"y\", which is no function");
}

TEST(FormulaParser, CountsTheValuesOfFunctions) {
  EXPECT_EQ(complaint("1 - smoothstep(0, 1)"), "column 5: \"smoothstep\" takes 3 values, 2 are given");
  EXPECT_EQ(complaint("abs()"), "column 1: \"abs\" takes 1 value, 0 are given");
  EXPECT_EQ(complaint("min(1)"), "column 1: \"min\" takes 2 or more values, 1 is given");
  EXPECT_EQ(complaint("sqrt(1, 2)"), "column 1: \"sqrt\" takes 1 value, 2 are given");
  EXPECT_EQ(complaint("cos + 1"), "column 1: \"cos\" is a function; write its values behind it, in parentheses");
  EXPECT_EQ(complaint("sin + 1"),
            "column 1: \"sin\" is a function; write its values behind it, in parentheses, or the "
            "channel's name in double quotes");
}

TEST(FormulaParser, RefusesComparisonsThatFollowEachOther) {
  EXPECT_EQ(complaint("0 < x < 1"),
            "column 7: comparisons don't follow each other; write \"a < b and b < c\" instead "
            "of \"a < b < c\"");
}

TEST(FormulaParser, RefusesMoreThanItsLimits) {
  EXPECT_THAT(complaint(text_times("(", 65) + "x" + text_times(")", 65)),
              HasSubstr("column 65: the formula is nested"));
  EXPECT_THAT(complaint(text_times("-", 65) + "x"), HasSubstr("more than 64 deep"));
  EXPECT_THAT(complaint("x" + text_times("^x", 65)), HasSubstr("more than 64 deep"));
  EXPECT_THAT(complaint(text_times("not ", 65) + "x"), HasSubstr("more than 64 deep"));
  EXPECT_THAT(complaint(text_times("abs(", 65) + "x" + text_times(")", 65)), HasSubstr("more than 64 deep"));
  EXPECT_THAT(complaint("0" + text_times("+1", 513)),
              HasSubstr("column 1026: the formula has more than 512 operations"));
  EXPECT_THAT(complaint("min(0" + text_times(",1", 513) + ")"), HasSubstr("column 1: \"min\" takes 2 or more values"));
  EXPECT_EQ(complaint(text_times(" ", kMaxFormulaBytes) + "1"),
            "column 1: the formula has 4097 bytes, more than 4096; make other fields of parts of it");
  EXPECT_THAT(complaint(text_times("(", 1 << 20)), HasSubstr("1048576 bytes"));
}

}  // namespace
}  // namespace ccslice
