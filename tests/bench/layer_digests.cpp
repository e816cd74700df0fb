// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// layer_digests: one number for all that a job delivers, for some jobs on the samples and on real meshes. A change that
// must not change a byte leaves the output as it was:
//
//   layer_digests > before.txt; ...; layer_digests | diff before.txt -
//
// The jobs: contone planes of every kind of sample, materials by blue noise and by error diffusion, contours of a
// region. Digests: layer_digest.h.

#include <CLI/CLI.hpp>
#include <cinttypes>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/models/models.h"
#include "tests/bench/layer_digest.h"
#include "tests/bench/printer_job.h"
#include "tests/oracle/real_meshes.h"
#include "tests/support/slice_range.h"

namespace ccslice::bench {
namespace {

PlaneSpec channel_plane(const PrinterJob& part, SampleType type) {
  PlaneSpec plane;
  plane.channel = part.mesh.channel_names[0];
  plane.content = PlaneContent::kChannel;
  plane.sample_type = type;
  return plane;
}

SliceJob contone(const PrinterJob& part) {
  SliceJob job = part.job;
  job.planes = {PlaneSpec(), channel_plane(part, SampleType::kUint8), channel_plane(part, SampleType::kUint16),
                channel_plane(part, SampleType::kFloat32)};
  return job;
}

SliceJob printed(const PrinterJob& part, HalftoneMethod method) {
  SliceJob job = part.job;
  const ChannelRange& channel = part.solid->summary().channels[0];
  Printing printing;
  printing.materials = {{"one", 0xff0000ff}, {"two", 0x00ff00ff}, {"three", 0x0000ffff}};
  printing.map.kind =
      BlendMap{channel.name, {{channel.min, 1}, {0.5 * (channel.min + channel.max), 2}, {channel.max, 3}}};
  printing.halftone = {method, 7};
  job.printing = printing;
  PlaneSpec plane;
  plane.content = PlaneContent::kMaterials;
  plane.sample_type = SampleType::kUint8;
  job.planes = {plane};
  return job;
}

/// The middle half of each axis.
SliceJob region_with_contours(const PrinterJob& part) {
  SliceJob job = contone(part);
  const GridExtent& extent = job.grid.extent;
  job.region = VoxelBox{extent.columns / 4,
                        extent.rows / 4,
                        extent.layers / 4,
                        {extent.columns / 2 + 1, extent.rows / 2 + 1, extent.layers / 2 + 1}};
  job.contours = true;
  return job;
}

void print_digest(const PrinterJob& part, const char* name, const SliceJob& job) {
  const VoxelBox region = region_of(job);
  LayerDigest digest;
  std::uint64_t voxels = 0;
  slice_range(part.solid, job, region.first_layer, region.extent.layers, [&](Layer&& layer) {
    digest.add(layer);
    voxels += layer.stats.voxels_inside;
  });
  std::printf("%-28s %-16s %016" PRIx64 "  %" PRIu32 " layers, %" PRIu64 " voxels\n", part.name.c_str(), name,
              digest.value(), region.extent.layers, voxels);
  std::fflush(stdout);
}

void print_digests(const std::string& model, double pitches, double longest_mm) {
  std::optional<ControlMesh> mesh = oracle::read_real_mesh(model);
  if (!mesh) throw std::runtime_error(model + ": there is neither a sample nor a file of that name");
  if (!find_sample_model(model)) oracle::scale_to(longest_mm, *mesh);
  const VoxelPitch pitch = {pitches * kPrinterPitch.x_mm, pitches * kPrinterPitch.y_mm, pitches * kPrinterPitch.z_mm};
  const PrinterJob part = make_printer_job(model, std::move(*mesh), pitch);
  print_digest(part, "contone", contone(part));
  SliceJob exact = contone(part);
  exact.channel_tolerance = 1.0 / 16384;
  print_digest(part, "contone, 1/16384", exact);
  print_digest(part, "blue noise", printed(part, HalftoneMethod::kBlueNoise));
  print_digest(part, "error diffusion", printed(part, HalftoneMethod::kErrorDiffusion));
  print_digest(part, "region, contours", region_with_contours(part));
}

}  // namespace
}  // namespace ccslice::bench

int main(int argc, char** argv) {
  using namespace ccslice;
  CLI::App app("Prints digests of layers, to compare two versions by");
  std::vector<std::string> models = oracle::sample_names();
  models.insert(models.end(), {"fertility_cmu.vtk", "lower_arm.vtk", "mixed_small.vtk"});
  double pitches = 4, longest_mm = 40;
  app.add_option("models", models, "Samples, files of CCSLICE_SHARED_MESHES_DIR, or absolute paths of mesh files")
      ->capture_default_str();
  app.add_option("--pitches", pitches, "Pitch, as a multiple of 0.0423 x 0.0846 x 0.03 mm")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--longest-mm", longest_mm, "Meshes from files are scaled to this length")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    for (const std::string& model : models) bench::print_digests(model, pitches, longest_mm);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "layer_digests: %s\n", error.what());
    return 2;
  }
}
