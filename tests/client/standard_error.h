// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What is written to standard error, for tests of what users see there.

#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <string>

namespace ccslice::cli {

/// Standard error is this file as long as it lives.
class StandardError {
 public:
  explicit StandardError(int descriptor) : kept_(dup(STDERR_FILENO)) {
    std::fflush(stderr);
    dup2(descriptor, STDERR_FILENO);
  }
  ~StandardError() {
    std::fflush(stderr);
    dup2(kept_, STDERR_FILENO);
    close(kept_);
  }
  StandardError(const StandardError&) = delete;
  StandardError& operator=(const StandardError&) = delete;

 private:
  const int kept_;
};

/// What comes out of a terminal.
template <typename Show>
std::string shown_on_terminal(const Show& show) {
  const int terminal = posix_openpt(O_RDWR | O_NOCTTY);
  EXPECT_TRUE(terminal >= 0 && grantpt(terminal) == 0 && unlockpt(terminal) == 0);
  const int line = open(ptsname(terminal), O_RDWR | O_NOCTTY);
  EXPECT_GE(line, 0);
  {
    const StandardError shown(line);
    show();
  }
  fcntl(terminal, F_SETFL, O_NONBLOCK);
  std::string text;
  std::array<char, 4096> buffer;
  for (ssize_t length; (length = ::read(terminal, buffer.data(), buffer.size())) > 0;) {
    text.append(buffer.data(), static_cast<std::size_t>(length));
  }
  close(line);
  close(terminal);
  return text;
}

}  // namespace ccslice::cli
