// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Certificates of this test's own authorities, made by the command openssl.

#pragma once

#include <grpcpp/security/server_credentials.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "tests/client/process.h"

namespace ccslice::client {

class Certificates {
 public:
  /// Makes NAME.pem and NAME.key, signed by themselves.
  void make_authority(const std::string& name) { make(name, {}); }
  /// Makes NAME.pem and NAME.key for a host such as "DNS:localhost", signed by the authority.
  void make_for(const std::string& name, const std::string& host, const std::string& authority) {
    make(name,
         {"-CA", path(authority + ".pem"), "-CAkey", path(authority + ".key"), "-addext", "subjectAltName=" + host});
  }

  std::string path(const std::string& file) const { return (folder_.path() / file).string(); }

  /// Those of a server; `client_authority` empty: clients need no certificate.
  std::shared_ptr<grpc::ServerCredentials> of_server(const std::string& name,
                                                     const std::string& client_authority = "") const {
    grpc::SslServerCredentialsOptions options(client_authority.empty()
                                                  ? GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE
                                                  : GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
    options.pem_key_cert_pairs.push_back({read_whole(path(name + ".key")), read_whole(path(name + ".pem"))});
    if (!client_authority.empty()) options.pem_root_certs = read_whole(path(client_authority + ".pem"));
    return grpc::SslServerCredentials(options);
  }

 private:
  void make(const std::string& name, const std::vector<std::string>& signer) {
    std::vector<std::string> command = {"/usr/bin/openssl",
                                        "req",
                                        "-x509",
                                        "-newkey",
                                        "ec",
                                        "-pkeyopt",
                                        "ec_paramgen_curve:prime256v1",
                                        "-nodes",
                                        "-days",
                                        "2",
                                        "-subj",
                                        "/CN=" + name,
                                        "-keyout",
                                        path(name + ".key"),
                                        "-out",
                                        path(name + ".pem")};
    command.insert(command.end(), signer.begin(), signer.end());
    const ProcessResult result = Process(command, folder_.path()).wait();
    EXPECT_EQ(result.exit_code, 0) << result.err;
  }

  TemporaryFolder folder_;
};

}  // namespace ccslice::client
