// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/credentials.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "client/client.h"
#include "tests/client/certificates.h"
#include "tests/client/fake_slicer.h"
#include "tests/client/process.h"
#include "tests/client/sample_calls.h"

namespace ccslice::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

constexpr RetryPolicy kOnce{.max_attempts = 1};

class TokenFileTest : public testing::Test {
 protected:
  void write(const std::string& content) const { std::ofstream(path_, std::ios::binary) << content; }
  std::string refusal_of(const std::string& content) const {
    write(content);
    const ClientError error = error_of([&] { TokenFile file(path_); });
    EXPECT_EQ(error.reason(), local_reason::kCredentialsInvalid);
    EXPECT_THAT(error.what(), HasSubstr(path_));
    return error.what();
  }

  TemporaryFolder folder_;
  const std::string path_ = (folder_.path() / "token").string();
};

TEST_F(TokenFileTest, HasTheTokenOnItsFirstLine) {
  for (const char* content : {"s3cret", "s3cret\n", "s3cret\r\n", "s3cret\nof the press\n"}) {
    write(content);
    EXPECT_EQ(TokenFile(path_).token(), "s3cret");
  }
  write(std::string(4096, 'x') + "\n");
  EXPECT_EQ(TokenFile(path_).token().size(), 4096u);
}

TEST_F(TokenFileTest, IsRefusedByNameAndWithoutWhatIsInIt) {
  EXPECT_THAT(refusal_of(""), HasSubstr("first line is empty"));
  EXPECT_THAT(refusal_of("\ns3cret\n"), HasSubstr("first line is empty"));
  EXPECT_THAT(refusal_of(std::string(4097, 's')), AllOf(HasSubstr("longer than 4096 bytes"), Not(HasSubstr("ssss"))));
  EXPECT_THAT(refusal_of("s3cret with spaces"), AllOf(HasSubstr("printable ASCII"), Not(HasSubstr("s3cret"))));
  EXPECT_THAT(refusal_of("s3cr\xc3\xa9t"), AllOf(HasSubstr("printable ASCII"), Not(HasSubstr("s3cr"))));
  EXPECT_THAT(refusal_of(std::string("\x7f"
                                     "ELF\0\0\1",
                                     7)),
              HasSubstr("printable ASCII"));
  const ClientError missing = error_of([] { TokenFile file("/nowhere/token"); });
  EXPECT_THAT(missing.what(), HasSubstr("/nowhere/token can't be read: No such file"));
  EXPECT_THAT(error_of([&] { TokenFile file(folder_.path().string()); }).what(), HasSubstr("can't be read"));
}

TEST_F(TokenFileTest, IsReadAgainWhenItChanges) {
  write("first");
  const TokenFile file(path_);
  write("second, half written");
  EXPECT_EQ(file.token(), "first");
  write("second");
  EXPECT_EQ(file.token(), "second");
  std::filesystem::remove(path_);
  EXPECT_EQ(file.token(), "second");
}

TEST_F(TokenFileTest, IsLookedAtForOthersWhoCanReadIt) {
  namespace fs = std::filesystem;
  write("s3cret");
  fs::permissions(path_, fs::perms::owner_read);
  EXPECT_FALSE(others_can_read(path_));
  fs::permissions(path_, fs::perms::others_read, fs::perm_options::add);
  EXPECT_TRUE(others_can_read(path_));
  EXPECT_FALSE(others_can_read("/nowhere/token"));
}

TEST_F(TokenFileTest, GoesWithEachCall) {
  write("s3cret\n");
  FakeSlicer server;
  Client client({.address = server.address(), .retry = kOnce, .token_file = path_});
  client.server_info();
  const auto mesh = some_mesh();
  client.ensure_uploaded(mesh);
  const std::string bearer = " authorization=Bearer s3cret", id = " ccslice-mesh-id=" + mesh->id();
  EXPECT_THAT(server.metadata(),
              testing::UnorderedElementsAre("GetServerInfo" + bearer, "FindMissingMeshes" + bearer,
                                            "FindMissingMeshes" + id, "UploadMesh" + bearer, "UploadMesh" + id));
}

