// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/view/view_guard.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <string>

namespace ccslice::cli {
namespace {

using testing::HasSubstr;

const ViewGuard kGuard(4711, "0123456789abcdef");

int status_for(const ViewRequest& request) {
  const auto refusal = kGuard.refuse_stranger(request);
  return refusal ? refusal->status : 200;
}

int token_status_for(const ViewRequest& request) {
  const auto refusal = kGuard.refuse_without_token(request);
  return refusal ? refusal->status : 200;
}

TEST(ViewGuard, TakesTheHostsThatItServes) {
  EXPECT_EQ(status_for({.host = "127.0.0.1:4711"}), 200);
  EXPECT_EQ(status_for({.host = "localhost:4711", .origin = "http://localhost:4711"}), 200);
  for (const char* host : {"", "127.0.0.1", "127.0.0.1:4712", "evil.example:4711", "127.0.0.1:4711.evil.example"}) {
    EXPECT_EQ(status_for({.host = host}), 421) << host;
  }
}

TEST(ViewGuard, RefusesPagesOfOtherSites) {
  for (const char* origin :
       {"null", "http://evil.example", "https://127.0.0.1:4711", "http://127.0.0.1:4711.evil", "http://127.0.0.1:80"}) {
    EXPECT_EQ(status_for({.host = "127.0.0.1:4711", .origin = origin}), 403) << origin;
  }
}

TEST(ViewGuard, WantsTheTokenInACookieOrAHeader) {
  EXPECT_EQ(token_status_for({.cookie = "ccslice_view_4711=0123456789abcdef"}), 200);
  EXPECT_EQ(token_status_for({.cookie = "a=b; ccslice_view_4711=0123456789abcdef; c=d"}), 200);
  EXPECT_EQ(token_status_for({.authorization = "Bearer 0123456789abcdef"}), 200);
  for (const char* cookie :
       {"", "ccslice_view_4711=", "ccslice_view_4711=0123456789abcdeF", "xccslice_view_4711=0123456789abcdef",
        "ccslice_view_4711=0123456789abcdef0", "ccslice_view_4711", "ccslice_view_4712=0123456789abcdef", ";;;="}) {
    EXPECT_EQ(token_status_for({.cookie = cookie}), 401) << cookie;
  }
  for (const char* header : {"Bearer", "Bearer ", "0123456789abcdef", "Basic 0123456789abcdef"}) {
    EXPECT_EQ(token_status_for({.authorization = header}), 401) << header;
  }
  EXPECT_THAT(kGuard.refuse_without_token({})->message, HasSubstr("the address that ccslice view printed"));
}

TEST(ViewGuard, CookiesStayOnTheirSite) {
  EXPECT_EQ(kGuard.cookie(), "ccslice_view_4711=0123456789abcdef; Path=/; HttpOnly; SameSite=Strict");
}

TEST(ViewGuard, TokensDiffer) {
  std::set<std::string> tokens;
  for (int i = 0; i < 100; ++i) tokens.insert(random_token());
  EXPECT_EQ(tokens.size(), 100u);
  EXPECT_EQ(tokens.begin()->size(), 32u);
}

}  // namespace
}  // namespace ccslice::cli
