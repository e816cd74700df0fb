// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// paper_tables: the evaluation of [Luu19, 4] anew. Slices the five samples at the paper's pitch, by our method and by
// the paper's own, literally, on the same layers in the same process, and prints the paper's Tables 1 to 3 with both
// beside the paper's figures. Stages are timed in CPU time of one thread, jobs in wall time from client to server.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/bench/clocks.h"
#include "tests/bench/paper_figures.h"
#include "tests/bench/paper_report.h"

namespace ccslice::bench {
namespace {

struct Options {
  bool quick = false;
  int threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  std::vector<std::string> models;
  std::string json, plot;
};

bool is_wanted(const Options& options, std::string_view name) {
  return options.models.empty() ||
         std::find(options.models.begin(), options.models.end(), name) != options.models.end();
}

PaperReport measure(const Options& options) {
  const Sampling& sampling = options.quick ? kQuickSampling : kFullSampling;
  PaperReport report;
  report.threads = options.threads;
  JobServer server(options.threads);
  for (const PaperModel& paper : kPaperModels) {
    if (!is_wanted(options, paper.name)) continue;
    const Stopwatch watch;
    const PrinterJob job = sample_printer_job(std::string(paper.name));
    if (paper.name == "coyote") report.slice = run_slice(job, kPaperSliceVoxels, sampling);
    report.models.push_back(run_model(job, sampling, server, options.threads));
    std::fprintf(stderr, "%s: %.1f s\n", job.name.c_str(), watch.seconds());
  }
  return report;
}

void write_file(const std::string& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  if (!(file << text).flush()) throw std::runtime_error("can't write " + path);
}

void run(const Options& options) {
  const PaperReport report = measure(options);
  print_table_1(report);
  print_table_2(report);
  print_table_3(report);
  print_stages(report);
  print_samples(report);
  print_bars(report);
  print_sum(report);
  if (!options.json.empty()) write_file(options.json, to_json(report));
  if (!options.plot.empty()) plot(report, options.plot);
}

}  // namespace
}  // namespace ccslice::bench

int main(int argc, char** argv) {
  using namespace ccslice::bench;
  CLI::App app(
      "The evaluation of Luu et al. 2019, Tables 1 to 3: the paper's figures, its literal method here, and ours");
  Options options;
  app.add_flag("--quick", options.quick, "Fewer layers and rows, jobs of some layers only: under two minutes");
  app.add_option("--threads", options.threads, "Of the server in whole jobs (default: all CPUs)")
      ->check(CLI::Range(1, 1024));
  app.add_option("--models", options.models, "Some of ring, coyote, engine, bracket, grid (default: all)")
      ->delimiter(',');
  app.add_option("--json", options.json, "Write all figures to this file");
  app.add_option("--plot", options.plot, "Write a PNG of the times per voxel by model and stage");
  CLI11_PARSE(app, argc, argv);
  try {
    run(options);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "paper_tables: %s\n", error.what());
    return 1;
  }
}
