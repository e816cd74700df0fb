// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// fold_bench: what voxels cost where a point may have several parameters, because cells fold or separate parts overlap.
// For each mesh it slices all layers twice on one thread, interpolated and inverted, and prints CPU time for each voxel
// inside and a digest (layer_digest.h): a change that must not change a byte leaves the digests as they were.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cinttypes>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/job/validate_job.h"
#include "core/limit/cell_index.h"
#include "core/mesh_authoring/sharpen.h"
#include "core/prepare/prepare_solid.h"
#include "core/slicer/layer_slicer.h"
#include "tests/bench/clocks.h"
#include "tests/bench/layer_digest.h"
#include "tests/oracle/hostile/hostile_mesh.h"
#include "tests/oracle/real_meshes.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::bench {
namespace {

struct Part : oracle::NamedMesh {
  double voxels = 4e5;  // In its box, about.
};

constexpr double kVoxelsOfCell = 1000;  // In the boxes of real meshes.

/// Boxes of about 10 mm that all hold the points near the middle.
ControlMesh overlapping_boxes(int count) {
  ControlMesh mesh = oracle::box_mesh(1, 1, 1);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> shift(-1, 1);
  const ControlMesh box = mesh;
  for (int i = 1; i < count; ++i) oracle::append_mesh(mesh, box, {shift(random), shift(random), shift(random)});
  return mesh;
}

ControlMesh jittered(ControlMesh mesh, double amplitude_mm) {
  oracle::jitter(mesh, amplitude_mm, 1);
  mesh.allow_folds = true;
  return mesh;
}

std::vector<Part> made_parts() {
  return {{{"valleys that cross, sharp", oracle::crossed_valleys()}},
          {{"2 cells round a sharp edge", oracle::sharp_fan(2, 230, 7)}},
          {{"3 cells round a sharp edge", oracle::sharp_fan(3, 270, 7)}},
          {{"box with a vertex far out", jittered(oracle::folding_box_mesh(), 0)}},
          {{"20 overlapping boxes", overlapping_boxes(20)}, 1e5},
          {{"300 overlapping boxes", overlapping_boxes(300)}, 3e4},
          {{"5000 overlapping boxes", overlapping_boxes(5000)}, 8e3}};
}

/// Sharp wherever the surface turns by 40 degrees, in reentrant edges too: those fold.
ControlMesh sharpened(ControlMesh mesh) {
  constexpr double kAngle = 40;
  const SharpEdges found = find_sharp_edges(mesh, kAngle);
  SharpFeatures sharp{found.convex, {}};
  sharp.edges.insert(sharp.edges.end(), found.reentrant.begin(), found.reentrant.end());
  add_sharp_features(sharp, mesh);
  return mesh;
}

std::vector<Part> real_parts() {
  std::vector<Part> parts;
  for (const std::string& name : oracle::real_mesh_names()) {
    std::optional<ControlMesh> mesh = oracle::read_real_mesh(name);
    if (!mesh) continue;
    mesh->allow_folds = true;
    const double voxels = kVoxelsOfCell * static_cast<double>(mesh->cell_kinds.size());
    if (name == "joint_limit_folds.vtk") parts.push_back({{name, *mesh}, voxels});
    parts.push_back({{name + ", sharp", sharpened(std::move(*mesh))}, voxels});
  }
  return parts;
}

/// Cubic voxels, so many in the part's box, all channels as floats.
SliceJob job_of(const LimitSolid& solid, double voxels) {
  SliceJob job;
  GridRequest request;
  const double pitch = std::cbrt(solid.summary().bounding_box.volume() / voxels);
  request.pitch = {pitch, pitch, pitch};
  job.grid = plan_grid(solid, job.placement, request);
  job.planes.resize(1);
  PlaneSpec plane;
  plane.content = PlaneContent::kChannel;
  plane.sample_type = SampleType::kFloat32;
  for (const ChannelRange& channel : solid.summary().channels) {
    plane.channel = channel.name;
    job.planes.push_back(plane);
  }
  validate_job(solid, job);
  return job;
}

/// All of a small part's; of others every fourth block of those that share their pieces.
std::vector<std::uint32_t> layers_of(const Grid& grid) {
  constexpr std::uint32_t kSmall = 100, kEvery = 4;
  std::vector<std::uint32_t> layers;
  for (std::uint32_t z = 0; z < grid.extent.layers; ++z) {
    if (grid.extent.layers <= kSmall || z / kSlabLayers % kEvery == kEvery / 2) layers.push_back(z);
  }
  return layers;
}

void print_cost(const std::shared_ptr<const LimitSolid>& solid, SliceJob job, double tolerance) {
  job.channel_tolerance = tolerance;
  LayerDigest digest;
  std::uint64_t voxels = 0, unresolved = 0;
  double cpu_ns = 0;
  timed(cpu_ns, [&] {
    LayerSlicer slicer(solid, job);
    for (const std::uint32_t z : layers_of(job.grid)) {
      const Layer layer = slicer.slice(z, {});
      digest.add(layer);
      voxels += layer.stats.voxels_inside;
      unresolved += layer.stats.voxels_unresolved;
    }
  });
  std::printf("  %9" PRIu64 " %6" PRIu64 " %8.3f %016" PRIx64, voxels, unresolved,
              1e-3 * cpu_ns / static_cast<double>(std::max<std::uint64_t>(voxels, 1)), digest.value());
  std::fflush(stdout);
}

/// Nothing, for a mesh that has nowhere several parameters.
void print_costs(Part part) {
  if (part.mesh.channel_names.empty()) oracle::grade_by_coordinates(part.mesh);
  try {
    const std::shared_ptr<const LimitSolid> solid = prepare_solid(std::move(part.mesh));
    const SolidSummary& summary = solid->summary();
    if (!solid->index().is_ambiguous(summary.bounding_box)) return;
    const SliceJob job = job_of(*solid, part.voxels);
    std::printf("%-32s %6" PRIu32 " %5" PRIu32, part.name.c_str(), solid->cell_count(),
                static_cast<std::uint32_t>(summary.folding_cells + summary.undecided_cells));
    print_cost(solid, job, 1.0 / 1024);
    print_cost(solid, job, 0);
    std::printf("\n");
  } catch (const Error& error) {
    if (static_cast<int>(error.code()) >= 300) throw;
    std::printf("%-32s refused: %s\n", part.name.c_str(), error.what());
  }
}

void print_seeds(std::uint64_t last) {
  for (std::uint64_t seed = 1; seed <= last; ++seed) {
    oracle::HostileMesh mesh = oracle::make_hostile_mesh(seed);
    mesh.mesh.allow_folds = true;
    print_costs({{"hostile mesh " + std::to_string(seed), std::move(mesh.mesh)}, 5e4});
  }
}

}  // namespace
}  // namespace ccslice::bench

int main(int argc, char** argv) {
  using namespace ccslice;
  CLI::App app("Prints what voxels cost near folds and overlaps, and digests of their layers");
  std::uint64_t seeds = 0;
  std::string only;
  double times = 1;
  app.add_option("--seeds", seeds, "The meshes of the first so many hostile jobs too")->capture_default_str();
  app.add_option("--only", only, "Meshes whose names contain this");
  app.add_option("--voxels", times,
                 "So many times as many voxels, but of --seeds: 20 or more are what parts are printed with")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    std::printf("%-32s %6s %5s  %9s %6s %8s %16s  %9s %6s %8s %16s\n", "mesh", "cells", "fold", "voxels", "unres.",
                "us, 2^-10", "digest", "voxels", "unres.", "us, 0", "digest");
    for (const auto& parts : {bench::made_parts(), bench::real_parts()}) {
      for (bench::Part part : parts) {
        part.voxels *= times;
        if (part.name.find(only) != std::string::npos) bench::print_costs(std::move(part));
      }
    }
    bench::print_seeds(seeds);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "fold_bench: %s\n", error.what());
    return 2;
  }
}
