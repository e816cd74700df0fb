// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/server/service/redis_process.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>
#include <csignal>

#include <array>
#include <chrono>
#include <cstdio>
#include <stdexcept>
#include <thread>
#include <utility>

namespace ccslice::server {
namespace {

using namespace std::chrono_literals;

sockaddr_in loopback(int port) {
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

int free_port() {
  const int descriptor = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address = loopback(0);
  socklen_t size = sizeof(address);
  ::bind(descriptor, reinterpret_cast<sockaddr*>(&address), size);
  ::getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &size);
  ::close(descriptor);
  return ntohs(address.sin_port);
}

bool is_listening(int port) {
  const int descriptor = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address = loopback(port);
  const bool connects = ::connect(descriptor, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0;
  ::close(descriptor);
  return connects;
}

}  // namespace

RedisProcess::RedisProcess(std::vector<std::string> options) : options_(std::move(options)), port_(free_port()) {
  start();
}

RedisProcess::~RedisProcess() { signal_and_wait(SIGKILL); }

void RedisProcess::start() {
  std::vector<std::string> words = {
      "redis-server", "--port",    std::to_string(port_), "--bind", "127.0.0.1", "--save", "", "--dir",
      folder_.path(), "--logfile", folder_.path() / "log"};
  words.insert(words.end(), options_.begin(), options_.end());
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  process_ = ::fork();
  if (process_ == 0) {
    ::execvp(arguments.front(), arguments.data());
    ::_exit(127);
  }
  for (int i = 0; i < 500; ++i) {
    if (is_listening(port_)) return;
    std::this_thread::sleep_for(10ms);
  }
  signal_and_wait(SIGKILL);
  throw std::runtime_error("redis-server doesn't come up: deploy/install.sh test installs it");
}

void RedisProcess::stop_answering() { ::kill(process_, SIGSTOP); }

void RedisProcess::answer_again() { ::kill(process_, SIGCONT); }

std::string RedisProcess::ask(const std::string& command) const {
  const std::string line = "redis-cli -p " + std::to_string(port_) + " " + command;
  FILE* const output = ::popen(line.c_str(), "r");
  std::string text;
  std::array<char, 4096> piece;
  while (const std::size_t count = std::fread(piece.data(), 1, piece.size(), output)) text.append(piece.data(), count);
  ::pclose(output);
  return text;
}

void RedisProcess::signal_and_wait(int signal) {
  if (process_ <= 0) return;
  ::kill(process_, signal);
  ::waitpid(process_, nullptr, 0);
  process_ = 0;
}

}  // namespace ccslice::server
