// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/formula/words.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace ccslice {
namespace {

TEST(Words, AreEachOfOneKind) {
  std::set<std::string> names = {"and", "or", "not"};
  for (const std::string& name : names) EXPECT_TRUE(is_operator_word(name));
  for (const std::string& name : formula_variables()) EXPECT_TRUE(names.insert(name).second) << name;
  for (const FormulaFunction& function : formula_functions()) {
    EXPECT_TRUE(names.insert(function.name).second) << function.name;
    EXPECT_EQ(find_function(function.name), &function);
    EXPECT_LE(function.least, function.most);
  }
  EXPECT_EQ(find_function("x"), nullptr);
  EXPECT_FALSE(is_operator_word("x"));
}

}  // namespace
}  // namespace ccslice
