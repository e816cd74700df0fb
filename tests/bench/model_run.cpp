// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/bench/model_run.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/slicer/layer_slicer.h"
#include "tests/bench/clocks.h"

namespace ccslice::bench {
namespace {

constexpr std::uint32_t kBandRows = 3;
constexpr std::uint32_t kLiteralLayers[] = {3, 11};  // Of a slab.
constexpr std::uint32_t kSlabsAThread = 2;           // Of jobs that are sliced in part.

/// Compares interpolated values of one row with exact inversion.
void compare_row(OurMethod& ours, const LayerShape& shape, const std::vector<float>& values, std::uint32_t row,
                 const ChannelRange& channel, ModelRun& run) {
  std::vector<double> exact(run.solid.channels.size());
  const double range = std::max(channel.max - channel.min, 1e-30);
  std::optional<CellParam> hint;
  for (const VoxelRun& span : shape.spans) {
    if (span.row != row) continue;
    for (std::uint32_t x = span.begin; x < span.end; ++x) {
      const auto found = ours.field().invert(ours.lattice().centre(x, row, shape.z_mm), hint);
      if (!found) continue;
      hint = found->at;
      ours.field().mat(found->at, exact);
      const double error = std::abs(values[std::size_t{row} * ours.lattice().width + x] - exact[0]) / range;
      run.max_material_error = std::max(run.max_material_error, error);
      run.max_residual_mm = std::max(run.max_residual_mm, found->residual_mm);
      ++run.compared;
    }
  }
}

void run_rows(OurMethod& ours, LiteralMethod& literal, const LayerShape& shape, const Sampling& sampling,
              ModelRun& run) {
  const std::vector<float> values = ours.values(shape);
  for (const std::uint32_t row : spread(run.grid.rows - kBandRows, sampling.bands_a_layer)) {
    run.literal += literal.run_band(shape, row, kBandRows, true);
    for (std::uint32_t r = row; r < row + kBandRows; ++r) {
      compare_row(ours, shape, values, r, run.solid.channels[0], run);
    }
  }
  for (const std::uint32_t row : spread(run.grid.rows, sampling.single_rows)) {
    run.literal_off += literal.run_band(shape, row, 1, false);
  }
}

/// What LayerSlicer takes for a layer with every voxel inverted, less contours and rasterization. (The checksum of the
/// samples counts as materials here: about 1 ns a voxel.)
void run_exactly(const PrinterJob& job, OurMethod& ours, std::uint32_t layer, ModelRun& run) {
  SliceJob exact = job.job;
  exact.planes.erase(exact.planes.begin());
  exact.planes[0].encoding = Encoding::kRaw;
  exact.channel_tolerance = 0;
  LayerSlicer slicer(job.solid, exact);
  StageCost shape;
  run.exact_voxels += ours.shape(layer, shape).voxels;
  timed(run.exact_ns, [&] { return slicer.slice(layer, {}); });
  run.exact_ns -= shape.contour_ns + shape.raster_ns;
}

/// Consecutive slabs; some of them by the literal method, too.
void run_slabs(const PrinterJob& job, OurMethod& ours, LiteralMethod& literal, const std::vector<std::uint32_t>& slabs,
               const Sampling& sampling, ModelRun& run) {
  const std::vector<std::uint32_t> chosen =
      spread(static_cast<std::uint32_t>(slabs.size()), sampling.literal_slabs / sampling.slab_runs);
  for (std::uint32_t s = 0; s < slabs.size(); ++s) {
    const std::vector<LayerShape> slab = ours.shape_slab(slabs[s], run.material);
    ours.run_materials(slab, run.material);
    if (!std::binary_search(chosen.begin(), chosen.end(), s)) continue;
    run_exactly(job, ours, slab.back().layer, run);
    for (const std::uint32_t k : kLiteralLayers) {
      if (k < slab.size()) run_rows(ours, literal, slab[k], sampling, run);
    }
  }
}

/// A range round the middle, of as many whole slabs as keep all threads busy.
LayerRange middle_range(const Grid& grid, int threads) {
  const std::uint32_t layers = grid.extent.layers;
  const std::uint32_t count = std::min(layers, static_cast<std::uint32_t>(threads) * kSlabsAThread * kSlabLayers);
  const std::uint32_t first = (layers - count) / 2;
  return {first - first % kSlabLayers, count};
}

ServedCost run_job(const PrinterJob& job, const Sampling& sampling, JobServer& server, int threads, double voxels) {
  const LayerRange part = middle_range(job.job.grid, threads), whole = {0, job.job.grid.extent.layers};
  const ServedCost cost = server.run(job, part);
  const double whole_s = cost.slice_seconds * voxels / static_cast<double>(std::max<std::uint64_t>(cost.voxels, 1));
  if (part.count == whole.count || whole_s > sampling.longest_whole_job_s) return cost;
  ServedCost all = server.run(job, whole);
  all.upload_seconds = cost.upload_seconds;
  return all;
}

}  // namespace

double ModelRun::voxels() const {
  return static_cast<double>(shape.voxels) * grid.layers / static_cast<double>(shape.layers);
}

double ModelRun::job_seconds() const {
  const double share = job.layers == grid.layers ? 1 : static_cast<double>(job.voxels) / voxels();
  return job.upload_seconds + job.slice_seconds / share;
}

double ModelRun::literal_job_seconds(int threads) const {
  const double ns = contour_ns_per_voxel() + literal_raster_ns_per_voxel() + literal_material_ns_per_voxel();
  return 1e-9 * ns * voxels() / threads;
}

ModelRun run_model(const PrinterJob& job, const Sampling& sampling, JobServer& server, int threads) {
  ModelRun run;
  run.name = job.name;
  run.solid = job.solid->summary();
  run.grid = job.job.grid.extent;
  run.prepare_ns = job.prepare_ns;
  OurMethod ours(job);
  LiteralMethod literal(job);
  for (const std::uint32_t layer : spread(run.grid.layers, sampling.shape_layers)) ours.shape(layer, run.shape);
  for (const std::vector<std::uint32_t>& slabs :
       spread_slab_runs(job.job.grid, sampling.slab_runs, sampling.slabs_a_run)) {
    run_slabs(job, ours, literal, slabs, sampling, run);
  }
  run.job = run_job(job, sampling, server, threads, run.voxels());
  return run;
}

SliceRun run_slice(const PrinterJob& job, std::uint64_t wanted_voxels, const Sampling& sampling) {
  OurMethod ours(job);
  LiteralMethod literal(job);
  StageCost scan, slab_cost;
  const auto distance = [&](const LayerShape& shape) {
    return std::abs(static_cast<double>(shape.voxels) - static_cast<double>(wanted_voxels));
  };
  LayerShape best;
  for (const std::uint32_t layer : spread(job.job.grid.extent.layers, sampling.shape_layers)) {
    LayerShape shape = ours.shape(layer, scan);
    if (best.voxels == 0 || distance(shape) < distance(best)) best = std::move(shape);
  }
  StageCost own;
  best = ours.shape(best.layer, own);
  ours.run_materials(ours.shape_slab(best.layer - best.layer % kSlabLayers, slab_cost), slab_cost);
  const double share = static_cast<double>(best.voxels) / static_cast<double>(slab_cost.voxels);
  SliceRun run{best.layer, best.voxels, own.contour_ns, own.raster_ns, slab_cost.material_ns * share, {}, {}};
  const std::uint32_t rows = job.job.grid.extent.rows;
  for (const std::uint32_t row : spread(rows - kBandRows, 2 * sampling.bands_a_layer)) {
    run.with_coherence += literal.run_band(best, row, kBandRows, true);
  }
  for (const std::uint32_t row : spread(rows, 2 * sampling.bands_a_layer)) {
    run.without_coherence += literal.run_band(best, row, 1, false);
  }
  return run;
}

}  // namespace ccslice::bench
