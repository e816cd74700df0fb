// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// slicing_bench: what slicing the samples takes and nothing else: CPU time a voxel of contours and of materials, and
// whole jobs through a server. compare.py builds this file in older revisions, too, so it uses little of theirs.

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/bench/bars.h"
#include "tests/bench/median.h"
#include "tests/bench/our_method.h"
#include "tests/bench/printer_job.h"
#include "tests/bench/served_job.h"

namespace ccslice::bench {
namespace {

constexpr int kThreads = 2;  // Of the server.
constexpr std::uint32_t kSlabRuns = 3, kSlabsARun = 4;

struct Options {
  std::vector<std::string> parts = {"jobs", "materials"};
  std::vector<std::string> models = {"ring", "coyote", "engine", "bracket", "grid"};
  int runs = 1;
  std::string json;

  bool wants(const char* part) const { return std::find(parts.begin(), parts.end(), part) != parts.end(); }
};

/// Runs of consecutive slabs, as a job has them.
void measure_materials(const std::string& model, const Options& options, BarTable& table) {
  const PrinterJob job = sample_printer_job(model);
  std::vector<double> shape_ns, material_ns;
  for (int run = 0; run < options.runs; ++run) {
    OurMethod method(job);
    StageCost cost;
    for (const std::vector<std::uint32_t>& slabs : spread_slab_runs(job.job.grid, kSlabRuns, kSlabsARun)) {
      for (const std::uint32_t first : slabs) method.run_materials(method.shape_slab(first, cost), cost);
    }
    const auto voxels = static_cast<double>(cost.voxels);
    shape_ns.push_back((cost.contour_ns + cost.raster_ns) / voxels);
    material_ns.push_back(cost.material_ns / voxels);
  }
  table.note("contours and rasterization of " + model, median(shape_ns), "ns/voxel");
  table.note("materials of " + model, median(material_ns), "ns/voxel");
}

struct JobCost {
  double contone_seconds = 0, halftoned_seconds = 0;   // Wall time, from the call to the last layer.
  double server_cpu_seconds = 0, server_peak_mib = 0;  // Of contone jobs.
};

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

/// Each kind of job by a server of its own, whose end tells what it took.
JobCost run_jobs(const std::string& model, int runs) {
  const PrinterJob job = sample_printer_job(model);
  const LayerRange all{0, job.job.grid.extent.layers};
  const auto slice = [&](JobPictures pictures) {
    JobServer server(kThreads);
    server.run(job, {0, 1}, pictures);  // The upload, and the blue-noise mask.
    std::vector<double> wall;
    for (int run = 0; run < runs; ++run) wall.push_back(server.run(job, all, pictures).slice_seconds);
    return median(wall);
  };
  JobCost cost;
  cost.contone_seconds = slice(JobPictures::kContone);
  rusage usage{};
  getrusage(RUSAGE_CHILDREN, &usage);
  cost.server_cpu_seconds = seconds(usage.ru_utime) + seconds(usage.ru_stime);
  cost.server_peak_mib = static_cast<double>(usage.ru_maxrss) / 1024;
  cost.halftoned_seconds = slice(JobPictures::kIndexed);
  return cost;
}

/// In a process of its own, which has no other children than its servers. REQUIRES: this process has one thread.
JobCost run_apart(const std::function<JobCost()>& work) {
  int ends[2];
  if (pipe(ends) != 0) throw std::runtime_error("can't make a pipe");
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("can't start another process");
  JobCost cost;
  if (child == 0) {
    try {
      cost = work();
      _exit(write(ends[1], &cost, sizeof cost) == sizeof cost ? 0 : 1);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "slicing_bench: %s\n", error.what());
      _exit(1);
    }
  }
  close(ends[1]);
  const bool whole = read(ends[0], &cost, sizeof cost) == sizeof cost;
  close(ends[0]);
  waitpid(child, nullptr, 0);
  if (!whole) throw std::runtime_error("a job failed");
  return cost;
}

void measure_jobs(const std::string& model, const Options& options, BarTable& table) {
  const JobCost cost = run_apart([&] { return run_jobs(model, options.runs); });
  table.note("job of " + model, cost.contone_seconds, "s");
  table.note("job of " + model + ", halftoned", cost.halftoned_seconds, "s");
  table.note("job of " + model + ", its server from start to end", cost.server_cpu_seconds / options.runs, "s CPU");
  table.note("job of " + model + ", its server's peak memory", cost.server_peak_mib, "MiB");
}

void run(const Options& options) {
  BarTable table;
  // Jobs fork, so they come before threads that prepare.
  if (options.wants("jobs")) {
    for (const std::string& model : options.models) measure_jobs(model, options, table);
  }
  if (options.wants("materials")) {
    for (const std::string& model : options.models) measure_materials(model, options, table);
  }
  if (!options.json.empty()) table.write_json(options.json);
}

}  // namespace
}  // namespace ccslice::bench

int main(int argc, char** argv) {
  using namespace ccslice::bench;
  Options options;
  CLI::App app("What slicing the samples takes: CPU time a voxel, and whole jobs through a server of two threads");
  app.add_option("--parts", options.parts, "jobs, materials")
      ->delimiter(',')
      ->check(CLI::IsMember({"jobs", "materials"}))
      ->capture_default_str();
  app.add_option("--models", options.models, "Samples")->delimiter(',')->capture_default_str();
  app.add_option("--runs", options.runs, "Medians of so many")->check(CLI::Range(1, 99))->capture_default_str();
  app.add_option("--json", options.json, "Write the figures to this file, too");
  CLI11_PARSE(app, argc, argv);
  try {
    run(options);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "slicing_bench: %s\n", error.what());
    return 2;
  }
}
