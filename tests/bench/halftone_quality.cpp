// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// How good halftones are, and what they cost: a table of figures beside their bars, and a plot of power spectra over
// physical frequency (tests/support/power_spectrum.h).

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <string>
#include <vector>

#include "tests/bench/bars.h"
#include "tests/bench/clocks.h"
#include "tests/bench/gnuplot.h"
#include "tests/support/halftone_block.h"

namespace ccslice::bench {
namespace {

constexpr std::array<std::size_t, 3> kBlock = {128, 128, 128};
constexpr std::array<HalftoneMethod, 3> kMethods = {HalftoneMethod::kBlueNoise, HalftoneMethod::kErrorDiffusion,
                                                    HalftoneMethod::kWhiteNoise};
constexpr double kShell = 0.5;  // cycles/mm.

struct Options {
  std::array<double, 3> pitch_mm = {25.4 / 600, 25.4 / 300, 0.027};
  std::string plot;
  std::uint64_t seed = 0;
};

const char* name_of(HalftoneMethod method) {
  switch (method) {
    case HalftoneMethod::kBlueNoise: return "blue noise";
    case HalftoneMethod::kErrorDiffusion: return "error diffusion";
    case HalftoneMethod::kLargestFraction: return "largest fraction";
    case HalftoneMethod::kWhiteNoise: return "white noise";
  }
  return "";
}

std::string name_of(const std::vector<float>& fractions) {
  std::string name;
  char text[16];
  for (const float fraction : fractions) {
    std::snprintf(text, sizeof text, "%s%g", name.empty() ? "" : "/", static_cast<double>(fraction));
    name += text;
  }
  return name;
}

HalftonePlan plan_of(const Options& options, const Printing& printing) {
  return HalftonePlan(printing, options.pitch_mm[0], options.pitch_mm[1], options.pitch_mm[2]);
}

HalftonedBlock constant_block(const Options& options, HalftoneMethod method, const std::vector<float>& fractions) {
  return halftone_block(plan_of(options, shares_of(fractions.size(), method, options.seed)), options.pitch_mm, kBlock,
                        [&](auto...) { return fractions; });
}

/// Sums over all boxes from the first voxel on: entry (x, y, z) of a grid one larger each way.
class SummedVolume {
 public:
  SummedVolume(const HalftonedBlock& block, std::uint8_t material)
      : size_({block.size[0] + 1, block.size[1] + 1, block.size[2] + 1}), sums_(size_[0] * size_[1] * size_[2]) {
    for (std::size_t z = 1; z < size_[2]; ++z) {
      for (std::size_t y = 1; y < size_[1]; ++y) {
        std::int64_t row = 0;
        for (std::size_t x = 1; x < size_[0]; ++x) {
          row += block.at(x - 1, y - 1, z - 1) == material;
          sums_[index(x, y, z)] = row + at(x, y - 1, z) + at(x, y, z - 1) - at(x, y - 1, z - 1);
        }
      }
    }
  }
  /// Voxels of the box from `low` on.
  std::int64_t count(const std::array<std::size_t, 3>& low, const std::array<std::size_t, 3>& edges) const {
    const auto [x, y, z] = low;
    const std::size_t x1 = x + edges[0], y1 = y + edges[1], z1 = z + edges[2];
    return at(x1, y1, z1) - at(x, y1, z1) - at(x1, y, z1) - at(x1, y1, z) + at(x, y, z1) + at(x, y1, z) + at(x1, y, z) -
           at(x, y, z);
  }

 private:
  std::size_t index(std::size_t x, std::size_t y, std::size_t z) const { return (z * size_[1] + y) * size_[0] + x; }
  std::int64_t at(std::size_t x, std::size_t y, std::size_t z) const { return sums_[index(x, y, z)]; }

