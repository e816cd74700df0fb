// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The stages of LayerSlicer one by one, on one thread, so that each can be timed and looked into.

#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "core/contour/contour_tracer.h"
#include "core/field/contone.h"
#include "core/field/material_field.h"
#include "core/interpolation/slab_materials.h"
#include "core/raster/occupancy.h"
#include "tests/bench/printer_job.h"

namespace ccslice::bench {

inline constexpr double kDefaultTolerance = 1.0 / 1024;  // LayerSlicer's for 8 bits.

/// CPU time of the stages.
struct StageCost {
  double contour_ns = 0, raster_ns = 0, material_ns = 0;
  std::uint64_t layers = 0, voxels = 0;
};

struct LayerShape {
  std::uint32_t layer = 0;
  double z_mm = 0;
  Contours contours;
  std::vector<VoxelRun> spans;
  std::uint64_t voxels = 0;
};

std::uint64_t count_voxels(std::span<const VoxelRun> spans);

class OurMethod {
 public:
  /// Materials of the first `channels` channels, each within `tolerance` of its range.
  explicit OurMethod(const PrinterJob& job, double tolerance = kDefaultTolerance, std::uint32_t channels = 1);

  Contours trace(std::uint32_t layer);
  /// Contours, rasterization and the occupancy's bitmap of one layer.
  LayerShape shape(std::uint32_t layer, StageCost& cost);
  /// The same of a whole slab.
  std::vector<LayerShape> shape_slab(std::uint32_t first_layer, StageCost& cost);
  /// Fits the materials of the slab, which has to stay where it is until the next one.
  void solve_materials(std::span<const LayerShape> slab);
  /// The same, timed, and paints channel 0 as 8-bit samples.
  void run_materials(std::span<const LayerShape> slab, StageCost& cost);
  /// The 8-bit samples of channel 0 of one layer of the slab that was solved last, valid until the next call.
  SampleImage paint_bytes(const LayerShape& shape);
  /// The values of one layer of the slab that was solved last, voxel by voxel, before they become integers.
  /// REQUIRES: one of the channels asked for.
  std::vector<float> values(const LayerShape& shape, std::uint32_t channel = 0);

  /// Voxels painted since the last call, by how they got their material.
  LayerStats take_stats() { return std::exchange(stats_, {}); }
  MaterialField& field() { return *field_; }
  const LayerLattice& lattice() const { return lattice_; }

 private:
  void paint(const LayerShape& shape, ContonePlane& plane);

  const PrinterJob& job_;
  LayerLattice lattice_;
  ContourTracer tracer_;
  std::unique_ptr<MaterialField> field_;
  SlabMaterials slabs_;
  std::span<const LayerShape> slab_;  // That was solved last.
  ContonePlane bytes_;
  std::vector<ContonePlane> floats_;  // By channel.
  LayerStats stats_;
};

}  // namespace ccslice::bench
