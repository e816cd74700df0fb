// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// prepare_bench: what preparing a mesh takes, for the samples and for files: CPU time and memory a cell, and two
// threads against one, in turns. A table of figures, each beside its bar. Exit code 1 if one is missed.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/base/read_file.h"
#include "core/limit/limit_solid.h"
#include "core/mesh/cell_kind.h"
#include "core/mesh_files/read_mesh.h"
#include "core/mesh_import/mesh_file.h"
#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "tests/bench/bars.h"
#include "tests/bench/clocks.h"
#include "tests/bench/median.h"

namespace ccslice::bench {
namespace {

constexpr double kLeastSeconds = 0.3;  // A run takes that long: small meshes are prepared again and again.
constexpr double kMostTetrahedronUs = 150, kMostTetrahedronKb = 10;
constexpr std::uint64_t kMostFileBytes = std::uint64_t{4} << 30;
constexpr double kLeastSpeedUp = 1.8;  // Two threads are so many times as fast as one.

struct Options {
  std::vector<std::string> models = {"ring", "coyote", "engine", "bracket", "grid"};
  std::vector<std::string> files;
  int runs = 5;
  std::string json;
};

struct Subject {
  std::string name;
  ControlMesh mesh;
};

/// What one preparation takes, on average over as many as fill a run.
struct Cost {
  double wall_seconds = 0, cpu_us = 0;
};

Cost prepare(const ControlMesh& mesh, int threads, int times) {
  PrepareOptions options;
  options.threads = threads;
  double cpu_ns = 0;
  const Stopwatch watch;
  timed(cpu_ns, [&] {
    for (int i = 0; i < times; ++i) (void)prepare_solid(mesh, options);
  });
  return {watch.seconds() / times, 1e-3 * cpu_ns / times};
}

bool is_tetrahedral(const ControlMesh& mesh) {
  const auto count = std::count(mesh.cell_kinds.begin(), mesh.cell_kinds.end(), CellKind::kTet);
  return 2 * static_cast<std::size_t>(count) > mesh.cell_count();
}

void add_figures(const Subject& subject, int runs, BarTable& table) {
  const auto cells = static_cast<double>(subject.mesh.cell_count());
  const Stopwatch first;
  const double kb = 1e-3 * static_cast<double>(prepare_solid(subject.mesh)->summary().memory_bytes) / cells;
  const int times = std::max(1, static_cast<int>(kLeastSeconds / first.seconds()));
  std::vector<double> one, two, cpu;
  for (int run = 0; run < runs; ++run) {
    const Cost alone = prepare(subject.mesh, 1, times);
    one.push_back(alone.wall_seconds);
    cpu.push_back(alone.cpu_us / cells);
    two.push_back(prepare(subject.mesh, 2, times).wall_seconds);
  }
  const std::string& name = subject.name;
  if (is_tetrahedral(subject.mesh)) {
    table.add(name + ": time of one core a cell", median(cpu), "us", Bound::kAtMost, kMostTetrahedronUs);
    table.add(name + ": memory a cell", kb, "kB", Bound::kAtMost, kMostTetrahedronKb);
    table.note(name + ": two threads against one", median(one) / median(two), "times");
  } else {
    table.note(name + ": time of one core a cell", median(cpu), "us");
    table.note(name + ": memory a cell", kb, "kB");
    table.add(name + ": two threads against one", median(one) / median(two), "times", Bound::kAtLeast, kLeastSpeedUp);
  }
}

Subject sample(const std::string& name) {
  const SampleModel* model = find_sample_model(name);
  if (model == nullptr) throw std::runtime_error("there is no sample " + name);
  return {name, model->make()};
}

Subject file(const std::string& path) {
  const std::string bytes = read_file_bytes(path, kMostFileBytes);
  return {std::filesystem::path(path).filename(), read_mesh(bytes, {}, {path}).mesh};
}

int run(const Options& options) {
  BarTable table;
  for (const std::string& name : options.models) add_figures(sample(name), options.runs, table);
  for (const std::string& path : options.files) add_figures(file(path), options.runs, table);
  if (!options.json.empty()) table.write_json(options.json);
  return table.missed() > 0 ? 1 : 0;
}

}  // namespace
}  // namespace ccslice::bench

int main(int argc, char** argv) {
  ccslice::bench::Options options;
  CLI::App app("Prints what preparing meshes takes: time and memory a cell, and two threads against one");
  app.add_option("files", options.files, "Mesh files, besides the samples")->check(CLI::ExistingFile);
  app.add_option("--models", options.models, "Samples, or none")
      ->delimiter(',')
      ->allow_extra_args(false)  // Files may follow.
      ->capture_default_str();
  app.add_option("--runs", options.runs, "Medians of so many")->check(CLI::Range(1, 99))->capture_default_str();
  app.add_option("--json", options.json, "Write the figures to this file");
  CLI11_PARSE(app, argc, argv);
  if (options.models == std::vector<std::string>{"none"}) options.models.clear();
  try {
    return ccslice::bench::run(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "prepare_bench: %s\n", error.what());
    return 2;
  }
}
