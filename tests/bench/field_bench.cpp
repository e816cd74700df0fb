// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// field_bench: what fields cost, beside the same jobs without them, and how exact distances are.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/distance/distance_source.h"
#include "core/formula/formula.h"
#include "core/slicer/layer_slicer.h"
#include "core/volume/volume_source.h"
#include "tests/bench/bars.h"
#include "tests/bench/clocks.h"
#include "tests/bench/median.h"
#include "tests/bench/printer_job.h"

namespace ccslice::bench {
namespace {

constexpr double kShellMm = 0.5;

/// Two materials, blended by the first channel and halftoned; the second one alone below the surface, if `shell`.
SliceJob halftoned(const PrinterJob& part, bool shell) {
  SliceJob job = part.job;
  PlaneSpec plane;
  plane.content = PlaneContent::kMaterials;
  plane.encoding = Encoding::kPng;
  plane.sample_type = SampleType::kUint8;
  job.planes = {plane};
  const ChannelRange& range = part.solid->summary().channels.front();
  Printing printing;
  printing.materials = {{"soft", 0xff0000ff}, {"hard", 0x0000ffff}};
  printing.map.kind = BlendMap{range.name, {{range.min, 1}, {range.max, 2}}};
  if (shell) {
    printing.map.overrides = {{"shell", kShellMm, 2}};
    job.sources = {std::make_shared<DistanceSource>(ChannelRange{"shell", 0, kShellMm}, part.solid, Mat3::Identity(),
                                                    SurfaceKind::kBoundary, kShellMm)};
  }
  job.printing = printing;
  return job;
}

/// CPU time of whole slabs of the job, with all that is made for them once.
double slice_ns(const PrinterJob& part, const SliceJob& job, std::uint32_t slabs) {
  double ns = 0;
  timed(ns, [&] {
    LayerSlicer slicer(part.solid, job);
    for (const std::uint32_t first : spread_slabs(job.grid, slabs)) {
      const std::uint32_t end = std::min(first + kSlabLayers, job.grid.extent.layers);
      for (std::uint32_t layer = first; layer < end; ++layer) (void)slicer.slice(layer, {});
    }
  });
  return ns;
}

void measure_shells(std::uint32_t slabs, int turns, BarTable& table) {
  constexpr std::array<std::pair<const char*, double>, 2> kBars = {{{"ring", 1.3}, {"engine", 1.15}}};
  for (const auto& [sample, bar] : kBars) {
    std::vector<double> without, with;
    for (int turn = 0; turn < turns; ++turn) {
      // Prepared anew each time, so that no distances are kept from the turn before.
      const PrinterJob part = sample_printer_job(sample);
      without.push_back(slice_ns(part, halftoned(part, false), slabs));
      with.push_back(slice_ns(part, halftoned(part, true), slabs));
    }
    table.note(std::string(sample) + ": a halftoned job, CPU", 1e-9 * median(without), "s");
    table.add(std::string(sample) + ": the same with a shell of 0.5 mm", median(with) / median(without), "times",
              Bound::kAtMost, bar);
  }
}

/// A box has its depth in closed form.
void measure_error(BarTable& table) {
  const PrinterJob part = sample_printer_job("box");
  const Box3 box = part.solid->summary().bounding_box;
  constexpr double kReachMm = 2;
  const DistanceSource depth({"depth", 0, kReachMm}, part.solid, Mat3::Identity(), SurfaceKind::kBoundary, kReachMm);
  constexpr std::uint32_t kRows = 1000, kColumns = 1000;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> share(0, 1);
  std::vector<float> values(kColumns);
  double worst = 0, ns = 0;
  for (std::uint32_t row = 0; row < kRows; ++row) {
    const double y = share(random), z = share(random);
    const Vec3 first = box.min() + Vec3(0, y, z).cwiseProduct(box.sizes());
    const Vec3 step(box.sizes().x() / kColumns, 0, 0);
    const SourceRow points{first, step, first, step, 0, kColumns};
    timed(ns, [&] { depth.sample_row(points, {}, values); });
    for (std::uint32_t k = 0; k < kColumns; ++k) {
      const Vec3 low = points.mesh(k) - box.min(), high = box.max() - points.mesh(k);
      const double exact = std::min({low.minCoeff(), high.minCoeff(), kReachMm});
      worst = std::max(worst, std::abs(exact - values[k]));
    }
  }
  table.add("depth in a box, worst error of 10^6 points", 1e3 * worst, "um", Bound::kAtMost, 2);
  table.note("depth in a box, values to 2 mm", ns / (kRows * kColumns), "ns/voxel");
}

void measure_formulas(BarTable& table) {
  constexpr std::uint32_t kVoxels = 1 << 20;
  constexpr int kOperations = 40;
  std::vector<float> values(kVoxels);
  for (const auto& [name, text] : {std::pair<std::string, std::string>{"+ and *", "*y+x"}, {"min and max", ""}}) {
    std::string formula = "x";
    for (int i = 0; i < kOperations / 2; ++i) {
      formula = text.empty() ? "max(min(" + formula + ",y),z)" : "(" + formula + ")" + text;
    }
    const Formula parsed = Formula::parse(formula, {});
    std::vector<double> times;
    for (int turn = 0; turn < 5; ++turn) {
      double ns = 0;
      timed(ns, [&] { parsed.evaluate(Vec3(1, 0.9, 0.8), Vec3(1e-6, 0, 0), 0, {}, values); });
      times.push_back(ns / kVoxels / kOperations);
    }
    table.add("formulas, an operation of " + name, median(times), "ns", Bound::kAtMost, 0.25);
  }
}

/// 256^3 samples of 16 bits, read by rows of 500 voxels that cover 60 % of them.
void measure_volumes(BarTable& table) {
  constexpr std::uint32_t kSamples = 256, kVoxels = 500, kRows = 2000;
  const VolumeShape shape{.samples = {kSamples, kSamples, kSamples}, .type = VolumeSampleType::kUint16};
  std::vector<std::byte> bytes(shape.bytes());
  std::mt19937 random(1);
  for (std::byte& byte : bytes) byte = static_cast<std::byte>(random());
  const auto volume = std::make_shared<const Volume>(shape, std::move(bytes));
  const auto measured = [&](const VolumeReading& reading) {
    const VolumeSource source({"v", 0, 65535}, volume, reading);
    const double step = 0.6 * kSamples / kVoxels;
    std::vector<float> values(kVoxels);
    std::vector<double> times;
    for (int turn = 0; turn < 5; ++turn) {
      double ns = 0;
      timed(ns, [&] {
        for (std::uint32_t row = 0; row < kRows; ++row) {
          const Vec3 first(0.2 * kSamples, 50 + 0.02 * row, 50 + 0.01 * row);
          source.sample_row({first, Vec3(step, 0, 0), first, Vec3(step, 0, 0), 0, kVoxels}, {}, values);
        }
      });
      times.push_back(ns / kRows / kVoxels);
    }
    return median(times);
  };
  VolumeReading turned;
  turned.index_of_mm = Eigen::AngleAxisd(0.3, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  table.add("volumes, linear along the samples' axes", measured({}), "ns/voxel", Bound::kAtMost, 3);
  table.add("volumes, linear and turned", measured(turned), "ns/voxel", Bound::kAtMost, 3);
  table.note("volumes, nearest", measured({.nearest = true}), "ns/voxel");
}

}  // namespace
}  // namespace ccslice::bench

int main(int argc, char** argv) {
  using namespace ccslice::bench;
  CLI::App app("Fields: jobs with a shell beside jobs without, the error of distances, the cost of formulas, volumes");
  std::uint32_t slabs = 8;
  int turns = 3;
  std::string json;
  app.add_option("--slabs", slabs, "Slabs of 16 layers of each job")->capture_default_str();
  app.add_option("--turns", turns, "How often each job is sliced")->check(CLI::PositiveNumber)->capture_default_str();
  app.add_option("--json", json, "Write the figures to this file, too");
  CLI11_PARSE(app, argc, argv);
  try {
    BarTable table;
    measure_shells(slabs, turns, table);
    measure_error(table);
    measure_formulas(table);
    measure_volumes(table);
    if (!json.empty()) table.write_json(json);
    return table.missed() == 0 ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "field_bench: %s\n", error.what());
    return 2;
  }
}
