// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// hostile_jobs: looks for jobs that break promises, among random ones that nobody tuned anything for. A seed is a job:
// a mesh (tests/oracle/hostile/hostile_mesh.h), how it is sliced (hostile_job.h), and what is checked
// (hostile_check.h). Prints a line for each seed that fails, and a summary.

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <exception>
#include <mutex>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "core/base/read_file.h"
#include "core/mesh_files/read_mesh.h"
#include "core/mesh_import/mesh_file.h"
#include "tests/bench/hostile_report.h"
#include "tests/oracle/hostile/hostile_check.h"

namespace ccslice::bench {
namespace {

using oracle::HostileResult;

struct Options {
  std::uint64_t first = 1, last = 200;
  unsigned threads = std::max(1u, std::thread::hardware_concurrency());
  double most_voxels = oracle::HostileOptions().most_voxels;
  std::vector<std::string> meshes;
  std::string json;
  bool only_linear = false, only_channels = false, only_subdivided = false, prove = false, verbose = false;
};

std::uint64_t to_number(std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) {
    throw CLI::ValidationError("--seeds", "'" + std::string(text) + "' isn't a number; give A..B or one seed");
  }
  return value;
}

void set_seeds(const std::string& text, Options& options) {
  const std::size_t dots = text.find("..");
  options.first = to_number(std::string_view(text).substr(0, dots));
  options.last = dots == std::string::npos ? options.first : to_number(std::string_view(text).substr(dots + 2));
  if (options.last < options.first) throw CLI::ValidationError("--seeds", "the last is below the first");
}

std::vector<oracle::NamedMesh> read_meshes(const Options& options) {
  std::vector<oracle::NamedMesh> meshes;
  for (const std::string& path : options.meshes) {
    meshes.push_back({path, read_mesh(read_file_bytes(path, std::uint64_t{1} << 30)).mesh});
  }
  return meshes;
}

thread_local std::uint64_t seed_at_work = 0;

/// Says which seed it was, in what a signal handler may use.
void tell_of_crash(int signal) {
  std::array<char, 96> text;
  constexpr std::string_view kBegin = "FAILED seed ", kEnd = ": CRASHED\n";
  char* end = std::copy(kBegin.begin(), kBegin.end(), text.data());
  end = std::to_chars(end, end + 24, seed_at_work).ptr;
  end = std::copy(kEnd.begin(), kEnd.end(), end);
  if (write(STDOUT_FILENO, text.data(), static_cast<std::size_t>(end - text.data())) < 0) _exit(3);
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

/// Runs the seeds on several threads, and reports from one at a time.
class SeedRunner {
 public:
  SeedRunner(const Options& options, const std::vector<oracle::NamedMesh>& meshes)
      : options_(options),
        hostile_{options.most_voxels,     meshes,       options.only_linear, options.only_channels,
                 options.only_subdivided, options.prove},
        next_(options.first) {}

  std::vector<HostileResult> run() {
    std::vector<std::jthread> threads;
    for (unsigned i = 0; i < options_.threads; ++i) threads.emplace_back([this] { work(); });
    threads.clear();
    std::sort(results_.begin(), results_.end(), [](const auto& a, const auto& b) { return a.seed < b.seed; });
    return std::move(results_);
  }

 private:
  void work() {
    for (std::uint64_t seed = next_++; seed <= options_.last; seed = next_++) {
      seed_at_work = seed;
      take(oracle::run_hostile_seed(seed, hostile_));
    }
  }

  void take(HostileResult result) {
    const std::lock_guard lock(mutex_);
    failed_ += result.failed();
    if (result.failed() || options_.verbose) {
      std::printf("%s%s\n", result.failed() ? "FAILED " : "", oracle::to_text(result).c_str());
      std::fflush(stdout);
    }
    results_.push_back(std::move(result));
    const auto now = std::chrono::steady_clock::now();
    if (now - last_word_ < std::chrono::seconds(10)) return;
    last_word_ = now;
    std::fprintf(stderr, "%zu of %llu seeds, %llu failed\n", results_.size(),
                 static_cast<unsigned long long>(options_.last - options_.first + 1),
                 static_cast<unsigned long long>(failed_));
  }

  const Options& options_;
  const oracle::HostileOptions hostile_;
  std::atomic<std::uint64_t> next_;
  std::mutex mutex_;  // Of those below.
  std::vector<HostileResult> results_;
  std::uint64_t failed_ = 0;
  std::chrono::steady_clock::time_point last_word_ = std::chrono::steady_clock::now();
};

bool report(const Options& options, const std::vector<HostileResult>& results) {
  if (!options.json.empty()) write_json(options.json, results);
  return print_summary(results);
}

}  // namespace
}  // namespace ccslice::bench

int main(int argc, char** argv) {
  using namespace ccslice::bench;
  CLI::App app(
      "Slices random jobs, a job a seed, and checks what is promised of every job. Exit code 1 if anything failed.\n"
      "A line for each seed that failed says what its job is. To look into it: --seeds N --verbose");
  Options options;
  app.add_option_function<std::string>(
         "--seeds", [&](const std::string& text) { set_seeds(text, options); }, "A..B, both included, or one seed")
      ->default_str("1..200");
  app.add_option("--threads", options.threads, "Seeds worked on at a time")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  app.add_option("--most-voxels", options.most_voxels,
                 "Of a job at most, about, those outside of the part included. Part of what a seed stands for")
      ->check(CLI::Range(100.0, 1e9))
      ->capture_default_str();
  app.add_option("--mesh", options.meshes,
                 "Mesh files to take the shapes from, instead of made ones; sizes, channels and all else stay random")
      ->expected(1, -1);
  app.add_option("--json", options.json, "Write what was found of every seed");
  app.add_flag("--only-linear", options.only_linear,
               "Only compare channels that are linear in the position with it: no voxel is inverted, so many more "
               "are looked at. Seeds without such a channel do nothing");
  app.add_flag(
      "--only-channels", options.only_channels,
      "No cell regions, and no planes but those of channels and the occupancy. Part of what a seed stands for");
  app.add_flag("--only-subdivided", options.only_subdivided,
               "No mesh is taken as meshed, as a third are. Part of what a seed stands for");
  app.add_flag("--prove", options.prove, "Jobs ask for proof: nothing is interpolated that is judged by samples alone");
  app.add_flag("--verbose", options.verbose, "A line for every seed");
  CLI11_PARSE(app, argc, argv);
  try {
    for (const int signal : {SIGSEGV, SIGFPE, SIGABRT, SIGBUS, SIGILL}) std::signal(signal, tell_of_crash);
    const std::vector<ccslice::oracle::NamedMesh> meshes = read_meshes(options);
    return report(options, SeedRunner(options, meshes).run()) ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "hostile_jobs: %s\n", error.what());
    return 2;
  }
}
