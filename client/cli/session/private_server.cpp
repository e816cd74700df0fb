// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/session/private_server.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <thread>
#include <vector>

#include "client/cli/base/text_values.h"
#include "client/client_error.h"

extern char** environ;

namespace ccslice::cli {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using CallClock = std::chrono::system_clock;  // That of deadlines.

constexpr auto kLongestStart = 20s;  // On a machine that is busy, too.
constexpr auto kLongestEnd = 5s;
constexpr auto kLook = 10ms;

bool is_program(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored) && access(path.c_str(), X_OK) == 0;
}

[[noreturn]] void refuse_private(const std::string& why) {
  throw client::ClientError(grpc::StatusCode::UNAVAILABLE, "UNREACHABLE",
                            why + "; start ccsliced yourself and name it with --server or CCSLICE_SERVER");
}

/// A signal goes to this program alone, which then ends the server; and the server starts with no signal blocked.
struct Attributes {
  Attributes() {
    posix_spawnattr_init(&attributes);
    sigset_t none;
    sigemptyset(&none);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setpgroup(&attributes, 0);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETPGROUP);
  }
  ~Attributes() { posix_spawnattr_destroy(&attributes); }
  Attributes(const Attributes&) = delete;
  Attributes& operator=(const Attributes&) = delete;

  posix_spawnattr_t attributes = {};
};

void close_all(std::initializer_list<int> descriptors) {
  for (const int descriptor : descriptors) {
    if (descriptor >= 0) close(descriptor);
  }
}

}  // namespace

std::string find_ccsliced() {
  if (const char* const named = std::getenv("CCSLICED"); named != nullptr && *named != '\0') return named;
  std::error_code no_link;
  const fs::path folder = fs::read_symlink("/proc/self/exe", no_link).parent_path();
  std::vector<fs::path> places;
  if (!no_link) places = {folder / "ccsliced", folder.parent_path() / "server" / "ccsliced"};
  const char* const path = std::getenv("PATH");
  for (const std::string& name : split(path == nullptr ? "" : path, ':')) {
    if (name.starts_with("/")) places.push_back(fs::path(name) / "ccsliced");
  }
  const auto found = std::find_if(places.begin(), places.end(), is_program);
  return found == places.end() ? std::string() : found->string();
}

PrivateServer::PrivateServer(const std::string& program, const client::CallOptions& call) {
  start(program);
  try {
    wait_until_it_serves(program, call);
  } catch (...) {
    stop();
    throw;
  }
}

PrivateServer::~PrivateServer() { stop(); }

void PrivateServer::start(const std::string& program) {
  std::array<int, 2> input = {-1, -1}, output = {-1, -1};
  if (pipe2(input.data(), O_CLOEXEC) != 0 || pipe2(output.data(), O_CLOEXEC) != 0) {
    close_all({input[0], input[1]});
    refuse_private(std::string("no pipe to a server can be made: ") + std::strerror(errno));
  }
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, input[0], STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, output[1], STDOUT_FILENO);
  std::array<std::string, 4> words = {program, "--private", "--log-level", "error"};
  std::array<char*, 5> arguments = {words[0].data(), words[1].data(), words[2].data(), words[3].data(), nullptr};
  const Attributes attributes;
  const int status =
      posix_spawn(&process_, program.c_str(), &actions, &attributes.attributes, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close_all({input[0], output[1]});
  input_ = input[1];
  output_ = output[0];
  if (status == 0) return;
  process_ = -1;
  stop();
  refuse_private(program + " can't be started: " + std::strerror(status));
}

void PrivateServer::wait_until_it_serves(const std::string& program, const client::CallOptions& call) {
  const auto end = Clock::now() + kLongestStart;
  std::string line;
  while (!line.ends_with('\n')) {
    if (call.cancellation && call.cancellation->cancelled()) {
      throw client::ClientError(grpc::StatusCode::CANCELLED, client::local_reason::kCancelledHere, "interrupted");
    }
    if (call.deadline && CallClock::now() > *call.deadline) refuse_private(program + " doesn't serve in time");
    if (Clock::now() > end)
      refuse_private(program + " doesn't serve after " + std::to_string(kLongestStart.count()) + " s");
    pollfd waiting = {.fd = output_, .events = POLLIN, .revents = 0};
    if (poll(&waiting, 1, static_cast<int>(kLook / 1ms)) <= 0) continue;
    char next = 0;
    const ssize_t count = read(output_, &next, 1);
    if (count == 0)
      refuse_private(program + " --private ended before it served: it is another version, or says why above");
    if (count == 1) line += next;
  }
  line.pop_back();
  if (!line.starts_with("unix:"))
    refuse_private(program + " --private doesn't say where it serves: it is another version");
  address_ = line;
}

void PrivateServer::stop() noexcept {
  close_all({input_, output_});
  input_ = output_ = -1;
  if (process_ < 0) return;
  const auto end = Clock::now() + kLongestEnd;
  while (waitpid(process_, nullptr, WNOHANG) == 0) {
    if (Clock::now() > end) kill(process_, SIGKILL);
    std::this_thread::sleep_for(kLook);
  }
  process_ = -1;
}

}  // namespace ccslice::cli
