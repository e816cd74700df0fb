// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The server's certificate, its key, and the authority of clients' certificates, as gRPC serves them.
//
// gRPC looks at files again and again, and takes whatever is there: also a certificate whose key hasn't come yet. So it
// is given files in memory, into which only what fits together gets.

#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "server/service/network/listen_socket.h"

namespace ccslice::server {

struct CertificateFiles {
  std::string certificate, key;  // Both empty: no TLS.
  std::string client_authority;  // Empty: clients need no certificate.
};

/// What is in the files, in PEM.
struct CertificateTexts {
  std::string certificate, key, client_authority;
};

/// When the first of the certificates in the texts ends that the server shows, and the first authority; seconds since
/// 1970 in UTC. 0: there is none.
struct CertificateEnds {
  std::int64_t certificate_s = 0, client_authority_s = 0;
};

/// Throws std::invalid_argument: what doesn't parse, or doesn't fit together. `now`: for certificates that have
/// expired.
CertificateEnds require_certificates(const CertificateTexts& texts, std::chrono::system_clock::time_point now);

/// One thread at a time.
class ServedCertificates {
 public:
  /// REQUIRES: a certificate and a key. Throws std::runtime_error if a file can't be read, or they don't fit together.
  explicit ServedCertificates(CertificateFiles files);

  /// What gRPC is to read. The paths stay the same.
  const CertificateFiles& served() const noexcept { return served_; }
  /// Of what is served. Any thread.
  CertificateEnds ends() const noexcept {
    return {.certificate_s = certificate_end_s_.load(), .client_authority_s = client_authority_end_s_.load()};
  }
  /// Reads the files again if they have changed, or if told so. Those that don't fit together leave what is served as
  /// it is, and a line in the log. True if there are new ones.
  bool reload(bool always);

 private:
  using Version = std::array<std::int64_t, 4>;
  using Versions = std::array<Version, 3>;

  Versions versions() const;
  void read_and_serve();
  void serve(const CertificateTexts& texts);

  const CertificateFiles files_;
  CertificateFiles served_;
  std::array<Descriptor, 3> memory_;
  Versions seen_{};
  std::atomic<std::int64_t> certificate_end_s_{0}, client_authority_end_s_{0};
};

}  // namespace ccslice::server
