// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A real Redis on a free port of this machine.

#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"

namespace ccslice::server {

class RedisProcess {
 public:
  /// `options` of redis-server's, such as "--requirepass". Throws std::runtime_error if it doesn't come up.
  explicit RedisProcess(std::vector<std::string> options = {});
  ~RedisProcess();
  RedisProcess(const RedisProcess&) = delete;
  RedisProcess& operator=(const RedisProcess&) = delete;

  int port() const { return port_; }
  void kill() { signal_and_wait(9); }
  void start();
  /// It stays there, and answers nothing.
  void stop_answering();
  void answer_again();
  /// What redis-cli prints for a command.
  std::string ask(const std::string& command) const;

 private:
  void signal_and_wait(int signal);

  std::vector<std::string> options_;
  const TemporaryFolder folder_;
  int port_ = 0;
  pid_t process_ = 0;
};

}  // namespace ccslice::server
