// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/base/error.h"

#include <gtest/gtest.h>

#include <set>
#include <string_view>

namespace ccslice {
namespace {

TEST(Error, CarriesCodeFieldAndIds) {
  const Error error(ErrorCode::kMeshRepeatedVertex, "cell 7 names vertex 3 twice", "cell_vertices[3]", {7});
  EXPECT_EQ(error.code(), ErrorCode::kMeshRepeatedVertex);
  EXPECT_EQ(error.field(), "cell_vertices[3]");
  EXPECT_EQ(error.ids(), std::vector<std::int64_t>{7});
  EXPECT_STREQ(error.what(), "cell 7 names vertex 3 twice");
}

TEST(Error, EveryCodeHasItsOwnReason) {
  std::set<std::string_view> reasons;
  int codes = 0;
  for (int number = 100; number < 500; ++number) {
    const std::string_view name = reason(static_cast<ErrorCode>(number));
    if (name == "INTERNAL" && number != static_cast<int>(ErrorCode::kInternal)) continue;
    ++codes;
    reasons.insert(name);
  }
  EXPECT_EQ(codes, 84);
  EXPECT_EQ(reasons.size(), static_cast<std::size_t>(codes));
}

}  // namespace
}  // namespace ccslice
