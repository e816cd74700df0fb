// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Who the client is, and whom it trusts: files of certificates for TLS, and the file of a bearer token. Errors name the
// file and never repeat what is in it.

#pragma once

#include <sys/stat.h>

#include <memory>
#include <mutex>
#include <string>

namespace grpc {
class ChannelCredentials;
}

namespace ccslice::client {

/// Paths of PEM files.
struct TlsFiles {
  std::string ca = {};              // Whose signatures count. Empty: those that the system trusts.
  std::string cert = {}, key = {};  // The client's own, for servers that ask. Both or none.
};

/// Throws ClientError (CREDENTIALS_INVALID) for what can't be read, is no PEM, or doesn't fit.
std::shared_ptr<grpc::ChannelCredentials> read_tls_credentials(const TlsFiles& files);

/// A file whose first line is a token. Thread-safe.
class TokenFile {
 public:
  /// Throws ClientError (CREDENTIALS_INVALID) for what can't be read or is no token.
  explicit TokenFile(const std::string& path);

  /// The token: a file that has changed is read again, and one that is no good at the moment, since somebody writes it,
  /// leaves the token as it was.
  std::string token() const;

 private:
  const std::string path_;
  mutable std::mutex mutex_;
  mutable struct stat seen_ = {};
  mutable std::string token_;
};

/// Whether everybody on the machine may read the file.
bool others_can_read(const std::string& path);

}  // namespace ccslice::client
