// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/network/access.h"

#include <gtest/gtest.h>

#include <fstream>

#include "server/service/base/service_error.h"
#include "tests/support/temporary_folder.h"

namespace ccslice::server {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

// echo -n test | sha256sum
constexpr const char* kTestDigest = "sha256:9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08";

std::string wrong_line(const std::string& text) {
  try {
    (void)parse_access_rules(text);
  } catch (const std::invalid_argument& why) {
    return why.what();
  }
  return "";
}

std::string reason_of(const std::function<void()>& body) {
  try {
    body();
  } catch (const ServiceError& error) {
    return std::string(reason(error.code()));
  }
  return "";
}

TEST(ParseAccessRules, TakesTokensCertificatesAndAnonymous) {
  const AccessRules rules =
      parse_access_rules(std::string("# who may do what\n\nfarm write ") + kTestDigest +
                         " calls=8 expires=2027-01-31  # rotates\n" + "cad.box-1 read certificate\nanonymous read\n");
  ASSERT_EQ(rules.rules.size(), 2u);
  EXPECT_EQ(rules.rules[0].name, "farm");
  EXPECT_EQ(rules.rules[0].role, Role::kWrite);
  EXPECT_EQ(rules.rules[0].max_calls, 8u);
  EXPECT_EQ(rules.rules[0].expires, std::chrono::sys_days(std::chrono::year(2027) / 2 / 1));
  EXPECT_TRUE(rules.rules[0].token.has_value());
  EXPECT_FALSE(rules.rules[1].token.has_value());
  EXPECT_EQ(rules.anonymous, Role::kRead);
  EXPECT_EQ(parse_access_rules("anonymous admin\n").anonymous, Role::kAdmin);
}

TEST(ParseAccessRules, NamesTheWrongLine) {
  const std::string good = std::string("farm write ") + kTestDigest;
  for (const auto& [text, says] : std::map<std::string, std::string>{
           {"farm\n", "line 1: a line has"},
           {"\nfarm owner " + std::string(kTestDigest) + "\n", "line 2: a role is"},
           {"farm none " + std::string(kTestDigest) + "\n", "line 1: a role is"},
           {"farm read\n", "64 hexadecimal digits"},
           {"farm read sha256:12\n", "64 hexadecimal digits"},
           {"farm read " + std::string(kTestDigest).substr(0, 70) + "x\n", "64 hexadecimal digits"},
           {"farm read geheim\n", "64 hexadecimal digits"},
           {good + " calls=0\n", "calls=8"},
           {good + " calls=x\n", "calls=8"},
           {good + " expires=2027-02-30\n", "expires=2027-01-31"},
           {good + " expires=morgen\n", "expires=2027-01-31"},
           {good + " for=ever\n", "calls=N"},
           {"fa:rm read certificate\n", "a name has"},
           {good + "\nother read " + std::string(kTestDigest) + "\n", "line 2: the token"},
           {"a read certificate\na write certificate\n", "line 2"},
           {"anonymous read certificate\n", "nothing more"},
           {"", "no line says"},
           {"# nobody yet\n", "no line says"},
           {good, "doesn't end"}}) {
    EXPECT_NE(wrong_line(text).find(says), std::string::npos) << text << ": " << wrong_line(text);
    EXPECT_EQ(wrong_line(text).find("geheim"), std::string::npos);
  }
}

TEST(AccessLine, IsWhatTheFileTakes) {
  EXPECT_EQ(access_line("farm", "write", "test"), std::string("farm write ") + kTestDigest);
  EXPECT_THROW((void)access_line("farm", "owner", "test"), std::invalid_argument);
  EXPECT_THROW((void)access_line("anonymous", "read", "test"), std::invalid_argument);
  for (const std::string& token :
       {std::string(), std::string("a b"), std::string("\xc3\xa4"), std::string(4097, 'x')}) {
    EXPECT_THROW((void)access_line("farm", "read", token), std::invalid_argument) << token;
  }
}

class AccessTest : public ::testing::Test {
 protected:
  AccessTest() {
    write(std::string("farm write ") + kTestDigest + " calls=2\n" + access_line("old", "admin", "expired") +
          " expires=2020-01-01\n" + access_line("reader", "read", "look") +
          " expires=9999-12-31\nbox read certificate\n");
  }

  void write(const std::string& text) const { std::ofstream(file_) << text; }
  static Credentials bearer(const std::string& token, const std::string& certificate = "") {
    return {.authorization = "Bearer " + token, .certificate = certificate, .address = "ipv4:192.0.2.1"};
  }

