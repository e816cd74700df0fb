// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/base/choice_text.h"

#include <gtest/gtest.h>

#include <vector>

namespace ccslice {
namespace {

struct Row {
  const char* name;
};

TEST(ChoiceText, JoinsNamesAsASentenceDoes) {
  EXPECT_EQ(choice_text(std::vector<Row>{}), "");
  EXPECT_EQ(choice_text(std::vector<Row>{{"RAW"}}), "RAW");
  EXPECT_EQ(choice_text(std::vector<Row>{{"RAW"}, {"PNG"}}), "RAW or PNG");
  EXPECT_EQ(choice_text(std::vector<Row>{{"RAW"}, {"PNG"}, {"EXR"}}), "RAW, PNG or EXR");
}

}  // namespace
}  // namespace ccslice
