// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Single voxels of hostile jobs: where they are, and what the truth about them is.

#include <cstddef>
#include <string>

#include "tests/oracle/hostile/hostile_comparisons.h"
#include "tests/oracle/hostile/hostile_layers.h"
#include "tests/oracle/hostile/hostile_text.h"
#include "tests/oracle/slicing.h"

namespace ccslice::oracle {

Vec3 HostileRun::centre(std::uint32_t column, std::uint32_t row, std::uint32_t layer) const {
  const Grid& grid = job.job.grid;
  return {grid.origin_mm.x() + (column + 0.5) * grid.pitch.x_mm, grid.origin_mm.y() + (row + 0.5) * grid.pitch.y_mm,
          grid.layer_z_mm(layer)};
}

int HostileRun::winding(const Layer& layer, std::uint32_t column, std::uint32_t row) const {
  return winding_number(polygons_of(layer.contours), centre(column, row, layer.index).head<2>());
}

TruthFinder truths_of(const HostileRun& run) {
  return {run.solid, run.job.job.placement, run.job.job.contour_tolerance_mm + kOutsideSlackMm};
}

std::optional<VoxelTruth> find_truth(TruthFinder& truths, const HostileRun& run, const VoxelIndex& at) {
  std::optional<VoxelTruth> truth = truths.find(run.centre(at.column, at.row, at.layer->index));
  if (truth && truth->place == VoxelPlace::kInside && run.winding(*at.layer, at.column, at.row) != 1) {
    truth->place = VoxelPlace::kAmbiguous;
  }
  return truth;
}

double inverted_value(const HostileRun& run, const VoxelIndex& at, std::uint32_t channel) {
  const std::size_t voxel = std::size_t{at.row} * run.job.job.grid.extent.columns + at.column;
  return ChannelSamples().value(at.layer->planes[1 + channel], voxel);
}

void note_failure(const std::optional<VoxelTruth>& truth, HostileFinding& finding) {
  ++finding.failed;
  ++finding.failed_at[static_cast<std::size_t>(truth ? truth->place : VoxelPlace::kNowhere)];
}

std::string place_text(const std::optional<VoxelTruth>& truth) {
  if (!truth) return ", no parameter";
  std::string text = ", cell " + std::to_string(truth->at.cell) + " at " + number(truth->at.uvw.x()) + "," +
                     number(truth->at.uvw.y()) + "," + number(truth->at.uvw.z()) + ", " + to_text(truth->place);
  if (truth->place == VoxelPlace::kOff) text += " by " + number(truth->residual_mm) + " mm";
  return text;
}

std::string voxel_text(const VoxelIndex& at) {
  return "voxel " + std::to_string(at.column) + "," + std::to_string(at.row) + "," + std::to_string(at.layer->index);
}

}  // namespace ccslice::oracle
