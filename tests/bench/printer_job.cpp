// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/bench/printer_job.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "core/job/validate_job.h"
#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "tests/bench/clocks.h"

namespace ccslice::bench {

PrinterJob make_printer_job(std::string name, ControlMesh mesh, const VoxelPitch& pitch) {
  PrinterJob result;
  result.name = std::move(name);
  result.mesh = std::move(mesh);
  result.solid = timed(result.prepare_ns, [&] { return prepare_solid(result.mesh); });
  GridRequest request;
  request.pitch = pitch;
  result.job.grid = plan_grid(*result.solid, result.job.placement, request);
  result.job.planes.resize(2);
  result.job.planes[1].content = PlaneContent::kChannel;
  result.job.planes[1].channel = result.mesh.channel_names.at(0);
  result.job.planes[1].sample_type = SampleType::kUint8;
  validate_job(*result.solid, result.job);
  return result;
}

PrinterJob sample_printer_job(const std::string& name) {
  if (const SampleModel* model = find_sample_model(name)) return make_printer_job(name, model->make());
  std::string known;
  for (const SampleModel& model : sample_models()) known += " " + std::string(model.name);
  throw std::runtime_error("there is no sample " + name + "; samples:" + known);
}

std::vector<std::uint32_t> spread_slabs(const Grid& grid, std::uint32_t count) {
  const std::uint32_t slabs = (grid.extent.layers + kSlabLayers - 1) / kSlabLayers;
  std::vector<std::uint32_t> first_layers = spread(slabs, count);
  for (std::uint32_t& slab : first_layers) slab *= kSlabLayers;
  return first_layers;
}

std::vector<std::vector<std::uint32_t>> spread_slab_runs(const Grid& grid, std::uint32_t runs,
                                                         std::uint32_t slabs_a_run) {
  const std::uint32_t slabs = (grid.extent.layers + kSlabLayers - 1) / kSlabLayers;
  const std::uint32_t length = std::min(slabs, slabs_a_run);
  std::vector<std::vector<std::uint32_t>> result;
  for (const std::uint32_t first : spread(slabs - length + 1, runs)) {
    std::vector<std::uint32_t>& run = result.emplace_back();
    for (std::uint32_t slab = first; slab < first + length; ++slab) run.push_back(slab * kSlabLayers);
  }
  return result;
}

std::vector<std::uint32_t> spread(std::uint32_t total, std::uint32_t count) {
  constexpr double kGoldenRatio = 0.6180339887498949;
  std::vector<std::uint32_t> places;
  if (count >= total) {
    for (std::uint32_t i = 0; i < total; ++i) places.push_back(i);
    return places;
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    const double turns = 0.5 + i * kGoldenRatio;
    places.push_back(static_cast<std::uint32_t>((turns - std::floor(turns)) * total));
  }
  std::sort(places.begin(), places.end());
  places.erase(std::unique(places.begin(), places.end()), places.end());
  return places;
}

}  // namespace ccslice::bench
