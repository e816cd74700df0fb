// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// scaling_bench: how costs grow with the mesh, with cells that a layer does not touch and with threads; preparing and
// memory by class of cell, peak memory of whole processes, the time to the first layer, and whole jobs in printers'
// pictures against contone ones, and strict tolerances against every voxel inverted. A table of figures, each beside
// its bar. Exit code 1 if one is missed.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "core/slicer/layer_slicer.h"
#include "core/subdivision/refined_mesh.h"
#include "tests/bench/bars.h"
#include "tests/bench/clocks.h"
#include "tests/bench/median.h"
#include "tests/bench/our_method.h"
#include "tests/bench/own_process.h"
#include "tests/bench/printer_job.h"
#include "tests/bench/served_job.h"
#include "tests/oracle/real_meshes.h"
#include "tests/support/slice_range.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::bench {
namespace {

constexpr int kMostRefinements = 3;  // 512 * 8^3 = 262,144 cells.
constexpr double kPrintedMm = 40;    // Meshes from files are scaled to this length.
constexpr int kThreads = 2;

struct Options {
  std::vector<std::string> parts;
  std::string octree = "bone_octree.vtk";
  std::string json;
  int runs = 3;
  std::uint32_t slabs = 4;
  // Of this program as a process of its own:
  std::string child, mesh;
  int refinements = 0;
};

/// Everything but encoding.
StageCost slice_slabs(const PrinterJob& job, const std::vector<std::uint32_t>& slabs) {
  OurMethod method(job);
  StageCost cost;
  for (const std::uint32_t first : slabs) method.run_materials(method.shape_slab(first, cost), cost);
  return cost;
}

double ns_per_voxel(const StageCost& cost) {
  return (cost.contour_ns + cost.raster_ns + cost.material_ns) / static_cast<double>(cost.voxels);
}

void measure_cells(const Options& options, BarTable& table) {
  std::vector<PrinterJob> jobs;
  for (int times = 0; times <= kMostRefinements; ++times) {
    jobs.push_back(make_printer_job("ring", refine_mesh(make_ring(), times)));
  }
  std::vector<std::vector<double>> ns(jobs.size());
  std::vector<double> ratios;
  for (int run = 0; run < options.runs; ++run) {
    double voxels = 0;
    for (std::size_t j = 0; j < jobs.size(); ++j) {
      const StageCost cost = slice_slabs(jobs[j], spread_slab_runs(jobs[j].job.grid, 1, options.slabs).front());
      const auto now = static_cast<double>(cost.voxels);  // Contours may differ by their tolerance.
      if (j > 0 && std::abs(now - voxels) > 1e-4 * voxels) throw std::runtime_error("refining changed the ring");
      voxels = now;
      ns[j].push_back(ns_per_voxel(cost));
    }
    ratios.push_back(ns.back().back() / ns.front().back());
  }
  for (std::size_t j = 0; j < jobs.size(); ++j) {
    const std::string cells = std::to_string(jobs[j].solid->cell_count()) + " cells";
    table.note("ring of " + cells + ": contours, raster, materials", median(ns[j]), "ns/voxel");
  }
  const PrinterJob& largest = jobs.back();
  const double count = largest.solid->cell_count();
  table.add("slicing, 262,144 cells against 512", median(ratios), "times", Bound::kAtMost, 1.5);
  table.add("preparing, per regular cell", 1e-3 * largest.prepare_ns / count, "us CPU", Bound::kAtMost, 5);
  table.add("memory, per regular cell", static_cast<double>(largest.solid->summary().memory_bytes) / 1024 / count,
            "KiB", Bound::kAtMost, 1.5);
  const PrinterJob grid = sample_printer_job("grid");
  table.add("preparing, per irregular cell (grid)", 1e-3 * grid.prepare_ns / grid.solid->cell_count(), "us CPU",
            Bound::kAtMost, 200);
}

/// `count` copies, each `distance_mm` above the last: separate parts.
ControlMesh stack_meshes(const ControlMesh& mesh, int count, double distance_mm) {
  ControlMesh stack = mesh;
  for (int copy = 1; copy < count; ++copy) oracle::append_mesh(stack, mesh, Vec3(0, 0, copy * distance_mm));
  return stack;
}

/// The same layers of one ring, alone and below 63 others.
void measure_untouched_cells(const Options& options, BarTable& table) {
  constexpr int kCopies = 64;
  const PrinterJob alone = make_printer_job("ring", make_ring());
  const std::vector<std::uint32_t> slabs = spread_slabs(alone.job.grid, options.slabs);
  const double distance_mm = alone.solid->summary().bounding_box.sizes().z() + 1;
  const PrinterJob stack = make_printer_job("rings", stack_meshes(make_ring(), kCopies, distance_mm));
  std::vector<double> ratios;
  for (int run = 0; run < options.runs; ++run) {
    const double alone_ns = ns_per_voxel(slice_slabs(alone, slabs));
    ratios.push_back(ns_per_voxel(slice_slabs(stack, slabs)) / alone_ns);
  }
  table.add("layers of a ring below 63 others, against alone", median(ratios), "times", Bound::kAtMost, 1.1);
}

double range_seconds(const PrinterJob& job, int threads, std::uint32_t layers) {
  const Stopwatch watch;
  slice_range(job.solid, job.job, 0, std::min(layers, job.job.grid.extent.layers), [](Layer&&) {}, {threads, {}});
  return watch.seconds();
}

void measure_threads(const Options& options, BarTable& table) {
  const PrinterJob job = sample_printer_job("ring");
  constexpr std::uint32_t kLayers = 16 * kSlabLayers;
  std::vector<double> ratios;
  for (int run = 0; run < options.runs; ++run) {
    const double one_s = range_seconds(job, 1, kLayers);
    ratios.push_back(one_s / range_seconds(job, kThreads, kLayers));
  }
  table.add("slicing the ring, two threads against one", median(ratios), "times", Bound::kAtLeast, 1.85);
}

void measure_first_layers(const Options& options, BarTable& table) {
  JobServer server(kThreads);
  for (const SampleModel& model : sample_models()) {
    const PrinterJob job = sample_printer_job(std::string(model.name));
    server.upload(job);
    std::vector<double> seconds, middle_seconds;
    for (int run = 0; run < options.runs; ++run) {
      seconds.push_back(server.first_layer_seconds(job, 0));
      middle_seconds.push_back(server.first_layer_seconds(job, job.job.grid.extent.layers / 2));
    }
    table.add("first layer of a cached " + job.name, 1e3 * median(seconds), "ms", Bound::kAtMost, 50);
    table.add("first layer of a cached " + job.name + ", from its middle on", 1e3 * median(middle_seconds), "ms",
              Bound::kAtMost, 50);
  }
}

/// Whole jobs over loopback, in turns: printers' pictures against contone samples.
void measure_printed_jobs(const Options& options, BarTable& table) {
  JobServer server(kThreads);
  for (const SampleModel& model : sample_models()) {
    const PrinterJob job = sample_printer_job(std::string(model.name));
    const LayerRange all{0, job.job.grid.extent.layers};
    server.run(job, {0, 1}, JobPictures::kIndexed);  // The upload, and the blue-noise mask.
    std::vector<double> contone, indexed, rgba;
    for (int run = 0; run < options.runs; ++run) {
      contone.push_back(server.run(job, all).slice_seconds);
      indexed.push_back(server.run(job, all, JobPictures::kIndexed).slice_seconds / contone.back());
      rgba.push_back(server.run(job, all, JobPictures::kRgba).slice_seconds / contone.back());
    }
    table.note(job.name + ", contone raw + zstd", median(contone), "s");
    table.add(job.name + ", halftoned, indexed PNG of 2 bits, against contone", median(indexed), "times",
              Bound::kAtMost, 1.5);
    table.add(job.name + ", halftoned, RGBA PNG, against contone", median(rgba), "times", Bound::kAtMost, 3);
  }
}

/// The mesh with rough values at its vertices, as finite elements may have them: four channels of floats.
PrinterJob rough_job(const std::string& name, ControlMesh mesh) {
  constexpr std::size_t kChannels = 4;
  std::mt19937 random(1);
  std::uniform_real_distribution<float> value(0, 1);
  mesh.channel_names.clear();
  mesh.channel_values.clear();
  for (std::size_t c = 0; c < kChannels; ++c) mesh.channel_names.push_back("rough" + std::to_string(c));
  for (std::size_t v = 0; v < kChannels * mesh.vertex_count(); ++v) mesh.channel_values.push_back(value(random));
  PrinterJob result = make_printer_job(name, std::move(mesh));
  SliceJob& job = result.job;
  job.planes.clear();
  for (std::uint32_t c = 0; c < kChannels; ++c) {
    PlaneSpec& plane = job.planes.emplace_back();
    plane.content = PlaneContent::kChannel;
    plane.channel = "rough" + std::to_string(c);
    plane.sample_type = SampleType::kFloat32;
    plane.encoding = Encoding::kRaw;
  }
  return result;
}

double slicing_ns(const PrinterJob& job, double tolerance, std::uint32_t layers) {
  SliceJob with_tolerance = job.job;
  with_tolerance.channel_tolerance = tolerance;
  const std::uint32_t all = job.job.grid.extent.layers, count = std::min(layers, all), first = (all - count) / 2;
  double ns = 0;
  timed(ns, [&] {
    LayerSlicer slicer(job.solid, with_tolerance);
    for (std::uint32_t layer = first; layer < first + count; ++layer) slicer.slice(layer, {});
  });
  return ns;
}

/// Tolerances from a coarse one to one that nothing keeps, in turns with every voxel inverted.
void measure_strictness(const Options& options, BarTable& table) {
  constexpr std::uint32_t kLayers = 4 * kSlabLayers;
  for (const char* name : {"mountwithhole.vtk", "fertility_cmu.vtk"}) {
    std::optional<ControlMesh> mesh = oracle::read_real_mesh(name);
    if (!mesh) {
      std::printf("%s isn't there: not measured\n", name);
      continue;
    }
    oracle::scale_to(kPrintedMm, *mesh);
    const PrinterJob job = rough_job(name, std::move(*mesh));
    for (const double tolerance : {1e-2, 1.0 / 1024, 1e-4, 1.0 / 65536, 1e-5, 3e-6, 1e-6, 1e-7}) {
      std::vector<double> ratios;
      for (int run = 0; run < options.runs; ++run) {
        const double exact_ns = slicing_ns(job, 0, kLayers);
        ratios.push_back(slicing_ns(job, tolerance, kLayers) / exact_ns);
      }
      char what[160];
      std::snprintf(what, sizeof what, "%s, rough values within %.2g, against tolerance 0", name, tolerance);
      table.add(what, median(ratios), "times", Bound::kAtMost, 1.1);
    }
  }
}

ProcessCost run_child(const std::string& what, const std::string& mesh, int refinements) {
  return run_own_process({"--child", what, "--mesh", mesh, "--refinements", std::to_string(refinements)});
}

void measure_processes(const Options& options, BarTable& table) {
  const ProcessCost base = run_child("make", "ring", kMostRefinements);
  const ProcessCost prepare = run_child("prepare", "ring", kMostRefinements);
  table.note("peak memory before preparing 262,144 cells: their control mesh", base.peak_mib, "MiB");
  table.add("preparing 262,144 cells", prepare.wall_seconds - base.wall_seconds, "s", Bound::kAtMost, 3);
  table.note("preparing 262,144 cells, CPU", prepare.cpu_seconds - base.cpu_seconds, "s");
  table.add("slicing 262,144 cells, peak memory", run_child("slice", "ring", kMostRefinements).peak_mib, "MiB",
            Bound::kAtMost, 1024);
  if (!oracle::read_real_mesh_ungraded(options.octree)) {
    std::printf("%s isn't there: not measured\n", options.octree.c_str());
    return;
  }
  const ProcessCost octree = run_child("prepare", options.octree, 0);
  table.add(options.octree + ", prepared, peak memory", octree.peak_mib, "MiB", Bound::kAtMost, 256);
  table.note(options.octree + ", prepared, CPU", octree.cpu_seconds, "s");
  table.add(options.octree + ", sliced, peak memory", run_child("slice", options.octree, 0).peak_mib, "MiB",
            Bound::kAtMost, 1024);
}

/// In a process of its own: makes the mesh, prepares it, slices some slabs of it on all threads.
void run_as_child(const Options& options) {
  std::optional<ControlMesh> mesh = oracle::read_real_mesh(options.mesh);
  if (!mesh) throw std::runtime_error(options.mesh + " isn't there");
  ControlMesh refined = refine_mesh(*mesh, options.refinements);
  mesh.reset();
  if (!find_sample_model(options.mesh)) oracle::scale_to(kPrintedMm, refined);
  if (options.child == "make") return;
  if (options.child == "prepare") {
    (void)prepare_solid(std::move(refined));
    return;
  }
  const PrinterJob job = make_printer_job(options.mesh, std::move(refined));
  const std::uint32_t layers = job.job.grid.extent.layers, count = std::min(layers, 2 * kThreads * kSlabLayers);
  slice_range(job.solid, job.job, (layers - count) / 2, count, [](Layer&&) {}, {kThreads, {}});
}

int run(const Options& options) {
  const auto wanted = [&](const char* part) {
    return options.parts.empty() || std::find(options.parts.begin(), options.parts.end(), part) != options.parts.end();
  };
  BarTable table;
  if (wanted("memory")) measure_processes(options, table);
  if (wanted("cells")) measure_cells(options, table);
  if (wanted("untouched")) measure_untouched_cells(options, table);
  if (wanted("threads")) measure_threads(options, table);
  if (wanted("latency")) measure_first_layers(options, table);
  if (wanted("printing")) measure_printed_jobs(options, table);
  if (wanted("strictness")) measure_strictness(options, table);
  if (!options.json.empty()) table.write_json(options.json);
  std::printf("%d bars missed\n", table.missed());
  return table.missed() > 0 ? 1 : 0;
}

}  // namespace
}  // namespace ccslice::bench

int main(int argc, char** argv) {
  using namespace ccslice::bench;
  CLI::App app("How costs grow with cells and threads, memory, and the time to the first layer");
  Options options;
  app.add_option("--parts", options.parts,
                 "Some of memory, cells, untouched, threads, latency, printing, strictness (default: all)")
      ->delimiter(',');
  app.add_option("--octree", options.octree,
                 "A large irregular mesh: in CCSLICE_SHARED_MESHES_DIR, or an absolute path");
  app.add_option("--json", options.json, "Write the figures to this file, too");
  app.add_option("--runs", options.runs, "Medians of so many")->check(CLI::Range(1, 99));
  app.add_option("--slabs", options.slabs,
                 "Of each mesh: consecutive ones, as jobs have them, where cells are counted, spread ones elsewhere");
  app.add_option("--child", options.child)->group("");
  app.add_option("--mesh", options.mesh)->group("");
  app.add_option("--refinements", options.refinements)->group("");
  CLI11_PARSE(app, argc, argv);
  try {
    if (options.child.empty()) return run(options);
    run_as_child(options);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "scaling_bench: %s\n", error.what());
    return 2;
  }
}
