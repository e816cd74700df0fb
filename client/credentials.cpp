// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/credentials.h"

#include <grpcpp/security/credentials.h>
#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>

#include "client/client_error.h"

namespace ccslice::client {
namespace {

constexpr std::size_t kMostTokenBytes = 4096;
constexpr std::size_t kMostPemBytes = 4 << 20;

[[noreturn]] void refuse_file(const std::string& path, const std::string& what) {
  throw ClientError(grpc::StatusCode::INVALID_ARGUMENT, local_reason::kCredentialsInvalid, path + " " + what);
}

/// At most so many bytes of the file.
std::string read_some(const std::string& path, std::size_t most) {
  std::ifstream file(path, std::ios::binary);
  if (!file) refuse_file(path, std::string("can't be read: ") + std::strerror(errno));
  std::string bytes(most, '\0');
  errno = 0;
  file.read(bytes.data(), static_cast<std::streamsize>(most));
  if (file.bad() || errno == EISDIR) refuse_file(path, std::string("can't be read: ") + std::strerror(errno));
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  return bytes;
}

std::string read_token(const std::string& path) {
  const std::string bytes = read_some(path, kMostTokenBytes + 2);
  std::string token = bytes.substr(0, bytes.find('\n'));
  if (token.ends_with('\r')) token.pop_back();
  if (token.empty()) refuse_file(path, "has no token: its first line is empty");
  if (!std::ranges::all_of(token, [](char c) { return c > ' ' && c <= '~'; })) {
    refuse_file(path, "has no token: its first line is to be printable ASCII without spaces");
  }
  if (token.size() > kMostTokenBytes) {
    refuse_file(path, "has no token: its first line is longer than " + std::to_string(kMostTokenBytes) + " bytes");
  }
  return token;
}

using Bio = std::unique_ptr<BIO, decltype(&BIO_free)>;
using Certificate = std::unique_ptr<X509, decltype(&X509_free)>;
using PrivateKey = std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)>;

Bio bio_of(const std::string& text) { return {BIO_new_mem_buf(text.data(), static_cast<int>(text.size())), BIO_free}; }

/// gRPC says of certificates that are none no more than that a handshake failed.
Certificate certificate_of(const std::string& path, const std::string& pem) {
  Certificate certificate(PEM_read_bio_X509(bio_of(pem).get(), nullptr, nullptr, nullptr), X509_free);
  ERR_clear_error();
  if (!certificate) refuse_file(path, "has no certificate in PEM form (-----BEGIN CERTIFICATE-----)");
  return certificate;
}

/// Of a key without a passphrase: asking for one has no place here.
PrivateKey key_of(const std::string& path, const std::string& pem) {
  const auto no_passphrase = [](char*, int, int, void*) { return -1; };
  PrivateKey key(PEM_read_bio_PrivateKey(bio_of(pem).get(), nullptr, no_passphrase, nullptr), EVP_PKEY_free);
  ERR_clear_error();
  if (!key) refuse_file(path, "has no private key in PEM form without a passphrase");
  return key;
}

}  // namespace

std::shared_ptr<grpc::ChannelCredentials> read_tls_credentials(const TlsFiles& files) {
  grpc::SslCredentialsOptions options;
  if (!files.ca.empty()) {
    options.pem_root_certs = read_some(files.ca, kMostPemBytes);
    (void)certificate_of(files.ca, options.pem_root_certs);
  }
  if (files.cert.empty() && !files.key.empty()) refuse_file(files.key, "is a key without a certificate: name both");
  if (files.key.empty() && !files.cert.empty()) refuse_file(files.cert, "is a certificate without a key: name both");
  if (!files.cert.empty()) {
    options.pem_cert_chain = read_some(files.cert, kMostPemBytes);
    options.pem_private_key = read_some(files.key, kMostPemBytes);
    const Certificate certificate = certificate_of(files.cert, options.pem_cert_chain);
    const bool fits = X509_check_private_key(certificate.get(), key_of(files.key, options.pem_private_key).get()) == 1;
    ERR_clear_error();
    if (!fits) refuse_file(files.key, "isn't the key of the certificate " + files.cert);
  }
  return grpc::SslCredentials(options);
}

TokenFile::TokenFile(const std::string& path) : path_(path), token_(read_token(path)) {
  (void)stat(path.c_str(), &seen_);
}

std::string TokenFile::token() const {
  const std::lock_guard lock(mutex_);
  struct stat now = {};
  const bool same = stat(path_.c_str(), &now) != 0 || !S_ISREG(now.st_mode) ||
                    (now.st_ino == seen_.st_ino && now.st_size == seen_.st_size &&
                     now.st_mtim.tv_sec == seen_.st_mtim.tv_sec && now.st_mtim.tv_nsec == seen_.st_mtim.tv_nsec);
  if (same) return token_;
  try {
    token_ = read_token(path_);
    seen_ = now;
  } catch (const ClientError&) {
  }
  return token_;
}

bool others_can_read(const std::string& path) {
  struct stat found = {};
  return stat(path.c_str(), &found) == 0 && S_ISREG(found.st_mode) && (found.st_mode & S_IROTH) != 0;
}

}  // namespace ccslice::client
