// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// error_analysis: the quantified error analysis that [Luu19, 5] leaves as future work. Every voxel of some layers of
// the samples and of real meshes is inverted exactly, and compared with what interpolation says within each tolerance.
// Prints the mean, the 99.9 percentile and the maximum of
//
//   the position residual |geo(inverted parameter) - voxel's centre|, mm, and
//   the material error |interpolated - exact|, as a share of the channel's range, over all channels.
//
// Exit code 1 if any material error exceeds its tolerance.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <exception>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "core/models/models.h"
#include "tests/bench/error_statistics.h"
#include "tests/bench/gnuplot.h"
#include "tests/bench/our_method.h"
#include "tests/bench/printer_job.h"
#include "tests/oracle/real_meshes.h"

namespace ccslice::bench {
namespace {

struct Options {
  std::vector<std::string> models;
  std::vector<double> tolerances = {1.0 / 256, 1.0 / 1024, 1.0 / 16384, 1.0 / 65536};
  std::uint32_t slabs = 3, layers_a_slab = 3;
  double longest_mm = 40;
  unsigned threads = std::max(1u, std::thread::hardware_concurrency());
  std::string histogram;
  bool prove = false;
};

struct ToleranceResult {
  double tolerance = 0;
  ErrorStatistics error;
  std::uint64_t interpolated = 0, beyond = 0;
};

struct ModelResult {
  std::string name;
  std::string failure;  // If it couldn't be sliced.
  ErrorStatistics residual_mm;
  std::uint64_t unresolved = 0;  // Inside the contours, but without a parameter: not compared.
  std::vector<ToleranceResult> tolerances;
};

/// The exact values of one layer: channels of every voxel inside, in the order of the spans; NaN where unresolved.
std::vector<double> invert_layer(OurMethod& ours, const LayerShape& shape, std::size_t channels, ModelResult& result) {
  std::vector<double> exact(shape.voxels * channels, std::nan(""));
  std::vector<std::optional<CellParam>> below(ours.lattice().width);
  std::size_t next = 0;
  for (const VoxelRun& span : shape.spans) {
    std::optional<CellParam> hint;
    for (std::uint32_t x = span.begin; x < span.end; ++x, next += channels) {
      const auto found = ours.field().invert(ours.lattice().centre(x, span.row, shape.z_mm), hint ? hint : below[x]);
      hint = below[x] = found ? std::optional(found->at) : std::nullopt;
      if (!found) {
        ++result.unresolved;
        continue;
      }
      result.residual_mm.add(found->residual_mm);
      ours.field().mat(found->at, {exact.data() + next, channels});
    }
  }
  return exact;
}

void compare_layer(OurMethod& interpolating, const LayerShape& shape, const std::vector<double>& exact,
                   const std::vector<ChannelRange>& channels, ToleranceResult& result) {
  interpolating.take_stats();
  for (std::uint32_t c = 0; c < channels.size(); ++c) {
    const std::vector<float> values = interpolating.values(shape, c);
    const double range = std::max(channels[c].max - channels[c].min, 1e-30);
    std::size_t next = c;
    for (const VoxelRun& span : shape.spans) {
      for (std::uint32_t x = span.begin; x < span.end; ++x, next += channels.size()) {
        if (std::isnan(exact[next])) continue;
        const double value = values[std::size_t{span.row} * interpolating.lattice().width + x];
        const double error = std::abs(value - exact[next]) / range;
        result.error.add(error);
        result.beyond += error > result.tolerance;
      }
    }
  }
  result.interpolated += interpolating.take_stats().voxels_interpolated / channels.size();
}

std::vector<std::uint32_t> layers_of_slab(std::size_t slab_layers, std::uint32_t count) {
  return spread(static_cast<std::uint32_t>(slab_layers), count);
}

void analyse(const Options& options, ModelResult& result) {
  std::optional<ControlMesh> mesh = oracle::read_real_mesh(result.name);
  if (!mesh) throw std::runtime_error("there is neither a sample nor a file of that name");
  if (!find_sample_model(result.name)) oracle::scale_to(options.longest_mm, *mesh);
  PrinterJob job = make_printer_job(result.name, std::move(*mesh));
  job.job.prove_channels = options.prove;
  const std::vector<ChannelRange>& channels = job.solid->summary().channels;
  const auto channel_count = static_cast<std::uint32_t>(channels.size());
  OurMethod exact(job);
  std::vector<OurMethod> interpolating;
  for (const double tolerance : options.tolerances) {
    interpolating.emplace_back(job, tolerance, channel_count);
    result.tolerances.push_back({tolerance, {}, 0, 0});
  }
  StageCost cost;
  for (const std::uint32_t first : spread_slabs(job.job.grid, options.slabs)) {
    const std::vector<LayerShape> slab = exact.shape_slab(first, cost);
    for (OurMethod& method : interpolating) method.solve_materials(slab);
    for (const std::uint32_t k : layers_of_slab(slab.size(), options.layers_a_slab)) {
      const std::vector<double> values = invert_layer(exact, slab[k], channel_count, result);
      for (std::size_t t = 0; t < interpolating.size(); ++t) {
        compare_layer(interpolating[t], slab[k], values, channels, result.tolerances[t]);
      }
    }
  }
}

std::vector<ModelResult> analyse_all(const Options& options) {
  std::vector<ModelResult> results(options.models.size());
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    for (std::size_t i = next++; i < results.size(); i = next++) {
      results[i].name = options.models[i];
      try {
        analyse(options, results[i]);
      } catch (const std::exception& error) {
        results[i].failure = error.what();
      }
      std::fprintf(stderr, "%s: %llu voxels\n", results[i].name.c_str(),
                   static_cast<unsigned long long>(results[i].residual_mm.count()));
    }
  };
  std::vector<std::jthread> threads;
  for (unsigned i = 0; i < options.threads; ++i) threads.emplace_back(work);
  threads.clear();
  return results;
}

void print_model(const ModelResult& result) {
  if (!result.failure.empty()) {
    std::printf("%-22s failed: %s\n", result.name.c_str(), result.failure.c_str());
    return;
  }
  const ErrorStatistics& residual = result.residual_mm;
  const std::uint64_t voxels = residual.count();
  std::printf("%-22s %10s %10llu %10llu %9s %9.2e %9.2e %9.2e   %9s %9s %9s\n", result.name.c_str(), "inverted",
              static_cast<unsigned long long>(voxels), static_cast<unsigned long long>(result.unresolved), "",
              residual.mean(), residual.quantile(0.999), residual.largest(), "0", "0", "0");
  for (const ToleranceResult& t : result.tolerances) {
    std::printf("%-22s %10.2e %10llu %10s %8.2f%% %9s %9s %9s   %9.2e %9.2e %9.2e%s\n", "", t.tolerance,
                static_cast<unsigned long long>(voxels), "",
                100.0 * static_cast<double>(t.interpolated) / static_cast<double>(std::max<std::uint64_t>(voxels, 1)),
                "", "", "", t.error.mean(), t.error.quantile(0.999), t.error.largest(),
                t.beyond > 0 ? "  BEYOND THE TOLERANCE" : "");
  }
}

/// Of all models together: a curve a tolerance.
void plot_histogram(const Options& options, const std::vector<ModelResult>& results) {
  constexpr int kFirstDecade = -10, kDecades = 9, kBins = 8;
  std::string text =
      "set title 'Material error of all voxels compared, by tolerance'\nset xlabel 'share of the range of the "
      "channel'\n"
      "set ylabel 'share of voxels'\nset logscale xy\nset grid\nset key left top\nset format x '10^{%L}'\n$data << "
      "end\n";
  for (std::size_t t = 0; t < options.tolerances.size(); ++t) {
    ErrorStatistics all;
    for (const ModelResult& result : results) {
      if (t < result.tolerances.size()) all.add(result.tolerances[t].error);
    }
    const std::vector<std::uint64_t> bins = all.histogram(kFirstDecade, kDecades, kBins);
    text += "\"tolerance " + std::to_string(options.tolerances[t]) + "\"\n";
    for (std::size_t i = 0; i < bins.size(); ++i) {
      const double share = static_cast<double>(bins[i]) / static_cast<double>(std::max<std::uint64_t>(all.count(), 1));
      char line[96];
      std::snprintf(line, sizeof line, "%g %g\n", std::pow(10, kFirstDecade + (static_cast<double>(i) + 0.5) / kBins),
                    share);
      if (bins[i] > 0) text += line;
    }
    text += "\n\n";
  }
  plot_png(options.histogram, 1000, 600,
           text + "end\nplot for [i=0:" + std::to_string(options.tolerances.size() - 1) +
               "] $data index i using 1:2 with linespoints title columnheader(1)\n");
}

bool report(const Options& options, const std::vector<ModelResult>& results) {
  std::printf("%-22s %10s %10s %10s %9s %29s   %29s\n", "", "", "", "", "", "position residual, mm",
              "material error, share of range");
  std::printf("%-22s %10s %10s %10s %9s %9s %9s %9s   %9s %9s %9s\n", "model", "tolerance", "voxels", "unresolved",
              "interpol.", "mean", "99.9 %", "max", "mean", "99.9 %", "max");
  std::uint64_t voxels = 0, beyond = 0, failures = 0;
  for (const ModelResult& result : results) {
    print_model(result);
    voxels += result.residual_mm.count();
    failures += !result.failure.empty();
    for (const ToleranceResult& t : result.tolerances) beyond += t.beyond;
  }
  std::printf("%llu voxels inverted and compared within %zu tolerances; %llu values beyond their tolerance\n",
              static_cast<unsigned long long>(voxels), options.tolerances.size(),
              static_cast<unsigned long long>(beyond));
  if (!options.histogram.empty()) plot_histogram(options, results);
  return beyond == 0 && failures == 0;
}

std::vector<std::string> all_models() {
  std::vector<std::string> names = oracle::sample_names();
  for (const std::string& name : oracle::real_mesh_names()) {
    if (oracle::read_real_mesh_ungraded(name)) names.push_back(name);
  }
  return names;
}

}  // namespace
}  // namespace ccslice::bench

