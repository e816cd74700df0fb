// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/network/certificates.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "tests/server/service/test_certificates.h"

namespace ccslice::server {
namespace {

std::string text_of(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

class CertificatesTest : public ::testing::Test {
 protected:
  CertificatesTest() {
    made_.make("one", "localhost");
    made_.make("two", "localhost");
    made_.put("one.pem", "served.pem");
    made_.put("one.key", "served.key");
  }
  CertificateFiles files(const std::string& authority = "") const {
    return {.certificate = made_.path("served.pem"), .key = made_.path("served.key"), .client_authority = authority};
  }
  std::string wrong(const CertificateTexts& texts) const {
    try {
      require_certificates(texts, std::chrono::system_clock::now());
    } catch (const std::invalid_argument& why) {
      return why.what();
    }
    return "";
  }

  TestCertificates made_;
};

TEST_F(CertificatesTest, AreChecked) {
  const std::string one = made_.text("one.pem"), key = made_.text("one.key"), ca = made_.text("ca.pem");
  EXPECT_EQ(wrong({one, key, ""}), "");
  EXPECT_EQ(wrong({one, key, ca}), "");
  EXPECT_NE(wrong({one, made_.text("two.key"), ""}).find("isn't the key of --tls-cert"), std::string::npos);
  EXPECT_NE(wrong({"", key, ""}).find("--tls-cert holds no certificate"), std::string::npos);
  EXPECT_NE(wrong({one.substr(0, one.size() / 2), key, ""}).find("--tls-cert"), std::string::npos);
  EXPECT_EQ(wrong({one + ca, key, ca + one}), "");
  EXPECT_NE(wrong({one + ca.substr(0, ca.size() / 2), key, ""}).find("isn't whole"), std::string::npos);
  EXPECT_NE(wrong({one, key, ca + one.substr(0, 200)}).find("--tls-client-ca"), std::string::npos);
  EXPECT_NE(wrong({one, key.substr(0, key.size() / 2), ""}).find("--tls-key holds no private key"), std::string::npos);
  EXPECT_NE(wrong({one, key, "x"}).find("--tls-client-ca"), std::string::npos);
  const auto later = std::chrono::system_clock::now() + std::chrono::hours(24 * 365);
  EXPECT_THROW(require_certificates({one, key, ""}, later), std::invalid_argument);
}

TEST_F(CertificatesTest, TellWhenTheFirstOfThemEnds) {
  made_.make("long", "localhost", 30);
  made_.put("long.pem", "served.pem");
  made_.put("long.key", "served.key");
  const auto days_left = [](std::int64_t end_s) {
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    return static_cast<double>(end_s - std::chrono::duration_cast<std::chrono::seconds>(now).count()) / 86'400;
  };
  ServedCertificates served(files());
  EXPECT_NEAR(days_left(served.ends().certificate_s), 30, 0.1);
  EXPECT_EQ(served.ends().client_authority_s, 0);
  std::ofstream(made_.path("served.pem"), std::ios::app) << made_.text("one.pem");  // Which lasts for two days.
  EXPECT_TRUE(served.reload(false));
  EXPECT_NEAR(days_left(served.ends().certificate_s), 2, 0.1);
  const ServedCertificates with_authority(files(made_.path("one.pem")));
  EXPECT_NEAR(days_left(with_authority.ends().client_authority_s), 2, 0.1);
}

TEST_F(CertificatesTest, RenewedPairsAreServedAndOthersAreNot) {
  ServedCertificates served(files());
  EXPECT_EQ(text_of(served.served().certificate), made_.text("one.pem"));
  EXPECT_EQ(text_of(served.served().key), made_.text("one.key"));
  EXPECT_EQ(served.served().client_authority, "");
  EXPECT_FALSE(served.reload(false));
  made_.put("two.pem", "served.pem");
  EXPECT_FALSE(served.reload(false));  // The key hasn't come yet.
  EXPECT_EQ(text_of(served.served().certificate), made_.text("one.pem"));
  made_.put("two.key", "served.key");
  EXPECT_TRUE(served.reload(false));
  EXPECT_EQ(text_of(served.served().certificate), made_.text("two.pem"));
  EXPECT_EQ(text_of(served.served().key), made_.text("two.key"));
  EXPECT_TRUE(served.reload(true));
}

TEST_F(CertificatesTest, MissingFilesAreToldAtTheStart) {
  EXPECT_THROW(ServedCertificates({made_.path("none"), made_.path("served.key"), ""}), std::runtime_error);
  EXPECT_THROW(ServedCertificates(files(made_.path("none"))), std::runtime_error);
}

}  // namespace
}  // namespace ccslice::server
