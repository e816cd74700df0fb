// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/base/json_scanner.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/base/error.h"

namespace ccslice::cli {
namespace {

TEST(JsonScanner, TakesValuesAsTheyAreWritten) {
  for (const std::string value : {"1.50", "-2e-3", "true", "null", "\"a \\\" ] b\"", "[]", "{}",
                                  R"([1, [2, {"a": "]}"}], 3])", R"({"b":[{"c":"\\"}, 0.10], "d": null})"}) {
    const std::string text = " [ " + value + " , 7]";
    JsonScanner scanner(text);
    std::vector<std::string> items;
    for_each_item(scanner, [&] { items.emplace_back(scanner.as_written("a value")); });
    EXPECT_EQ(items, (std::vector<std::string>{value, "7"})) << text;
  }
}

TEST(JsonScanner, NamesAPlaceWhereAValueEndsTooSoon) {
  for (const char* text : {"", " ", ",", "]", "[1", "{\"a\": ", "[\"a", "[1, \n"}) {
    JsonScanner scanner(text);
    try {
      static_cast<void>(scanner.as_written("a value"));
      ADD_FAILURE() << text;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kFileSyntax);
      EXPECT_EQ(std::string(error.what()).substr(0, 5), "line ") << error.what();
    }
  }
}

}  // namespace
}  // namespace ccslice::cli