class Tls : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    certificates_ = std::make_unique<Certificates>();
    certificates_->make_authority("ca");
    certificates_->make_authority("stranger");
    certificates_->make_for("server", "DNS:localhost", "ca");
    certificates_->make_for("other", "DNS:other.example", "ca");
    certificates_->make_for("client", "DNS:client", "ca");
  }
  static void TearDownTestSuite() { certificates_.reset(); }

  static std::string file(const std::string& name) { return certificates_->path(name); }
  /// By name: certificates are for names.
  static std::string named(const FakeSlicer& server) {
    return "localhost" + server.address().substr(server.address().rfind(':'));
  }
  static ClientOptions options(const FakeSlicer& server, const TlsFiles& files) {
    return {.address = named(server), .retry = kOnce, .tls = files};
  }
  static std::string refusal_of(const TlsFiles& files) {
    const ClientError error = error_of([&] { read_tls_credentials(files); });
    EXPECT_EQ(error.reason(), local_reason::kCredentialsInvalid);
    return error.what();
  }
  static std::string failure_of(const ClientOptions& options) {
    Client client(options);
    const ClientError error = error_of([&] { client.server_info(); });
    EXPECT_EQ(error.code(), grpc::StatusCode::UNAVAILABLE);
    EXPECT_EQ(error.reason(), "");
    return error.what();
  }

  static inline std::unique_ptr<Certificates> certificates_;
};

TEST_F(Tls, IsSpokenWithServersThatTheAuthorityHasSigned) {
  const FakeSlicer server(certificates_->of_server("server"));
  Client client(options(server, {.ca = file("ca.pem")}));
  EXPECT_EQ(client.server_info().engine_version(), "engine-1");
}

TEST_F(Tls, RefusesServersOfOtherAuthoritiesAndForOtherNames) {
  const FakeSlicer server(certificates_->of_server("server")), other(certificates_->of_server("other"));
  failure_of(options(server, {.ca = file("stranger.pem")}));
  failure_of(options(other, {.ca = file("ca.pem")}));
  failure_of({.address = "https://" + named(server), .retry = kOnce});
  failure_of({.address = named(server), .retry = kOnce});
}

TEST_F(Tls, ShowsServersThatAskACertificate) {
  const FakeSlicer server(certificates_->of_server("server", "ca"));
  Client client(options(server, {file("ca.pem"), file("client.pem"), file("client.key")}));
  EXPECT_EQ(client.server_info().engine_version(), "engine-1");
  failure_of(options(server, {.ca = file("ca.pem")}));
}

TEST_F(Tls, IsForTheNameWhateverAddressItStandsFor) {
  const FakeSlicer other(certificates_->of_server("other"));
  ClientOptions options = {.address = "other.example:1", .retry = kOnce, .tls = TlsFiles{.ca = file("ca.pem")}};
  options.resolver = [address = other.address()](const auto&, const auto&) { return std::vector{address}; };
  EXPECT_EQ(Client(options).server_info().engine_version(), "engine-1");
  options.address = "another.example:1";
  failure_of(options);
}

TEST_F(Tls, IsNotSpokenOverSocketsOfThisMachine) {
  EXPECT_NO_THROW(Client({.address = "unix:/nowhere", .tls = TlsFiles{.ca = file("ca.pem")}}));
}

TEST_F(Tls, RefusesFilesThatCannotBeMeant) {
  EXPECT_THAT(refusal_of({.ca = "/nowhere/ca.pem"}), HasSubstr("/nowhere/ca.pem can't be read"));
  EXPECT_THAT(refusal_of({.ca = file("ca.key")}), HasSubstr("ca.key has no certificate in PEM form"));
  EXPECT_THAT(refusal_of({.cert = file("client.pem")}), HasSubstr("client.pem is a certificate without a key"));
  EXPECT_THAT(refusal_of({.key = file("client.key")}), HasSubstr("client.key is a key without a certificate"));
  EXPECT_THAT(refusal_of({.cert = file("client.pem"), .key = file("client.pem")}), HasSubstr("has no private key"));
  EXPECT_THAT(refusal_of({.cert = file("client.pem"), .key = file("server.key")}),
              HasSubstr("server.key isn't the key of the certificate " + file("client.pem")));
}

}  // namespace
}  // namespace ccslice::client
