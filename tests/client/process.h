// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"

namespace ccslice::client {

using ccslice::TemporaryFolder;

struct ProcessResult {
  int exit_code = -1;  // 128 + signal if a signal ended it.
  std::string out, err;
};

/// A program running with its output caught in files of `folder`.
class Process {
 public:
  Process(const std::vector<std::string>& command, const std::filesystem::path& folder);
  /// Kills it if it is still running.
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void send_signal(int signal) const;
  /// It won't die of the signal any more: it has a handler, or waits for it with the signal blocked.
  bool catches(int signal) const;
  /// The most memory that it has held by now; 0 once it is at its end.
  std::uint64_t peak_memory_bytes() const;
  /// What it has written to standard output by now.
  std::string out_so_far() const;
  /// Waits for its end.
  ProcessResult wait();

 private:
  std::filesystem::path out_, err_;
  pid_t pid_ = -1;
};

std::string read_whole(const std::filesystem::path& path);

}  // namespace ccslice::client
