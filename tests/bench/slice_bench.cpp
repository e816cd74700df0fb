// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// slice_bench [MODEL] [LAYERS]: nanoseconds a voxel inside by stage, serial, over layers spread evenly through a sample
// model at 600 x 300 dpi and 30 um (the printer of [Luu19, 4]). Then the same layers through LayerSlicer, for the
// whole.

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <map>
#include <string>
#include <vector>

#include "core/contour/contour_index.h"
#include "core/contour/contour_tracer.h"
#include "core/material/contone.h"
#include "core/mesh/models.h"
#include "core/output/encode.h"
#include "core/raster/occupancy.h"
#include "core/slicer/layer_slicer.h"
#include "core/slicer/material_pass.h"

namespace ccslice {
namespace {

class Stopwatch {
 public:
  // Runs `work` and adds its time to the stage's.
  template <class Work>
  auto run(const std::string& stage, Work&& work) {
    const auto begin = std::chrono::steady_clock::now();
    struct Stop {
      double& total_ns;
      std::chrono::steady_clock::time_point begin;
      ~Stop() {
        total_ns += std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - begin).count();
      }
    } stop{total_ns_[stage], begin};
    return work();
  }

  void print(std::size_t layers, std::uint64_t voxels) const {
    std::printf("%-24s %12s %12s\n", "stage", "ms a layer", "ns a voxel");
    for (const auto& [stage, ns] : total_ns_) {
      std::printf("%-24s %12.3f %12.3f\n", stage.c_str(), ns * 1e-6 / layers, ns / std::max<std::uint64_t>(voxels, 1));
    }
  }

 private:
  std::map<std::string, double> total_ns_;
};

SliceJob printer_job(const LimitSolid& solid) {
  SliceJob job;
  GridRequest request;
  request.pitch = {0.0423, 0.0846, 0.03};
  job.grid = plan_grid(solid, job.placement, request);
  job.planes.resize(2);
  job.planes[1].content = PlaneContent::kChannel;
  job.planes[1].sample_type = SampleType::kUint8;
  return job;
}

std::vector<std::uint32_t> spread_layers(const Grid& grid, std::uint32_t count) {
  std::vector<std::uint32_t> layers;
  for (std::uint32_t i = 0; i < count; ++i) {
    layers.push_back(static_cast<std::uint32_t>((2ull * i + 1) * grid.extent.layers / (2 * count)));
  }
  return layers;
}

void encode_every_way(Stopwatch& watch, PlaneEncoder& encoder, const SampleImage& image, const std::string& name) {
  const std::pair<Encoding, const char*> encodings[] = {
      {Encoding::kRaw, "raw"}, {Encoding::kRawZstd, "zstd"}, {Encoding::kPng, "png"}};
  for (const auto& [encoding, encoding_name] : encodings) {
    if (encoding_obstacle(image.type, encoding)) continue;
    watch.run("4 encode " + name + " " + encoding_name, [&] { return encoder.encode(image, encoding); });
  }
}

void bench_stages(const std::shared_ptr<const LimitSolid>& solid, const SliceJob& job,
                  const std::vector<std::uint32_t>& layers) {
  const LayerLattice lattice = {job.grid.origin_mm.x(), job.grid.origin_mm.y(),  job.grid.pitch.x_mm,
                                job.grid.pitch.y_mm,    job.grid.extent.columns, job.grid.extent.rows};
  Stopwatch watch;
  ContourTracer tracer(*solid, std::make_shared<ContourIndex>(*solid, job.placement, Vec3::UnitZ()));
  const std::unique_ptr<MaterialField> field = make_material_field(solid, job.placement, 2e-3);
  MaterialPass materials(*field);
  std::vector<ContonePlane> contone;
  contone.emplace_back(job.planes[1], solid->summary().channels[0]);
  PlaneEncoder encoder;
  LayerStats stats;
  for (const std::uint32_t layer : layers) {
    const double z_mm = job.grid.layer_z_mm(layer);
    SlicePlane plane;
    plane.origin.z() = z_mm;
    ContourOptions options;
    options.smallest_feature_mm = std::min(job.grid.pitch.x_mm, job.grid.pitch.y_mm);
    const Contours contours = watch.run("1 contours", [&] { return tracer.trace(plane, options); });
    const std::vector<Span> spans = watch.run("2 raster", [&] { return rasterize(contours, lattice); });
    for (const Span& span : spans) stats.voxels_inside += span.end - span.begin;
    watch.run("3 inversion", [&] {
      contone[0].clear(lattice.width, lattice.height);
      materials.run(spans, lattice, z_mm, contone, stats, {});
    });
    const BitImage bits = watch.run("2 raster", [&] { return to_bit_image(spans, lattice.width, lattice.height); });
    encode_every_way(watch, encoder, {SampleType::kBit, bits.width, bits.height, bits.bits}, "1 bit");
    encode_every_way(watch, encoder, contone[0].image(), "8 bit");
  }
  LayerSlicer slicer(solid, job);
  watch.run("5 LayerSlicer, 2 x zstd", [&] {
    for (const std::uint32_t layer : layers) slicer.slice(layer, {});
  });
  watch.print(layers.size(), stats.voxels_inside);
  std::printf("voxels inside: %llu, by the whole search: %llu, unresolved: %llu, largest residual: %.3g mm\n",
              static_cast<unsigned long long>(stats.voxels_inside), static_cast<unsigned long long>(stats.voxels_full),
              static_cast<unsigned long long>(stats.voxels_unresolved), stats.max_residual_mm);
}

int run(const std::string& model_name, int layer_count) {
  const SampleModel* model = find_sample_model(model_name);
  if (!model || layer_count < 1) {
    std::fprintf(stderr, "usage: slice_bench [MODEL] [LAYERS]; models:");
    for (const SampleModel& known : sample_models()) std::fprintf(stderr, " %s", std::string(known.name).c_str());
    std::fprintf(stderr, "\n");
    return 2;
  }
  const auto begin = std::chrono::steady_clock::now();
  const std::shared_ptr<const LimitSolid> solid = LimitSolid::prepare(model->make());
  const double prepare_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  const SliceJob job = printer_job(*solid);
  validate_job(*solid, job);
  const GridExtent& extent = job.grid.extent;
  std::printf("%s: %u x %u voxels, %u layers, %d of them timed; prepared in %.1f ms\n", model_name.c_str(),
              extent.columns, extent.rows, extent.layers, layer_count, prepare_ms);
  bench_stages(solid, job, spread_layers(job.grid, layer_count));
  return 0;
}

}  // namespace
}  // namespace ccslice

int main(int argc, char** argv) {
  try {
    return ccslice::run(argc > 1 ? argv[1] : "ring", argc > 2 ? std::atoi(argv[2]) : 3);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "slice_bench: %s\n", error.what());
    return 1;
  }
}
