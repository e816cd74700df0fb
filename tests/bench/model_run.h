// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// One sample, sliced by our method and by the paper's, on the same layers in the same process.

#pragma once

#include <cstdint>
#include <string>

#include "tests/bench/literal_method.h"
#include "tests/bench/our_method.h"
#include "tests/bench/printer_job.h"
#include "tests/bench/served_job.h"

namespace ccslice::bench {

/// How much is looked at.
struct Sampling {
  std::uint32_t shape_layers;   // Contours and rasterization.
  std::uint32_t slab_runs;      // Materials, ours: runs of consecutive slabs, as a job has them,
  std::uint32_t slabs_a_run;    // so long, or as long as the model is high.
  std::uint32_t literal_slabs;  // Literal method: so many of these slabs,
  std::uint32_t bands_a_layer;  // of kBandRows rows, in kLiteralLayers layers of each.
  std::uint32_t single_rows;    // Without coherence, in each of these layers.
  double longest_whole_job_s;   // A job that would take longer is sliced in part.
};
inline constexpr Sampling kQuickSampling = {64, 3, 3, 3, 6, 1, 4};
inline constexpr Sampling kFullSampling = {1u << 30, 1, 1u << 16, 12, 12, 2, 1e9};

/// Single-thread costs of a set of layers, and what they came to.
struct ModelRun {
  std::string name;
  SolidSummary solid;
  GridExtent grid;
  double prepare_ns = 0;
  StageCost shape;      // Contours and rasterization of `shape.layers` layers.
  StageCost material;   // Materials of whole slabs, one after another.
  double exact_ns = 0;  // Materials with every voxel inverted (tolerance 0), of some layers of these slabs, ...
  std::uint64_t exact_voxels = 0;    // ... and their voxels.
  LiteralCost literal, literal_off;  // With and without coherence, of rows of the same slabs.
  double max_material_error = 0;     // Ours, as a share of the channel's range, over these rows.
  double max_residual_mm = 0;        // Of the exact inversions it was compared with.
  std::uint64_t compared = 0;        // Voxels.
  ServedCost job;

  double voxels() const;  // Of the whole model; extrapolated unless all layers were rasterized.
  double contour_ns_per_voxel() const { return shape.contour_ns / static_cast<double>(shape.voxels); }
  double raster_ns_per_voxel() const {
    return (shape.contour_ns + shape.raster_ns) / static_cast<double>(shape.voxels);
  }
  double material_ns_per_voxel() const { return material.material_ns / static_cast<double>(material.voxels); }
  double exact_material_ns_per_voxel() const { return exact_ns / static_cast<double>(exact_voxels); }
  double literal_raster_ns_per_voxel() const { return literal.winding_ns / static_cast<double>(literal.voxels); }
  double literal_material_ns_per_voxel() const { return literal.material_ns / static_cast<double>(literal.voxels); }
  /// Upload and preparation included; extrapolated by voxels if not all layers were sliced.
  double job_seconds() const;
  /// The literal method over our contours, perfectly parallel, without encoding and sending.
  double literal_job_seconds(int threads) const;
};

ModelRun run_model(const PrinterJob& job, const Sampling& sampling, JobServer& server, int threads);

/// [Luu19, Table 1]: one layer of the coyote, that whose number of voxels is next to the paper's. One thread.
struct SliceRun {
  std::uint32_t layer = 0;
  std::uint64_t voxels = 0;
  double contour_ns = 0, raster_ns = 0, material_ns = 0;  // Materials: the layer's share of its slab's, by voxels.
  LiteralCost with_coherence, without_coherence;          // Of some rows.
};

SliceRun run_slice(const PrinterJob& job, std::uint64_t wanted_voxels, const Sampling& sampling);

}  // namespace ccslice::bench
