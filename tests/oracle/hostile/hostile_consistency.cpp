// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What doesn't need the truth: the occupancy against winding numbers, voxels without parameters, bytes.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "core/output/encode.h"
#include "tests/oracle/hostile/hostile_comparisons.h"
#include "tests/oracle/hostile/hostile_layers.h"
#include "tests/oracle/hostile/hostile_numbers.h"
#include "tests/oracle/hostile/hostile_pictures.h"
#include "tests/oracle/hostile/hostile_random.h"
#include "tests/oracle/hostile/hostile_strict.h"
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

/// Voxels outside have the plane's sample for them.
void compare_outside(const HostileRun& run, const Layer& layer, std::size_t plane, HostileFinding& finding) {
  const PlaneSpec& spec = run.job.job.planes[plane];
  const std::uint32_t columns = run.job.job.grid.extent.columns;
  const auto whole = static_cast<std::uint32_t>(spec.sample_type == SampleType::kFloat32 ? 0 : spec.outside_sample);
  const auto sample = std::bit_cast<std::array<std::uint8_t, 4>>(
      spec.sample_type == SampleType::kFloat32 ? std::bit_cast<std::uint32_t>(static_cast<float>(spec.outside_sample))
                                               : whole);
  const std::size_t size = sample_bytes(spec.sample_type, 1, 1), channels = channel_count(spec);
  const std::vector<std::uint8_t>& bytes = layer.planes[plane].bytes;
  for (std::size_t i = 0; i < bytes.size() / size; ++i) {
    const auto voxel = static_cast<std::uint32_t>(i / channels);
    if (bit_at(layer.planes.back(), columns, voxel % columns, voxel / columns)) continue;
    ++finding.compared;
    if (std::memcmp(&bytes[i * size], sample.data(), size) == 0) continue;
    fail(layer_text(layer, "plane " + std::to_string(plane) + " outside"), finding);
  }
}

/// Voxels of a plane's row, of whole bytes each.
std::size_t voxel_bytes(const PlaneSpec& plane) { return sample_bytes(plane.sample_type, 1, 1, channel_count(plane)); }

/// Of `size` bytes a voxel.
bool is_crop(std::span<const std::uint8_t> whole, std::span<const std::uint8_t> part, std::size_t size,
             const Grid& grid, const VoxelBox& region) {
  for (std::uint32_t row = 0; row < region.extent.rows; ++row) {
    const std::size_t y = region.first_row + row;
    const std::size_t from = (y * grid.extent.columns + region.first_column) * size;
    const std::size_t to = std::size_t{row} * region.extent.columns * size;
    if (std::memcmp(&whole[from], &part[to], region.extent.columns * size) != 0) return false;
  }
  return true;
}

/// Pictures' bytes depend on all of their voxels, so numbers are read and compared.
bool is_crop(const HostileRun& run, const PlaneSpec& plane, const EncodedPlane& whole, const EncodedPlane& part) {
  const Grid& grid = run.job.job.grid;
  const VoxelBox& region = *run.job.region;
  if (!shows_numbers(plane)) return is_crop(whole.bytes, part.bytes, voxel_bytes(plane), grid, region);
  const std::vector<std::uint32_t> palette =
      palette_of_plane(run.job.job, plane, run.solid->summary().cell_regions.size());
  return is_crop(numbers_of(plane, whole, grid.extent, palette), numbers_of(plane, part, region.extent, palette), 1,
                 grid, region);
}

bool has_same_contours(const Layer& a, const Layer& b) {
  const auto is_same_loop = [](const ContourLoop& x, const ContourLoop& y) {
    return std::ranges::equal(x.points, y.points, {}, &ContourPoint::xy, &ContourPoint::xy);
  };
  const auto is_same_region_loop = [](const RegionLoop& x, const RegionLoop& y) {
    return x.region == y.region && x.points == y.points;
  };
  return std::ranges::equal(a.contours.loops, b.contours.loops, is_same_loop) &&
         std::ranges::equal(a.region_loops, b.region_loops, is_same_region_loop);
}

void compare_layers(const HostileRun& run, const std::vector<Layer>& others, const std::string& what,
                    HostileFinding& finding) {
  for (const Layer& other : others) {
    const Layer& layer = run.delivered[other.index - run.job.first_layer];
    if (!has_same_contours(layer, other)) fail(layer_text(layer, "the contours") + ", " + what, finding);
    for (std::size_t plane = 0; plane < layer.planes.size(); ++plane) {
      ++finding.compared;
      if (layer.planes[plane].bytes == other.planes[plane].bytes) continue;
      fail(layer_text(layer, "plane " + std::to_string(plane)) + ", " + what, finding);
    }
    if (layer.stats.material_voxels != other.stats.material_voxels) {
      fail(layer_text(layer, "the count of materials") + ", " + what, finding);
    }
  }
}

void compare_split(const HostileRun& run, HostileFinding& finding) {
  HostileRandom random(run.seed, 6);
  const HostileJob& job = run.job;
  const auto first = static_cast<std::uint32_t>(random.bits() % job.layer_count);  // Maybe none.
  const std::string what = "split after " + std::to_string(first);
  if (first == 0) return;
  const SliceJob asked = without_strict_maps(job.asked);
  compare_layers(run, slice_layers(run.solid, asked, job.first_layer + first, job.layer_count - first), what, finding);
  compare_layers(run, slice_layers(run.solid, asked, job.first_layer, first), what, finding);
}

void compare_region(const HostileRun& run, HostileFinding& finding) {
  if (!run.job.region) return;
  const VoxelBox& region = *run.job.region;
  SliceJob job = without_strict_maps(run.job.asked);
  job.region = region;
  for (const Layer& delivered : slice_layers(run.solid, job, region.first_layer, region.extent.layers)) {
    const Layer part = read_pictures(run.solid->summary(), job, delivered, region.extent, finding);
    for (std::size_t plane = 0; plane < part.planes.size(); ++plane) {
      ++finding.compared;
      if (is_crop(run, run.job.job.planes[plane], run.layer(part.index).planes[plane], part.planes[plane])) continue;
      fail(layer_text(part, "plane " + std::to_string(plane)) + " of the region", finding);
    }
  }
}

}  // namespace

void compare_occupancy(const HostileRun& run, HostileFinding& finding) {
  if (run.inverted.empty()) return;
  compare_winding(run, run.inverted[run.inverted.size() / 2], finding);
  for (const Layer& inverted : run.inverted) {
    const Layer& layer = run.layer(inverted.index);
    for (std::size_t plane = 0; plane < layer.planes.size(); ++plane) {
      if (!shows_numbers(run.job.job.planes[plane])) compare_outside(run, layer, plane, finding);
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
  compare_layers(run, slice_layers(run.solid, without_strict_maps(job.asked), job.first_layer, job.layer_count, 2),
                 "2 threads", finding);
  compare_split(run, finding);
  compare_region(run, finding);
}

}  // namespace ccslice::oracle
