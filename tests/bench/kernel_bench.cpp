// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// kernel_bench: Google Benchmarks of the kernels, one thread, in CPU time. `item` is what one item costs: an
// evaluation, an inverted point, a voxel inside, a cell.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "core/inversion/point_inverter.h"
#include "core/job/validate_job.h"
#include "core/limit/limit_evaluator.h"
#include "core/models/models.h"
#include "core/output/encode.h"
#include "core/prepare/prepare_solid.h"
#include "core/slicer/layer_slicer.h"
#include "core/subdivision/refined_mesh.h"
#include "tests/bench/our_method.h"
#include "tests/bench/printer_job.h"

namespace ccslice::bench {
namespace {

constexpr std::size_t kPlaces = 4096;  // Distinct parameters or points that a benchmark goes round.
constexpr double kNear = 0.01;         // Share of a cell that neighbouring voxels are apart.

/// Each sample is prepared once.
const PrinterJob& job_of(const std::string& sample) {
  static std::map<std::string, PrinterJob> jobs;
  const auto found = jobs.find(sample);
  return found != jobs.end() ? found->second : jobs.emplace(sample, sample_printer_job(sample)).first->second;
}

void count_items(benchmark::State& state, double items_an_iteration = 1) {
  state.counters["item"] = benchmark::Counter(
      items_an_iteration, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

const char* sample_with(CellClass cell_class) { return cell_class == CellClass::kRegular ? "ring" : "engine"; }

/// Parameters in cells of a class: all over the solid, or within one cell.
std::vector<CellParam> random_params(const LimitSolid& solid, CellClass cell_class, bool scattered) {
  std::vector<LimitCellId> cells;
  for (const LimitCellId cell : solid.cells()) {
    if (solid.cell_class(cell) == cell_class) cells.push_back(cell);
  }
  std::mt19937 random(1);
  std::uniform_real_distribution<double> share(0, 1);
  std::vector<CellParam> params;
  for (std::size_t i = 0; i < kPlaces; ++i) {
    const LimitCellId cell = cells[scattered ? random() % cells.size() : cells.size() / 2];
    params.push_back({cell, Vec3(share(random), share(random), share(random))});
  }
  return params;
}

enum class Evaluate { kGeo, kSample, kMat };

void limit_evaluation(benchmark::State& state, CellClass cell_class, Evaluate what, bool scattered) {
  const LimitSolid& solid = *job_of(sample_with(cell_class)).solid;
  const std::vector<CellParam> params = random_params(solid, cell_class, scattered);
  LimitEvaluator evaluator(solid);
  std::vector<double> channels(solid.channel_count());
  std::size_t i = 0;
  for (auto _ : state) {
    const CellParam& at = params[i++ % kPlaces];
    switch (what) {
      case Evaluate::kGeo: benchmark::DoNotOptimize(evaluator.geo(at)); break;
      case Evaluate::kSample: benchmark::DoNotOptimize(evaluator.sample(at)); break;
      case Evaluate::kMat:
        evaluator.mat(at, channels);
        benchmark::DoNotOptimize(channels.data());
        break;
    }
  }
  count_items(state);
}

void point_inversion(benchmark::State& state, CellClass cell_class, bool coherent) {
  const LimitSolid& solid = *job_of(sample_with(cell_class)).solid;
  const std::vector<CellParam> params = random_params(solid, cell_class, !coherent);
  PointInverter inverter(solid);
  std::vector<Vec3> points;
  std::vector<std::optional<CellParam>> hints(kPlaces);
  for (std::size_t i = 0; i < kPlaces; ++i) {
    points.push_back(inverter.evaluator().geo(params[i]));
    if (!coherent) continue;
    const Vec3 step = params[i].uvw.unaryExpr([](double u) { return u < 0.5 ? kNear : -kNear; });
    hints[i] = CellParam{params[i].cell, params[i].uvw + step};
  }
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(inverter.invert(points[i % kPlaces], hints[i % kPlaces]));
    ++i;
  }
  count_items(state);
}

std::uint32_t middle_layer(const PrinterJob& job) { return job.job.grid.extent.layers / 2; }

void contour(benchmark::State& state, const std::string& sample) {
  const PrinterJob& job = job_of(sample);
  OurMethod method(job);
  const std::vector<std::uint32_t> layers = spread(job.job.grid.extent.layers, 16);
  double voxels = 0;
  for (const std::uint32_t layer : layers) {
    StageCost cost;
    voxels += static_cast<double>(method.shape(layer, cost).voxels) / static_cast<double>(layers.size());
  }
  std::size_t i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(method.trace(layers[i++ % layers.size()]));
  count_items(state, voxels);
}

void rasterization(benchmark::State& state, const std::string& sample) {
  const PrinterJob& job = job_of(sample);
  OurMethod method(job);
  const Contours contours = method.trace(middle_layer(job));
  std::uint64_t voxels = 0;
  for (auto _ : state) {
    const std::vector<VoxelRun> spans = rasterize(contours, method.lattice());
    benchmark::DoNotOptimize(to_bit_image(spans, method.lattice().width, method.lattice().height));
    voxels = count_voxels(spans);
  }
  count_items(state, static_cast<double>(voxels));
}

struct Slab {
  std::vector<LayerShape> layers;
  StageCost cost;
};

Slab middle_slab(const PrinterJob& job, OurMethod& method) {
  Slab slab;
  slab.layers = method.shape_slab(middle_layer(job) - middle_layer(job) % kSlabLayers, slab.cost);
  return slab;
}

void tile_fit(benchmark::State& state, const std::string& sample) {
  const PrinterJob& job = job_of(sample);
  OurMethod method(job);
  const Slab slab = middle_slab(job, method);
  for (auto _ : state) {
    state.PauseTiming();
    OurMethod fresh(job);  // That knows no pieces yet.
    state.ResumeTiming();
    fresh.solve_materials(slab.layers);
  }
  count_items(state, static_cast<double>(slab.cost.voxels));
}

void tile_fill(benchmark::State& state, const std::string& sample) {
  const PrinterJob& job = job_of(sample);
  OurMethod method(job);
  const Slab slab = middle_slab(job, method);
  method.solve_materials(slab.layers);
  for (auto _ : state) method.paint_bytes(slab.layers[0]);
  count_items(state, static_cast<double>(slab.layers[0].voxels));
}

enum class Regions { kNone, kThere, kShown };

/// Eight regions of a ring: four sectors of an inner and an outer one.
ControlMesh ring_of_regions() {
  ControlMesh mesh = make_ring();
  for (int region = 0; region < 8; ++region) mesh.cell_region_names.push_back("r" + std::to_string(region));
  const auto middle_of = [&](std::size_t cell) {
    Vec3 sum = Vec3::Zero();
    for (std::size_t corner = 0; corner < 8; ++corner) sum += mesh.positions[mesh.cell_vertices[8 * cell + corner]];
    return Vec3(sum / 8);
  };
  double nearest = std::numeric_limits<double>::max(), farthest = 0;
  for (std::size_t cell = 0; cell < mesh.cell_count(); ++cell) {
    const double radius = middle_of(cell).head<2>().norm();
    nearest = std::min(nearest, radius);
    farthest = std::max(farthest, radius);
  }
  for (std::size_t cell = 0; cell < mesh.cell_count(); ++cell) {
    const Vec3 middle = middle_of(cell);
    const int outer = middle.head<2>().norm() > (nearest + farthest) / 2;
    mesh.cell_regions.push_back(static_cast<std::uint8_t>(4 * outer + 2 * (middle.x() > 0) + (middle.y() > 0)));
  }
  return mesh;
}

/// Layers one after the other, with all that is done for them: occupancy and a channel of 8 bits, encoded.
void whole_layer(benchmark::State& state, Regions regions) {
  PrinterJob job = make_printer_job("ring", regions == Regions::kNone ? make_ring() : ring_of_regions());
  if (regions == Regions::kShown) {
    PlaneSpec& plane = job.job.planes.emplace_back();
    plane.content = PlaneContent::kCellRegions;
    plane.sample_type = SampleType::kUint8;
    validate_job(*job.solid, job.job);
  }
  LayerSlicer slicer(job.solid, job.job);
  const CancellationToken cancel;
  std::uint32_t layer = 0;
  double voxels = 0;
  for (auto _ : state) {
    voxels += static_cast<double>(slicer.slice(layer++ % job.job.grid.extent.layers, cancel).stats.voxels_inside);
  }
  state.counters["item"] = benchmark::Counter(voxels, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void preparation(benchmark::State& state, const ControlMesh& mesh) {
  std::size_t cells = 0;
  for (auto _ : state) cells = prepare_solid(mesh)->cell_count();
  count_items(state, static_cast<double>(cells));
}

void encoding(benchmark::State& state, const std::string& sample, SampleType type, Encoding encoding) {
  const PrinterJob& job = job_of(sample);
  OurMethod method(job);
  const Slab slab = middle_slab(job, method);
  const LayerShape& layer = slab.layers[0];
  const BitImage bits = to_bit_image(layer.spans, method.lattice().width, method.lattice().height);
  SampleImage image{SampleType::kBit, bits.width, bits.height, bits.bits};
  if (type == SampleType::kUint8) {
    method.solve_materials(slab.layers);
    image = method.paint_bytes(layer);
  }
  PlaneEncoder encoder;
  for (auto _ : state) benchmark::DoNotOptimize(encoder.encode(image, encoding));
  count_items(state, static_cast<double>(layer.voxels));
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations() * image.samples.size()));
}

void add_evaluations() {
  const std::pair<CellClass, std::string> classes[] = {
      {CellClass::kRegular, "regular"}, {CellClass::kLine, "line"}, {CellClass::kVertex, "vertex"}};
  const std::pair<Evaluate, std::string> kernels[] = {
      {Evaluate::kGeo, "geo"}, {Evaluate::kSample, "geo+jacobian"}, {Evaluate::kMat, "mat"}};
  for (const auto& [cell_class, class_name] : classes) {
    for (const auto& [kernel, kernel_name] : kernels) {
      for (const bool scattered : {false, true}) {
        const std::string where = scattered ? "/all_cells" : "/one_cell";
        benchmark::RegisterBenchmark(("limit/" + class_name + "/" + kernel_name + where).c_str(), limit_evaluation,
                                     cell_class, kernel, scattered);
      }
    }
    benchmark::RegisterBenchmark(("inversion/" + class_name + "/coherent").c_str(), point_inversion, cell_class, true);
    benchmark::RegisterBenchmark(("inversion/" + class_name + "/full").c_str(), point_inversion, cell_class, false);
  }
}

void add_layers() {
  constexpr auto kUnit = benchmark::kMillisecond;
  for (const std::string sample : {"ring", "coyote", "engine", "bracket", "grid"}) {
    benchmark::RegisterBenchmark(("contour/" + sample).c_str(), contour, sample)->Unit(kUnit);
    benchmark::RegisterBenchmark(("raster/" + sample).c_str(), rasterization, sample)->Unit(kUnit);
    benchmark::RegisterBenchmark(("tile_fit/" + sample).c_str(), tile_fit, sample)->Unit(kUnit);
    benchmark::RegisterBenchmark(("tile_fill/" + sample).c_str(), tile_fill, sample)->Unit(kUnit);
    for (const auto& [encoding_kind, name] :
         {std::pair(Encoding::kRaw, "raw"), std::pair(Encoding::kRawZstd, "zstd")}) {
      benchmark::RegisterBenchmark(("encode/" + sample + "/1_bit/" + name).c_str(), encoding, sample, SampleType::kBit,
                                   encoding_kind)
          ->Unit(kUnit);
      benchmark::RegisterBenchmark(("encode/" + sample + "/8_bit/" + name).c_str(), encoding, sample,
                                   SampleType::kUint8, encoding_kind)
          ->Unit(kUnit);
    }
  }
}

void add_regions() {
  const std::pair<Regions, std::string> cases[] = {
      {Regions::kNone, "without"}, {Regions::kThere, "eight"}, {Regions::kShown, "eight_shown"}};
  for (const auto& [regions, name] : cases) {
    benchmark::RegisterBenchmark(("regions/" + name).c_str(), whole_layer, regions)->Unit(benchmark::kMillisecond);
  }
}

void add_preparations() {
  constexpr auto kUnit = benchmark::kMillisecond;
  benchmark::RegisterBenchmark("prepare/regular_cells", preparation, refine_mesh(make_ring(), 1))->Unit(kUnit);
  benchmark::RegisterBenchmark("prepare/irregular_cells", preparation, make_grid())->Unit(kUnit);
  benchmark::RegisterBenchmark("prepare/mixed_cells", preparation, make_engine())->Unit(kUnit);
}

}  // namespace
}  // namespace ccslice::bench

int main(int argc, char** argv) {
  ccslice::bench::add_evaluations();
  ccslice::bench::add_layers();
  ccslice::bench::add_regions();
  ccslice::bench::add_preparations();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}
