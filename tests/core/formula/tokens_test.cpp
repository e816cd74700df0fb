// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/formula/tokens.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/formula/formula_error.h"

namespace ccslice {
namespace {

using testing::ElementsAre;

std::vector<std::string> texts(const std::string& formula) {
  std::vector<std::string> all;
  for (const Token& token : tokens_of(formula)) all.push_back(token.text);
  return all;
}

std::string refusal(const std::string& text) {
  try {
    tokens_of(text);
  } catch (const FormulaError& error) {
    return error.what();
  }
  return "none";
}

TEST(Tokens, AreParted) {
  EXPECT_THAT(texts("a1<=2.5e-3*_b"), ElementsAre("a1", "<=", "2.5e-3", "*", "_b", ""));
  EXPECT_THAT(texts("1==2!=!3&&4||5"), ElementsAre("1", "==", "2", "!=", "!", "3", "&&", "4", "||", "5", ""));
  EXPECT_THAT(texts("\"a b\"\"c\"^\"\""), ElementsAre("a b\"c", "^", "", ""));
  EXPECT_THAT(texts(""), ElementsAre(""));
}

TEST(Tokens, HaveColumnsAndNumbers) {
  const std::vector<Token> tokens = tokens_of("  \"\xC3\xA4\" + .5");
  ASSERT_EQ(tokens.size(), 4);
  EXPECT_EQ(tokens[0].kind, Token::Kind::kQuoted);
  EXPECT_EQ(tokens[0].column, 3);
  EXPECT_EQ(tokens[1].column, 7);
  EXPECT_EQ(tokens[2].number, 0.5);
  EXPECT_EQ(tokens[3].column, 11);
}

TEST(Tokens, AreRefusedWithWhatToWrite) {
  EXPECT_EQ(refusal("x ** 2"), "column 3: \"**\" is no operator; powers are written with \"^\"");
  EXPECT_EQ(refusal("x = 2"), "column 3: \"=\" compares nothing; equality is written \"==\"");
  EXPECT_EQ(refusal("x % 2"), "column 3: \"%\" is no operator; remainders are written mod(a, b)");
  EXPECT_EQ(refusal("x & 2"), "column 3: \"&\" is no operator; write \"and\"");
  EXPECT_EQ(refusal("[x]"), "column 1: \"[\" is no part of formulas; write \"(\"");
  EXPECT_EQ(refusal("x ? 1 : 2"), "column 3: \"?\" is no operator; choices are written if(condition, a, b)");
  EXPECT_EQ(refusal("1.2.3"), "column 4: the number \"1.2\" has a second decimal point; remove one");
  EXPECT_EQ(refusal("1e999"),
            "column 1: the number \"1e999\" is too large or too small: write one of 1e-307 to 1e308, or 0");
  EXPECT_EQ(refusal("1 + \"abc"), "column 5: the name's closing double quote is missing");
  EXPECT_EQ(refusal("a$b"),
            "column 2: \"$\" is no part of formulas; names with other characters than letters, digits "
            "and _ are written in double quotes");
  EXPECT_EQ(refusal("\xFF").substr(0, 14), "column 1: \"?\" ");
}

}  // namespace
}  // namespace ccslice
