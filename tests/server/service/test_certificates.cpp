// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/server/service/test_certificates.h"

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace ccslice::server {

namespace fs = std::filesystem;

TestCertificates::TestCertificates() {
  std::ofstream(folder_ / "names") << "subjectAltName=DNS:localhost,IP:127.0.0.1\n";
  run("openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -days 2 -subj '/CN=test authority' "
      "-keyout ca.key -out ca.pem");
}

void TestCertificates::make(const std::string& name, const std::string& common_name, int days) const {
  run("openssl req -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -subj '/CN=" + common_name + "' -keyout " + name +
      ".key -out " + name + ".csr");
  run("openssl x509 -req -in " + name + ".csr -CA ca.pem -CAkey ca.key -CAcreateserial -days " + std::to_string(days) +
      " -extfile names -out " + name + ".pem");
}

std::string TestCertificates::text(const std::string& file) const {
  std::ifstream stream(folder_ / file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void TestCertificates::put(const std::string& from, const std::string& to) const {
  fs::copy_file(folder_ / from, folder_ / "fresh");
  fs::rename(folder_ / "fresh", folder_ / to);
}

void TestCertificates::run(const std::string& command) const {
  const std::string line = "cd '" + folder_.string() + "' && " + command + " 2>log";
  if (std::system(line.c_str()) != 0) throw std::runtime_error(command + " fails: " + text("log"));
}

}  // namespace ccslice::server
