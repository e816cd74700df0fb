// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What doesn't need the truth: the occupancy against winding numbers, voxels without parameters, bytes.

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "core/output/encode.h"
#include "tests/oracle/hostile_comparisons.h"
#include "tests/oracle/hostile_layers.h"
#include "tests/oracle/hostile_random.h"
#include "tests/oracle/slicing.h"

namespace ccslice::oracle {
namespace {

constexpr double kMostEdges = 1e7;             // Looked at for winding numbers in a layer.
constexpr double kRoundingAtContours = 1e-12;  // As far from a contour a voxel may be on either side.

std::string layer_text(const Layer& layer, const std::string& what) {
  return what + " in layer " + std::to_string(layer.index);
}

void fail(const std::string& where, HostileFinding& finding) {
  if (finding.failed++ == 0) finding.where = where;
}

/// The farthest that numbers of the grid are from 0: what rounding depends on.
double reach_mm(const Grid& grid) {
  return grid.part_box.min().cwiseAbs().cwiseMax(grid.part_box.max().cwiseAbs()).maxCoeff() +
         grid.part_box.sizes().maxCoeff();
}

void compare_winding(const HostileRun& run, const Layer& layer, HostileFinding& finding) {
  const GridExtent& extent = run.job.job.grid.extent;
  const std::vector<Polygon> polygons = polygons_of(layer.contours);
  double points = 1;
  for (const Polygon& polygon : polygons) points += static_cast<double>(polygon.size());
  const double all = static_cast<double>(extent.columns) * extent.rows,
               share = std::min(1.0, kMostEdges / points / all);
  HostileRandom random(run.seed, 5);
  for (std::uint32_t row = 0; row < extent.rows; ++row) {
    for (std::uint32_t column = 0; column < extent.columns; ++column) {
      if (share < 1 && !random.chance(share)) continue;
      const Vec2 centre = run.centre(column, row, layer.index).head<2>();
      const bool inside = winding_number(polygons, centre) != 0;
      ++finding.compared;
      if (inside == bit_at(layer.planes[0], extent.columns, column, row)) continue;
      if (distance_to(polygons, centre) < kRoundingAtContours * reach_mm(run.job.job.grid)) {
        ++finding.excused;
      } else {
        fail(layer_text(layer, "voxel " + std::to_string(column) + "," + std::to_string(row) +
                                   (inside ? " should be inside" : " should be outside")),
             finding);
      }
    }
  }
}

/// Voxels of a plane's row, of whole bytes each.
std::size_t voxel_bytes(const PlaneSpec& plane) { return sample_bytes(plane.sample_type, 1, 1, channel_count(plane)); }

bool is_crop(const PlaneSpec& plane, const Grid& grid, const VoxelRegion& region, const EncodedPlane& whole,
             const EncodedPlane& part) {
  for (std::uint32_t row = 0; row < region.extent.rows; ++row) {
    for (std::uint32_t column = 0; column < region.extent.columns; ++column) {
      const std::uint32_t x = region.first_column + column, y = region.first_row + row;
      if (plane.content == PlaneContent::kOccupancy) {
        if (bit_at(whole, grid.extent.columns, x, y) != bit_at(part, region.extent.columns, column, row)) return false;
        continue;
      }
      const std::size_t size = voxel_bytes(plane);
      const std::size_t from = (std::size_t{y} * grid.extent.columns + x) * size;
      const std::size_t to = (std::size_t{row} * region.extent.columns + column) * size;
      if (std::memcmp(&whole.bytes[from], &part.bytes[to], size) != 0) return false;
    }
  }
  return true;
}

void compare_layers(const HostileRun& run, const std::vector<Layer>& others, const std::string& what,
                    HostileFinding& finding) {
  for (const Layer& other : others) {
    const Layer& layer = run.layer(other.index);
    for (std::size_t plane = 0; plane < layer.planes.size(); ++plane) {
      ++finding.compared;
      if (layer.planes[plane].bytes == other.planes[plane].bytes) continue;
      fail(layer_text(layer, "plane " + std::to_string(plane)) + ", " + what, finding);
    }
  }
}

void compare_split(const HostileRun& run, HostileFinding& finding) {
  HostileRandom random(run.seed, 6);
  const HostileJob& job = run.job;
  const auto first = static_cast<std::uint32_t>(random.bits() % job.layer_count);  // Maybe none.
  const std::string what = "split after " + std::to_string(first);
  if (first == 0) return;
  compare_layers(run, slice_layers(run.solid, job.job, job.first_layer + first, job.layer_count - first), what,
                 finding);
  compare_layers(run, slice_layers(run.solid, job.job, job.first_layer, first), what, finding);
}

void compare_region(const HostileRun& run, HostileFinding& finding) {
  if (!run.job.region) return;
  const VoxelRegion& region = *run.job.region;
  SliceJob job = run.job.job;
  job.region = region;
  for (const Layer& part : slice_layers(run.solid, job, region.first_layer, region.extent.layers)) {
    for (std::size_t plane = 0; plane < part.planes.size(); ++plane) {
      ++finding.compared;
      if (is_crop(job.planes[plane], job.grid, region, run.layer(part.index).planes[plane], part.planes[plane]))
        continue;
      fail(layer_text(part, "plane " + std::to_string(plane)) + " of the region", finding);
    }
  }
}

}  // namespace

Vec3 HostileRun::centre(std::uint32_t column, std::uint32_t row, std::uint32_t layer) const {
  const Grid& grid = job.job.grid;
  return {grid.origin_mm.x() + (column + 0.5) * grid.pitch.x_mm, grid.origin_mm.y() + (row + 0.5) * grid.pitch.y_mm,
          grid.layer_z_mm(layer)};
}

int HostileRun::winding(const Layer& layer, std::uint32_t column, std::uint32_t row) const {
  return winding_number(polygons_of(layer.contours), centre(column, row, layer.index).head<2>());
}

void compare_occupancy(const HostileRun& run, HostileFinding& finding) {
  if (run.inverted.empty()) return;
  compare_winding(run, run.inverted[run.inverted.size() / 2], finding);
  for (const Layer& inverted : run.inverted) {
    const Layer& layer = run.layer(inverted.index);
    for (std::size_t plane = 0; plane < layer.planes.size(); ++plane) {
      if (run.job.job.planes[plane].content != PlaneContent::kOccupancy) continue;
      ++finding.compared;
      if (layer.planes[plane].bytes != inverted.planes[0].bytes) fail(layer_text(layer, "the plane"), finding);
    }
  }
}

void count_unresolved(const HostileRun& run, HostileFinding& finding) {
  std::uint64_t unresolved = 0;
  for (const std::vector<Layer>* layers : {&run.inverted, &run.layers}) {
    for (const Layer& layer : *layers) {
      finding.compared += layer.stats.voxels_inside;
      if (layer.stats.voxels_unresolved > 0 && unresolved == 0) {
        finding.where = layer_text(layer, std::to_string(layer.stats.voxels_unresolved)) +
                        (layers == &run.inverted ? ", inverted" : ", interpolated");
      }
      unresolved += layer.stats.voxels_unresolved;
    }
  }
  const SolidSummary& summary = run.solid->summary();
  (summary.folding_cells + summary.undecided_cells > 0 ? finding.excused : finding.failed) = unresolved;
  finding.worst = static_cast<double>(unresolved);
}

void compare_bytes(const HostileRun& run, HostileFinding& finding) {
  const HostileJob& job = run.job;
  compare_layers(run, slice_layers(run.solid, job.job, job.first_layer, job.layer_count, 2), "2 threads", finding);
  compare_split(run, finding);
  compare_region(run, finding);
}

}  // namespace ccslice::oracle
