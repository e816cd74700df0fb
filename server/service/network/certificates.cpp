// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/network/certificates.h"

#include <fcntl.h>
#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <spdlog/spdlog.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <fstream>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <utility>

#include "server/service/base/file_version.h"

namespace ccslice::server {
namespace {

struct FreeOpenSsl {
  void operator()(BIO* bio) const { BIO_free(bio); }
  void operator()(X509* certificate) const { X509_free(certificate); }
  void operator()(EVP_PKEY* key) const { EVP_PKEY_free(key); }
};
template <class T>
using OpenSslPtr = std::unique_ptr<T, FreeOpenSsl>;

OpenSslPtr<BIO> bio_of(const std::string& text) {
  return OpenSslPtr<BIO>(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

/// Nobody is asked for the password of a key.
int no_password(char*, int, int, void*) { return -1; }

std::int64_t end_of(const X509& certificate) {
  std::tm end{};
  if (ASN1_TIME_to_tm(X509_get0_notAfter(&certificate), &end) != 1) return 0;
  return ::timegm(&end);
}

struct ParsedCertificates {
  OpenSslPtr<X509> first;
  std::int64_t end_s = 0;  // Of the one that ends first.
};

/// All of the certificates have to be whole.
ParsedCertificates parse_certificates(const std::string& text, const std::string& what) {
  constexpr std::string_view kBegin = "-----BEGIN ";
  std::size_t blocks = 0, parsed = 0;
  for (std::size_t at = text.find(kBegin); at != std::string::npos; at = text.find(kBegin, at + 1)) ++blocks;
  const OpenSslPtr<BIO> bio = bio_of(text);
  ParsedCertificates all;
  while (OpenSslPtr<X509> next{PEM_read_bio_X509(bio.get(), nullptr, &no_password, nullptr)}) {
    const std::int64_t end_s = end_of(*next);
    all.end_s = parsed == 0 ? end_s : std::min(all.end_s, end_s);
    if (parsed++ == 0) all.first = std::move(next);
  }
  ERR_clear_error();
  if (parsed > 0 && parsed == blocks) return all;
  if (parsed > 0)
    throw std::invalid_argument(what + " has a certificate that isn't whole, or something else between them");
  throw std::invalid_argument(what + " holds no certificate in PEM (-----BEGIN CERTIFICATE-----)");
}

std::string read_file(const std::string& path, const char* option) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::invalid_argument(std::string(option) + ": " + path + " can't be read");
  return {std::istreambuf_iterator<char>(file), {}};
}

Descriptor file_in_memory(const std::string& text) {
  Descriptor file(::memfd_create("ccsliced-certificate", MFD_CLOEXEC));
  if (!file || ::write(file.get(), text.data(), text.size()) != static_cast<ssize_t>(text.size())) {
    throw std::runtime_error(std::string("there is no memory for certificates: ") + std::strerror(errno));
  }
  return file;
}

}  // namespace

CertificateEnds require_certificates(const CertificateTexts& texts, std::chrono::system_clock::time_point now) {
  const ParsedCertificates shown = parse_certificates(texts.certificate, "--tls-cert");
  X509* const certificate = shown.first.get();
  const OpenSslPtr<BIO> bio = bio_of(texts.key);
  const OpenSslPtr<EVP_PKEY> key(PEM_read_bio_PrivateKey(bio.get(), nullptr, &no_password, nullptr));
  ERR_clear_error();
  if (!key) throw std::invalid_argument("--tls-key holds no private key in PEM, or one with a password");
  const bool fit = X509_check_private_key(certificate, key.get()) == 1;
  ERR_clear_error();
  if (!fit) throw std::invalid_argument("--tls-key isn't the key of --tls-cert: give both of the same pair");
  std::time_t seconds = std::chrono::system_clock::to_time_t(now);
  if (X509_cmp_time(X509_get0_notAfter(certificate), &seconds) < 0) {
    throw std::invalid_argument("--tls-cert has expired: renew it");
  }
  CertificateEnds ends{.certificate_s = shown.end_s};
  if (!texts.client_authority.empty()) {
    ends.client_authority_s = parse_certificates(texts.client_authority, "--tls-client-ca").end_s;
  }
  return ends;
}

ServedCertificates::ServedCertificates(CertificateFiles files) : files_(std::move(files)) {
  try {
    seen_ = versions();
    read_and_serve();
  } catch (const std::invalid_argument& why) {
    throw std::runtime_error(why.what());
  }
  const auto path_of = [](const Descriptor& file) { return "/proc/self/fd/" + std::to_string(file.get()); };
  served_ = {.certificate = path_of(memory_[0]),
             .key = path_of(memory_[1]),
             .client_authority = files_.client_authority.empty() ? "" : path_of(memory_[2])};
}

ServedCertificates::Versions ServedCertificates::versions() const {
  return {file_version(files_.certificate), file_version(files_.key), file_version(files_.client_authority)};
}

void ServedCertificates::read_and_serve() {
  CertificateTexts texts{.certificate = read_file(files_.certificate, "--tls-cert"),
                         .key = read_file(files_.key, "--tls-key"),
                         .client_authority = {}};
  if (!files_.client_authority.empty()) {
    texts.client_authority = read_file(files_.client_authority, "--tls-client-ca");
    if (texts.client_authority.empty()) throw std::invalid_argument("--tls-client-ca is empty");
  }
  const CertificateEnds ends = require_certificates(texts, std::chrono::system_clock::now());
  serve(texts);
  certificate_end_s_ = ends.certificate_s;
  client_authority_end_s_ = ends.client_authority_s;
}

/// Each file takes another's place at once: gRPC never sees half of one.
void ServedCertificates::serve(const CertificateTexts& texts) {
  std::array<Descriptor, 3> fresh = {file_in_memory(texts.certificate), file_in_memory(texts.key),
                                     file_in_memory(texts.client_authority)};
  for (std::size_t i = 0; i < fresh.size(); ++i) {
    if (!memory_[i]) {
      memory_[i] = std::move(fresh[i]);
    } else if (::dup3(fresh[i].get(), memory_[i].get(), O_CLOEXEC) < 0) {
      throw std::runtime_error(std::string("certificates can't be taken: ") + std::strerror(errno));
    }
  }
}

bool ServedCertificates::reload(bool always) {
  const Versions now = versions();
  if (!always && now == seen_) return false;
  seen_ = now;
  try {
    read_and_serve();
    spdlog::info("the TLS certificate has been read from {}", files_.certificate);
    return true;
  } catch (const std::exception& why) {
    spdlog::error("the TLS certificate isn't taken, what was served before is served on: {}", why.what());
    return false;
  }
}

}  // namespace ccslice::server
