// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/base/json_scanner.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/base/error.h"

namespace ccslice::cli {
namespace {

TEST(JsonScanner, TakesValuesOneByOne) {
  JsonScanner scanner(R"( {"a \" ] \u00e9": [1.50, -2e-3, "7"], "b": [ ], "c": null, "d":true} )");
  scanner.require('{', "'{'");
  EXPECT_EQ(scanner.string("a name"), "a \" ] \xc3\xa9");
  scanner.require(':', "':'");
  std::vector<double> items;
  for_each_item(scanner, [&] { items.push_back(scanner.real("a number")); });
  EXPECT_EQ(items, (std::vector<double>{1.5, -2e-3, 7}));
  scanner.require(',', "','");
  EXPECT_EQ(scanner.string("a name"), "b");
  scanner.require(':', "':'");
  for_each_item(scanner, [&] { ADD_FAILURE() << "an item of an empty array"; });
  scanner.require(',', "','");
  EXPECT_TRUE(scanner.at_string());
  EXPECT_EQ(scanner.string("a name"), "c");
  scanner.require(':', "':'");
  EXPECT_TRUE(scanner.take_null());
  EXPECT_FALSE(scanner.take(':'));
  scanner.require(',', "','");
  EXPECT_EQ(scanner.string("a name"), "d");
  scanner.require(':', "':'");
  EXPECT_TRUE(scanner.boolean("true or false"));
  scanner.require('}', "'}'");
  scanner.require_end();
}

TEST(JsonScanner, NamesAPlaceWhereAValueEndsTooSoon) {
  for (const char* text : {"", " ", ",", "]", "[1", "[1, \n", "[\"7", "[01]", "[1.]"}) {
    JsonScanner scanner(text);
    try {
      for_each_item(scanner, [&] { (void)scanner.real("a number"); });
      ADD_FAILURE() << text;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kFileSyntax);
      EXPECT_EQ(std::string(error.what()).substr(0, 5), "line ") << error.what();
    }
  }
}

}  // namespace
}  // namespace ccslice::cli
