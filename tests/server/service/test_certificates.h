// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Certificates for tests, made by openssl.

#pragma once

#include <filesystem>
#include <string>

#include "tests/support/temporary_folder.h"

namespace ccslice::server {

class TestCertificates {
 public:
  /// An authority in a folder of its own: ca.pem, ca.key.
  TestCertificates();
  TestCertificates(const TestCertificates&) = delete;
  TestCertificates& operator=(const TestCertificates&) = delete;

  /// NAME.pem and NAME.key, of this authority's, for localhost.
  void make(const std::string& name, const std::string& common_name, int days = 2) const;
  std::string path(const std::string& file) const { return (folder_ / file).string(); }
  std::string text(const std::string& file) const;
  /// Puts a copy of one file in another's place, as tools that renew certificates do.
  void put(const std::string& from, const std::string& to) const;

 private:
  void run(const std::string& command) const;
  const TemporaryFolder temporary_;
  const std::filesystem::path folder_ = temporary_.path();
};

}  // namespace ccslice::server