  const TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path(), file_ = folder_ / "tokens";
};

TEST_F(AccessTest, WithoutAFileEverybodyMayDoEverything) {
  const Access access;
  const Identity identity =
      access.identify({.authorization = "nonsense", .certificate = {}, .address = "ipv4:192.0.2.1"});
  EXPECT_EQ(identity.client, "ipv4:192.0.2.1");
  EXPECT_EQ(identity.role, Role::kAdmin);
  EXPECT_FALSE(identity.is_named);
}

TEST_F(AccessTest, KnowsTokensAndCertificates) {
  const Access access(file_);
  const Identity farm = access.identify(bearer("test"));
  EXPECT_EQ(farm.client, "farm");
  EXPECT_EQ(farm.role, Role::kWrite);
  EXPECT_EQ(farm.max_calls, 2u);
  EXPECT_TRUE(farm.is_named);
  EXPECT_EQ(access.identify({.authorization = "bEARER test", .certificate = {}, .address = {}}).client, "farm");
  EXPECT_EQ(access.identify(bearer("test", "box")).client, "farm");  // The token goes before the certificate.
  const Identity box = access.identify({.authorization = {}, .certificate = "box", .address = "ipv4:192.0.2.1"});
  EXPECT_EQ(box.client, "box");
  EXPECT_EQ(box.role, Role::kRead);
  const Identity other = access.identify({.authorization = {}, .certificate = "x", .address = "ipv4:192.0.2.1"});
  EXPECT_EQ(other.client, "certificate x");
  EXPECT_EQ(other.role, Role::kNone);
}

TEST_F(AccessTest, RefusesTheRestWithoutShowingTokens) {
  const Access access(file_);
  for (const std::string& token : {std::string("wrong"), std::string("expired"), std::string(), std::string("a b"),
                                   std::string("\x01"), std::string(5000, 'x')}) {
    try {
      (void)access.identify(bearer(token));
      ADD_FAILURE() << token;
    } catch (const ServiceError& error) {
      EXPECT_EQ(error.code(), ServiceErrorCode::kTokenUnknown);
      if (token == "wrong") {
        EXPECT_EQ(std::string(error.what()).find(token), std::string::npos);
      }
    }
  }
  EXPECT_EQ(
      reason_of([&] { (void)access.identify({.authorization = "Basic dGVzdA==", .certificate = {}, .address = {}}); }),
      "TOKEN_UNKNOWN");
}

TEST_F(AccessTest, RolesAllowWhatThoseBelowMay) {
  const Access access(file_);
  const Identity farm = access.identify(bearer("test")), reader = access.identify(bearer("look"));
  access.require(farm, Role::kRead);
  access.require(farm, Role::kWrite);
  EXPECT_EQ(reason_of([&] { access.require(farm, Role::kAdmin); }), "ROLE_MISSING");
  EXPECT_EQ(reason_of([&] { access.require(reader, Role::kWrite); }), "ROLE_MISSING");
  EXPECT_EQ(reason_of([&] {
              access.require(access.identify({.authorization = {}, .certificate = {}, .address = "a"}), Role::kRead);
            }),
            "TOKEN_MISSING");
}

TEST_F(AccessTest, TakesNewRulesAndKeepsOldOnesWhereTheyAreWrong) {
  Access access(file_);
  EXPECT_FALSE(access.reload(false));
  write(access_line("new", "read", "fresh") + "\n");
  EXPECT_FALSE(access.reload(false));  // It may still be being written.
  EXPECT_TRUE(access.reload(false));
  EXPECT_EQ(access.identify(bearer("fresh")).client, "new");
  EXPECT_EQ(reason_of([&] { (void)access.identify(bearer("test")); }), "TOKEN_UNKNOWN");
  write("new read sha2");
  EXPECT_FALSE(access.reload(false) || access.reload(false));
  write("");
  EXPECT_FALSE(access.reload(false) || access.reload(false) || access.reload(true));
  EXPECT_EQ(access.identify(bearer("fresh")).client, "new");
  fs::remove(file_);
  EXPECT_FALSE(access.reload(true));
  EXPECT_EQ(access.identify(bearer("fresh")).client, "new");
  EXPECT_THROW(Access(folder_ / "none"), std::runtime_error);
}

TEST_F(AccessTest, CountsTheCallsOfNames) {
  const Access access(file_);
  ClientCalls calls(1);
  const Identity farm = access.identify(bearer("test")), reader = access.identify(bearer("look"));
  const ClientCalls::Share first = calls.open(farm);
  {
    const ClientCalls::Share second = calls.open(farm);
    EXPECT_EQ(reason_of([&] { (void)calls.open(farm); }), "CLIENT_LIMIT");
    const ClientCalls::Share other = calls.open(reader);
    EXPECT_EQ(reason_of([&] { (void)calls.open(reader); }), "CLIENT_LIMIT");
  }
  const ClientCalls::Share again = calls.open(farm);
  const Identity address{.client = "ipv4:192.0.2.1", .role = Role::kRead, .is_named = false, .max_calls = 0};
  std::vector<ClientCalls::Share> many;
  for (int i = 0; i < 10; ++i) many.push_back(calls.open(address));  // A proxy is one address.
}

}  // namespace
}  // namespace ccslice::server
