// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// preparation_heap: what preparing a mesh holds at most, against what it asks for and what it keeps, in kB a control
// cell; and what its steps held at most, as far as a look every millisecond tells. Not a part of prepare_bench, as
// counting takes time.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "core/base/read_file.h"
#include "core/limit/limit_solid.h"
#include "core/mesh_files/read_mesh.h"
#include "core/mesh_import/mesh_file.h"
#include "core/prepare/prepare_solid.h"
#include "tests/support/allocation_count.h"

namespace ccslice::bench {
namespace {

constexpr std::uint64_t kMostFileBytes = std::uint64_t{4} << 30;
constexpr std::array<const char*, kPreparationSteps> kSteps = {
    "waiting", "reading", "checking", "refining", "building", "measuring", "bounding", "folding", "finishing"};

/// Looks on from a thread of its own.
class StepWatch {
 public:
  StepWatch(const PreparationProgress& progress, const oracle::HeldMemory& held)
      : watcher_([this, &progress, &held](const std::stop_token& stop) {
          while (!stop.stop_requested()) {
            std::size_t& most = most_bytes_[static_cast<std::size_t>(progress.state().step)];
            most = std::max(most, held.bytes());
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
          }
        }) {}

  /// By step.
  const std::array<std::size_t, kPreparationSteps>& stop() {
    watcher_.request_stop();
    watcher_.join();
    return most_bytes_;
  }

 private:
  std::array<std::size_t, kPreparationSteps> most_bytes_{};
  std::jthread watcher_;
};

void print_figures(const std::string& path, int threads, bool allow_folds) {
  ControlMesh mesh = read_mesh(read_file_bytes(path, kMostFileBytes), {}, {path}).mesh;
  mesh.allow_folds |= allow_folds;
  const auto cells = static_cast<double>(mesh.cell_count());
  const auto print = [&](const char* what, std::uint64_t bytes) {
    std::printf("  %-28s %8.2f\n", what, 1e-3 * static_cast<double>(bytes) / cells);
  };
  std::printf("%s: %.0f cells, %d threads, kB a cell\n", std::filesystem::path(path).filename().c_str(), cells,
              threads);
  const oracle::HeldMemory held;
  std::uint64_t asked = 0;
  PrepareOptions options;
  options.threads = threads;
  options.reserve = [&](std::uint64_t bytes) {
    if (asked == 0) print("asked for at first", bytes);
    asked = bytes;
  };
  PreparationProgress progress;
  options.progress = &progress;
  StepWatch watch(progress, held);
  const auto solid = prepare_solid(std::move(mesh), options);
  const auto& most_by_step = watch.stop();
  print("asked for", asked);
  print("held at most", held.most_bytes());
  print("kept", solid->summary().memory_bytes);
  for (auto step = static_cast<std::size_t>(PreparationStep::kChecking); step < kPreparationSteps; ++step) {
    print(kSteps[step], most_by_step[step]);
  }
}

}  // namespace
}  // namespace ccslice::bench

int main(int argc, char** argv) {
  CLI::App app("Prints what preparing meshes holds, in kB a cell");
  std::vector<std::string> files;
  int threads = 1;
  bool allow_folds = false;
  app.add_option("files", files, "Mesh files")->check(CLI::ExistingFile)->required();
  app.add_option("--threads", threads, "At most")->check(CLI::Range(1, 256))->capture_default_str();
  app.add_flag("--allow-folds", allow_folds, "Prepare meshes with inverted cells, too");
  CLI11_PARSE(app, argc, argv);
  try {
    for (const std::string& file : files) ccslice::bench::print_figures(file, threads, allow_folds);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "preparation_heap: %s\n", error.what());
    return 2;
  }
}