int main(int argc, char** argv) {
  using namespace ccslice::bench;
  CLI::App app("Compares every voxel of some layers with exact inversion, at the pitch of Luu et al. 2019");
  Options options;
  app.add_option(
      "models", options.models,
      "Samples, files of CCSLICE_SHARED_MESHES_DIR, or absolute paths of mesh files (default: all that there "
      "are). Files without channels are graded by x, y, z and the distance from the middle");
  app.add_option("--tolerances", options.tolerances, "Shares of a channel's range")->delimiter(',');
  app.add_option("--slabs", options.slabs, "Slabs of each model");
  app.add_option("--layers", options.layers_a_slab, "Layers of each slab");
  app.add_flag("--prove", options.prove, "Interpolate only where errors are proved, not where samples judge them");
  app.add_option("--longest-mm", options.longest_mm, "Meshes from files are scaled to this length");
  app.add_option("--threads", options.threads, "Models worked on at a time")->check(CLI::Range(1, 1024));
  app.add_option("--histogram", options.histogram, "Write a PNG of the errors' distribution");
  CLI11_PARSE(app, argc, argv);
  try {
    if (options.models.empty()) options.models = all_models();
    return report(options, analyse_all(options)) ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error_analysis: %s\n", error.what());
    return 2;
  }
}
