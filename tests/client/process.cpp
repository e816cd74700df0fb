// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/client/process.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>

#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <stdexcept>

extern char** environ;

namespace ccslice::client {
namespace {

namespace fs = std::filesystem;

std::vector<char*> pointers_to(std::vector<std::string>& words) {
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  return pointers;
}

}  // namespace

Process::Process(const std::vector<std::string>& command, const fs::path& folder)
    : out_(folder / "stdout"), err_(folder / "stderr") {
  std::vector<std::string> words = command;
  const std::vector<char*> arguments = pointers_to(words);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 1, out_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_addopen(&actions, 2, err_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  const int status = posix_spawn(&pid_, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (status != 0) throw std::runtime_error("can't start " + command.front());
}

Process::~Process() {
  if (pid_ < 0) return;
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
}

void Process::send_signal(int signal) const { kill(pid_, signal); }

std::uint64_t Process::peak_memory_bytes() const {
  const std::string status = read_whole("/proc/" + std::to_string(pid_) + "/status"), field = "VmHWM:";
  const std::size_t at = status.find(field);
  return at == std::string::npos ? 0 : 1024 * std::stoull(status.substr(at + field.size()));
}

bool Process::catches(int signal) const {
  const std::string status = read_whole("/proc/" + std::to_string(pid_) + "/status");
  for (const std::string mask : {"SigBlk:", "SigCgt:"}) {
    const std::size_t at = status.find(mask);
    if (at == std::string::npos) continue;
    if (std::stoull(status.substr(at + mask.size()), nullptr, 16) >> (signal - 1) & 1) return true;
  }
  return false;
}

std::string Process::out_so_far() const { return read_whole(out_); }

ProcessResult Process::wait() {
  int status = 0;
  waitpid(pid_, &status, 0);
  pid_ = -1;
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), read_whole(out_), read_whole(err_)};
}

std::string read_whole(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

}  // namespace ccslice::client
