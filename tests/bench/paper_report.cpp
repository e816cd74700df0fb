// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/bench/paper_report.h"

#include <algorithm>
#include <cstdio>

#include "client/cli/base/json.h"
#include "tests/bench/bars.h"
#include "tests/bench/gnuplot.h"
#include "tests/bench/paper_figures.h"

namespace ccslice::bench {
namespace {

const PaperModel& paper_model(const ModelRun& run) {
  return *std::find_if(kPaperModels.begin(), kPaperModels.end(),
                       [&](const PaperModel& m) { return m.name == run.name; });
}

double per_voxel(double ns, std::uint64_t voxels) {
  return ns / static_cast<double>(std::max<std::uint64_t>(voxels, 1));
}

double percent(std::uint64_t part, std::uint64_t whole) { return 100 * per_voxel(static_cast<double>(part), whole); }

void print_slice_row(const char* step, double paper_off, double paper_on, double off, double on, double ours) {
  std::printf("%-22s %12.3f %12.3f   %14.3f %14.3f %12.5f\n", step, paper_off, paper_on, off, on, ours);
}

}  // namespace

void print_table_1(const PaperReport& report) {
  if (!report.slice) return;
  const SliceRun& run = *report.slice;
  const double scale = 1e-9 * static_cast<double>(run.voxels);
  const auto winding_s = [&](const LiteralCost& c) { return scale * per_voxel(c.winding_ns, c.voxels); };
  const auto material_s = [&](const LiteralCost& c) { return scale * per_voxel(c.material_ns, c.voxels); };
  const LiteralCost &off = run.without_coherence, &on = run.with_coherence;
  const double contour_s = 1e-9 * run.contour_ns, raster_s = 1e-9 * run.raster_ns,
               own_material_s = 1e-9 * run.material_ns;
  std::printf(
      "Table 1. One slice of the coyote, seconds, one thread: the paper's has %llu voxels, ours (layer %u) %llu.\n",
      static_cast<unsigned long long>(kPaperSliceVoxels), run.layer, static_cast<unsigned long long>(run.voxels));
  std::printf("%-22s %25s   %29s %12s\n", "", "paper", "literal, here (extrapolated)", "");
  std::printf("%-22s %12s %12s   %14s %14s %12s\n", "coherence", "none", "utilized", "none", "utilized", "ours");
  std::printf("%-22s %12.4f %12.4f   %14.4f %14.4f %12s\n", "whole PI [%]", 100 * kPaperWithoutCoherence.full_share,
              100 * kPaperWithCoherence.full_share, percent(off.full, off.voxels), percent(on.full, on.voxels), "-");
  const PaperSlice &a = kPaperWithoutCoherence, &b = kPaperWithCoherence;
  print_slice_row("contour slicing", a.contour_s, b.contour_s, contour_s, contour_s, contour_s);
  print_slice_row("rasterization", a.raster_s, b.raster_s, winding_s(off), winding_s(on), raster_s);
  print_slice_row("material evaluation", a.material_s, b.material_s, material_s(off), material_s(on), own_material_s);
  print_slice_row("total", a.contour_s + a.raster_s + a.material_s, b.contour_s + b.raster_s + b.material_s,
                  contour_s + winding_s(off) + material_s(off), contour_s + winding_s(on) + material_s(on),
                  contour_s + raster_s + own_material_s);
  std::printf(
      "Literal: %llu and %llu whole rows of the slice; the same contours. Ours: the slice's share of its slab.\n\n",
      static_cast<unsigned long long>(off.rows), static_cast<unsigned long long>(on.rows));
}

void print_table_2(const PaperReport& report) {
  std::printf(
      "Table 2. The models (p: the paper's figures, four threads of 4.2 GHz; l: literal method, here; o: ours, "
      "client to server; both %d threads)\n",
      report.threads);
  std::printf("%-8s %s %8s %6s %6s %11s %7s %8s %12s %12s %12s %9s\n", "model", " ", "cells", "EE", "EV", "bitmap",
              "slices", "Mvoxel", "total", "voxel/slice", "ms/slice", "whole PI%");
  for (const ModelRun& run : report.models) {
    const PaperModel& paper = paper_model(run);
    const double layers = run.grid.layers;
    std::printf("%-8s p %8d %6d %6d %5dx%-5d %7d %8.2f %10.2f h %12llu %12.3f %9.4f\n", run.name.c_str(), paper.cells,
                paper.extraordinary_edges, paper.extraordinary_vertices, paper.columns, paper.rows, paper.layers,
                paper.million_voxels, paper.total_hours, static_cast<unsigned long long>(paper.voxels_a_layer),
                1e3 * paper.seconds_a_layer, 100 * paper.full_share);
    const double literal_s = run.literal_job_seconds(report.threads);
    std::printf("%-8s l %8s %6s %6s %11s %7s %8s %10.1f s %12s %12.3f %9.4f\n", "", "", "", "", "", "", "", literal_s,
                "", 1e3 * literal_s / layers, percent(run.literal.full, run.literal.voxels));
    std::printf("%-8s o %8zu %6zu %6zu %5ux%-5u %7u %8.2f %10.2f s %12.0f %12.3f %9s\n", "", run.solid.limit_cells,
                run.solid.extraordinary_edges, run.solid.extraordinary_vertices, run.grid.columns, run.grid.rows,
                run.grid.layers, 1e-6 * run.voxels(), run.job_seconds(), run.voxels() / layers,
                1e3 * run.job_seconds() / layers, "-");
  }
  std::printf(
      "Cells: after refinement; ours refines only the cells that need it. EE and EV: the paper's after "
      "refinement, ours in the control mesh.\n\n");
}

void print_table_3(const PaperReport& report) {
  std::printf("Table 3. Time per slice against voxels per slice, seconds\n");
  std::printf("%-20s %8s %12s %10s %10s %10s\n", "model", "cells", "voxel/slice", "paper", "literal", "ours");
  for (const ModelRun& run : report.models) {
    const PaperModel& paper = paper_model(run);
    const double layers = run.grid.layers;
    std::printf("%-20s %8zu %12.0f %10.2f %10.3f %10.5f\n", run.name.c_str(), run.solid.limit_cells,
                run.voxels() / layers, paper.seconds_a_layer, run.literal_job_seconds(report.threads) / layers,
                run.job_seconds() / layers);
  }
  for (const PaperPeer& peer : kPaperPeers) {
    std::printf("%-20s %8d %12llu %10.2f %10s %10s\n", std::string(peer.name).c_str(), peer.cells,
                static_cast<unsigned long long>(peer.voxels_a_layer), peer.seconds_a_layer, "-", "-");
  }
  std::printf("\n");
}

void print_stages(const PaperReport& report) {
  std::printf("Stages. CPU time of one thread, ns per voxel inside\n");
  std::printf("%-8s %8s %8s %10s %8s %9s %9s %10s %8s %12s %12s\n", "model", "contour", "+raster", "lit.raster",
              "ratio", "material", "exact", "lit.mater.", "ratio", "lit. failed%", "max error");
  for (const ModelRun& run : report.models) {
    std::printf("%-8s %8.3f %8.3f %10.0f %8.0f %9.3f %9.1f %10.0f %8.1f %12.4f %12.2e\n", run.name.c_str(),
                run.contour_ns_per_voxel(), run.raster_ns_per_voxel(), run.literal_raster_ns_per_voxel(),
                run.literal_raster_ns_per_voxel() / run.raster_ns_per_voxel(), run.material_ns_per_voxel(),
                run.exact_material_ns_per_voxel(), run.literal_material_ns_per_voxel(),
                run.literal_material_ns_per_voxel() / run.material_ns_per_voxel(),
                percent(run.literal.not_found, run.literal.voxels), run.max_material_error);
  }
  std::printf(
      "Exact: ours with tolerance 0, every voxel inverted. Max error: of interpolated values against exact\n"
      "inversion, as a share of the channel's range (tolerance %.2e).\n\n",
      kDefaultTolerance);
}

void print_samples(const PaperReport& report) {
  std::printf("Sampled. All other figures are extrapolated by voxels from these\n");
  std::printf("%-8s %16s %16s %14s %14s %16s %12s %12s\n", "model", "shaped layers", "material layers", "literal rows",
              "rows, no coh.", "compared voxels", "job layers", "differing");
  for (const ModelRun& run : report.models) {
    const auto of_all = [&](std::uint64_t layers) {
      return std::to_string(layers) + " of " + std::to_string(run.grid.layers);
    };
    std::printf("%-8s %16s %16s %14llu %14llu %16llu %12s %12llu\n", run.name.c_str(), of_all(run.shape.layers).c_str(),
                of_all(run.material.layers).c_str(), static_cast<unsigned long long>(run.literal.rows),
                static_cast<unsigned long long>(run.literal_off.rows), static_cast<unsigned long long>(run.compared),
                of_all(run.job.layers).c_str(), static_cast<unsigned long long>(run.literal.disagreeing));
  }
  std::printf("Differing: voxels of the literal rows whose occupancy isn't ours.\n\n");
}

void print_sum(const PaperReport& report) {
  double ours = 0, literal = 0, paper = 0;
  std::printf(
      "Jobs, %d threads: upload, preparation and all layers as occupancy + 8-bit channel, raw + zstd, received, "
      "decoded and checked\n",
      report.threads);
  std::printf("%-8s %12s %12s %10s %14s\n", "model", "ours s", "literal s", "ratio", "MB received");
  for (const ModelRun& run : report.models) {
    const double literal_s = run.literal_job_seconds(report.threads);
    const double share = static_cast<double>(run.job.voxels) / run.voxels();
    std::printf("%-8s %12.3f %12.1f %10.1f %14.1f\n", run.name.c_str(), run.job_seconds(), literal_s,
                literal_s / run.job_seconds(), 1e-6 * static_cast<double>(run.job.encoded_bytes) / share);
    ours += run.job_seconds();
    literal += literal_s;
    paper += 3600 * paper_model(run).total_hours;
  }
  std::printf("%-8s %12.3f %12.1f %10.1f   paper: %.0f s on %d cores, %.0f times ours on %d threads\n", "sum", ours,
              literal, literal / ours, paper, kPaperThreads, paper / ours, report.threads);
  std::printf("Literal: perfectly parallel, our contours, nothing encoded or sent.\n");
}

void print_bars(const PaperReport& report) {
  BarTable table;
  double ours = 0, literal = 0;
  for (const ModelRun& run : report.models) {
    const bool ring = run.name == "ring", grid = run.name == "grid";
    const auto add = [&](const char* figure, double value, const char* unit, Bound bound, double bar) {
      table.add(run.name + ": " + figure, value, unit, bound, bar);
    };
    const double raster_ns = run.raster_ns_per_voxel(), material_ns = run.material_ns_per_voxel();
    const double literal_s = run.literal_job_seconds(report.threads);
    add("contours and raster", raster_ns, "ns/voxel", Bound::kAtMost, grid ? 10 : 3);
    add("literal winding number", run.literal_raster_ns_per_voxel() / raster_ns, "times", Bound::kAtLeast, 300);
    add("materials", material_ns, "ns/voxel", Bound::kAtMost, ring ? 5 : grid ? 30 : 15);
    add("literal Algorithm 1", run.literal_material_ns_per_voxel() / material_ns, "times", Bound::kAtLeast,
        ring ? 200 : 80);
    add("largest material error", run.max_material_error, "of range", Bound::kAtMost, kDefaultTolerance);
    if (ring) {
      add("materials, tolerance 0", run.exact_material_ns_per_voxel(), "ns/voxel", Bound::kAtMost, 60);
      add("literal Algorithm 1 itself", run.literal_material_ns_per_voxel(), "ns/voxel", Bound::kAtMost, 2000);
      add("literal job", literal_s / run.job_seconds(), "times", Bound::kAtLeast, 200);
    }
    ours += run.job_seconds();
    literal += literal_s;
  }
  if (report.models.size() == kPaperModels.size())
    table.add("all: literal jobs", literal / ours, "times", Bound::kAtLeast, 500);
  std::printf("%d bars missed\n\n", table.missed());
}

std::string to_json(const PaperReport& report) {
  cli::JsonWriter json;
  json.begin_object().member("threads", report.threads).key("models").begin_object();
  for (const ModelRun& run : report.models) {
    json.key(run.name).begin_object();
    json.member("voxels", static_cast<std::uint64_t>(run.voxels())).member("layers", run.grid.layers);
    json.member("material_ns_per_voxel", run.material_ns_per_voxel());
    json.member("literal_material_ns_per_voxel", run.literal_material_ns_per_voxel());
    json.member("raster_ns_per_voxel", run.raster_ns_per_voxel());
    json.member("literal_raster_ns_per_voxel", run.literal_raster_ns_per_voxel());
    json.member("job_seconds", run.job_seconds());
    json.member("literal_job_seconds", run.literal_job_seconds(report.threads));
    json.member("max_material_error", run.max_material_error);
    json.member("exact_material_ns_per_voxel", run.exact_material_ns_per_voxel());
    json.member("contour_ns_per_voxel", run.contour_ns_per_voxel());
    json.member("literal_incoherent_material_ns_per_voxel",
                per_voxel(run.literal_off.material_ns, run.literal_off.voxels));
    json.member("prepare_seconds", 1e-9 * run.prepare_ns);
    json.member("sampled_job_layers", run.job.layers).member("sampled_material_layers", run.material.layers);
    json.member("sampled_literal_rows", run.literal.rows).member("compared_voxels", run.compared).end_object();
  }
  return json.end_object().end_object().text() + "\n";
}

void plot(const PaperReport& report, const std::string& path) {
  std::string text =
      "set title 'Time per voxel inside, one thread'\nset ylabel 'ns'\nset logscale y\nset yrange [0.1:*]\n"
      "set style data histograms\nset style histogram clustered gap 1.5\nset style fill solid 0.9 border -1\n"
      "set key outside bottom center horizontal\nset grid ytics\n$data << end\n";
  for (const ModelRun& run : report.models) {
    const PaperModel& paper = paper_model(run);
    char line[256];
    std::snprintf(line, sizeof line, "%s %g %g %g %g %g\n", run.name.c_str(), run.literal_raster_ns_per_voxel(),
                  run.literal_material_ns_per_voxel(), run.raster_ns_per_voxel(), run.material_ns_per_voxel(),
                  3600e9 * paper.total_hours * kPaperThreads / (1e6 * paper.million_voxels));
    text += line;
  }
  plot_png(
      path, 1100, 600,
      text +
          "end\narray names[5] = ['rasterization, literal', 'materials, literal', 'contours + rasterization, ours', "
          "'materials, ours', 'whole, paper (four threads added up)']\n"
          "plot for [i=1:5] $data using i+1:xtic(1) title names[i]\n");
}

}  // namespace ccslice::bench