  std::array<std::size_t, 3> size_;
  std::vector<std::int64_t> sums_;
};

/// The largest error of a fraction over all cubes of 1 mm.
double worst_cube(const HalftonedBlock& block, std::uint8_t material, double fraction) {
  std::array<std::size_t, 3> edges;
  for (std::size_t a = 0; a < 3; ++a) edges[a] = static_cast<std::size_t>(std::lround(1 / block.pitch_mm[a]));
  const auto voxels = static_cast<double>(edges[0] * edges[1] * edges[2]);
  const SummedVolume sums(block, material);
  double worst = 0;
  for (std::size_t z = 0; z + edges[2] <= block.size[2]; ++z) {
    for (std::size_t y = 0; y + edges[1] <= block.size[1]; ++y) {
      for (std::size_t x = 0; x + edges[0] <= block.size[0]; ++x) {
        worst = std::max(worst, std::abs(static_cast<double>(sums.count({x, y, z}, edges)) / voxels - fraction));
      }
    }
  }
  return worst;
}

/// The largest correlation of neighbouring layers.
double worst_correlation(const HalftonedBlock& block, std::uint8_t material) {
  const std::size_t layer = block.size[0] * block.size[1];
  const auto n = static_cast<double>(layer);
  double worst = 0;
  for (std::size_t z = 0; z + 1 < block.size[2]; ++z) {
    double a = 0, b = 0, ab = 0;
    for (std::size_t i = z * layer; i < (z + 1) * layer; ++i) {
      const bool here = block.materials[i] == material, above = block.materials[i + layer] == material;
      a += here;
      b += above;
      ab += here && above;
    }
    const double spread = std::sqrt(a * (n - a) * b * (n - b)) / (n * n);
    worst = std::max(worst, std::abs(ab / n - a * b / (n * n)) / spread);
  }
  return worst;
}

/// The largest error of a layer's mean, where the fraction grows from layer to layer.
double worst_gradient(const Options& options, HalftoneMethod method, std::size_t materials) {
  const auto value = [&](std::size_t z) {
    return static_cast<double>(z) * static_cast<double>(materials - 1) / static_cast<double>(kBlock[2] - 1);
  };
  const HalftonedBlock block = halftone_block(
      plan_of(options, blend_of(materials, method, options.seed)), options.pitch_mm, kBlock,
      [&](std::size_t, std::size_t, std::size_t z) { return std::vector<float>{static_cast<float>(value(z))}; });
  const std::size_t layer = kBlock[0] * kBlock[1];
  double worst = 0;
  for (std::size_t z = 0; z < kBlock[2]; ++z) {
    const auto begin = block.materials.begin() + static_cast<std::ptrdiff_t>(z * layer);
    const double sum = std::accumulate(begin, begin + static_cast<std::ptrdiff_t>(layer), 0.0);
    worst = std::max(worst, std::abs(sum / static_cast<double>(layer) - 1 - value(z)));
  }
  return worst;
}

/// Mixing and choosing, of a layer whose fraction grows along x.
double ns_per_voxel(const Options& options, HalftoneMethod method, std::size_t materials) {
  constexpr std::uint32_t kBlocks = 64, kRows = 2048;
  const HalftonePlan plan = plan_of(options, blend_of(materials, method));
  Halftoner halftoner(plan);
  std::vector<std::vector<MixRow>> values(kBlocks, std::vector<MixRow>(1));
  for (std::uint32_t i = 0; i < kBlocks * kMixBlock; ++i) {
    values[i / kMixBlock][0][i % kMixBlock] =
        static_cast<float>(i) * static_cast<float>(materials - 1) / (kBlocks * kMixBlock);
  }
  std::vector<std::uint8_t> row(kBlocks * kMixBlock);
  Fractions fractions{};
  double ns = 0;
  timed(ns, [&] {
    halftoner.start_layer(kBlocks * kMixBlock, 7);
    for (std::uint32_t y = 0; y < kRows; ++y) {
      halftoner.start_row(y);
      for (std::uint32_t i = 0; i < kBlocks; ++i) {
        const std::uint32_t block = halftoner.reverse() ? kBlocks - 1 - i : i;
        plan.mixtures().front().evaluate(values[block], fractions);
        halftoner.choose(block, 0, kMixBlock, fractions, &row[std::size_t{block} * kMixBlock]);
      }
    }
  });
  return ns / (kRows * static_cast<double>(row.size()));
}

struct Curve {
  std::string title;
  std::vector<SpectrumShell> shells;
};

std::string data_of(const std::vector<Curve>& curves) {
  std::string text;
  char line[64];
  for (std::size_t i = 0; i < curves.size(); ++i) {
    text += "$curve" + std::to_string(i) + " << END\n";
    for (std::size_t s = 0; s < curves[i].shells.size(); ++s) {
      if (curves[i].shells[s].frequencies == 0) continue;
      std::snprintf(line, sizeof line, "%g %g\n", (static_cast<double>(s) + 0.5) * kShell,
                    std::max(1e-4, curves[i].shells[s].mean));
      text += line;
    }
    text += "END\n";
  }
  return text;
}

void plot(const Options& options, const std::vector<Curve>& volume, const std::vector<Curve>& planes) {
  std::vector<Curve> all = volume;
  all.insert(all.end(), planes.begin(), planes.end());
  std::string commands = data_of(all) +
                         "set multiplot layout 1,2\nset logscale y\nset yrange [0.001:5]\nset xlabel 'cycles/mm'\n"
                         "set ylabel 'power, white noise = 1'\nset key bottom right\nset grid\n"
                         "set arrow from 1.5,0.001 to 1.5,5 nohead dashtype 2\n";
  const auto draw = [&](const std::string& title, std::size_t first, std::size_t count) {
    commands += "set title '" + title + "'\nplot ";
    for (std::size_t i = first; i < first + count; ++i) {  // A colour for each mix, dashes for each method.
      const std::size_t mix = (i - first) / kMethods.size(), method = (i - first) % kMethods.size();
      commands += (i == first ? "" : ", ") + ("$curve" + std::to_string(i)) + " with lines linewidth 2 linecolor " +
                  std::to_string(mix + 1) + " dashtype " + std::to_string(method + 1) + " title '" + all[i].title + "'";
    }
    commands += "\n";
  };
  draw("Volume, spherical shells", 0, volume.size());
  draw("Planes z = const, circular shells", volume.size(), planes.size());
  plot_png(options.plot, 1400, 600, commands + "unset multiplot\n");
}

void measure_mix(const Options& options, const std::vector<float>& fractions, BarTable& table,
                 std::vector<Curve>& volume, std::vector<Curve>& planes) {
  for (const HalftoneMethod method : kMethods) {
    const HalftonedBlock block = constant_block(options, method, fractions);
    const std::string title = std::string(name_of(method)) + " " + name_of(fractions);
    double cube = 0, power = 0, correlation = 0;
    for (std::size_t m = 0; m < fractions.size(); ++m) {
      const auto material = static_cast<std::uint8_t>(m + 1);
      cube = std::max(cube, worst_cube(block, material, static_cast<double>(fractions[m])));
      power = std::max(power, mean_power_below(block.pattern(material), 1.5));
      correlation = std::max(correlation, worst_correlation(block, material));
    }
    volume.push_back({title, radial_spectrum(block.pattern(1), kShell)});
    planes.push_back({title, planar_spectrum(block.pattern(1), kShell)});
    if (method == HalftoneMethod::kBlueNoise) {
      table.add(title + ": fraction in 1 mm cubes, worst error", cube, "", Bound::kAtMost, 0.01);
      table.add(title + ": power below 1.5 cycles/mm", power, "of white", Bound::kAtMost, 0.1);
    } else if (method == HalftoneMethod::kErrorDiffusion) {
      table.add(title + ": fraction in 1 mm cubes, worst error", cube, "", Bound::kAtMost, 0.005);
      table.add(title + ": neighbouring layers, worst correlation", correlation, "", Bound::kAtMost, 0.05);
      table.note(title + ": power below 1.5 cycles/mm", power, "of white");
    } else {
      table.note(title + ": fraction in 1 mm cubes, worst error", cube, "");
      table.note(title + ": power below 1.5 cycles/mm", power, "of white");
    }
  }
}

void measure_cost(const Options& options, BarTable& table) {
  double mask_ns = 0;
  timed(mask_ns, [&] { BlueNoiseMask(voxel_shape(options.pitch_mm[0], options.pitch_mm[1], options.pitch_mm[2])); });
  table.note("the mask, once", 1e-9 * mask_ns, "s");
  for (const std::size_t materials : {2, 3, 8}) {
    for (const auto& [method, bar] : {std::pair(HalftoneMethod::kBlueNoise, 2.0),
                                      {HalftoneMethod::kLargestFraction, 2.0},
                                      {HalftoneMethod::kErrorDiffusion, 15.0}}) {
      const std::string figure = std::string(name_of(method)) + ", " + std::to_string(materials) + " materials";
      const double ns = ns_per_voxel(options, method, materials);
      if (materials == 8) {
        table.note(figure, ns, "ns/voxel");
      } else {
        table.add(figure, ns, "ns/voxel", Bound::kAtMost, bar);
      }
    }
  }
}

int run(const Options& options) {
  BarTable table;
  std::vector<Curve> volume, planes;
  for (const std::vector<float>& fractions :
       {std::vector<float>{0.1f, 0.9f}, {0.3f, 0.7f}, {0.5f, 0.5f}, {0.2f, 0.3f, 0.5f}}) {
    measure_mix(options, fractions, table, volume, planes);
  }
  for (const HalftoneMethod method : {HalftoneMethod::kBlueNoise, HalftoneMethod::kErrorDiffusion}) {
    for (const std::size_t materials : {2, 3}) {
      table.add(
          std::string(name_of(method)) + ", gradient of " + std::to_string(materials) + ": layer means, worst error",
          worst_gradient(options, method, materials), "", Bound::kAtMost, 0.005);
    }
  }
  measure_cost(options, table);
  if (!options.plot.empty()) plot(options, volume, planes);
  return table.missed() == 0 ? 0 : 1;
}

}  // namespace
}  // namespace ccslice::bench

int main(int argc, char** argv) {
  using namespace ccslice::bench;
  CLI::App app("Halftones: fractions kept, power spectra over physical frequency, correlation of layers, cost");
  Options options;
  app.add_option("--pitch", options.pitch_mm, "Voxels in mm, X,Y,Z")->delimiter(',')->capture_default_str();
  app.add_option("--seed", options.seed, "Of the halftones");
  app.add_option("--plot", options.plot, "Write a PNG of the spectra");
  CLI11_PARSE(app, argc, argv);
  try {
    return run(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "halftone_quality: %s\n", error.what());
    return 2;
  }
}
