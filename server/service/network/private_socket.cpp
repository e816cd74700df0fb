// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/network/private_socket.h"

#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <stdexcept>

namespace ccslice::server {

PrivateSocket::PrivateSocket() {
  // mkdtemp wants six of them at the end. The folder it makes has mode 0700.
  std::string name = (std::filesystem::temp_directory_path() / "ccsliced-").string() + std::string(6, 'X');
  if (mkdtemp(name.data()) == nullptr) {
    throw std::runtime_error("can't make a folder like " + name + " for a socket: " + std::strerror(errno));
  }
  folder_ = name;
  if (path().size() < sizeof(sockaddr_un::sun_path)) return;
  rmdir(folder_.c_str());
  throw std::runtime_error("the folder for temporary files has too long a name for a socket: " + folder_ +
                           "; set TMPDIR to a shorter one");
}

PrivateSocket::~PrivateSocket() {
  unlink(path().c_str());
  rmdir(folder_.c_str());
}

void wait_for_end_of_input(int descriptor) {
  std::array<char, 256> dropped;
  for (;;) {
    const ssize_t count = read(descriptor, dropped.data(), dropped.size());
    if (count == 0 || (count < 0 && errno != EINTR)) return;
  }
}

}  // namespace ccslice::server
