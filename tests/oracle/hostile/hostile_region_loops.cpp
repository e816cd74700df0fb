// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Contours that are delivered. Those of cell regions are joined from edges; this knows no edges: it asks how often the
// loops of each region wind round voxels, whose regions are compared with the cells that hold them elsewhere
// (hostile_sides.cpp), and what area they have.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "tests/oracle/hostile/hostile_comparisons.h"
#include "tests/oracle/hostile/hostile_layers.h"
#include "tests/oracle/hostile/hostile_random.h"
#include "tests/oracle/hostile/hostile_text.h"
#include "tests/oracle/slicing.h"

namespace ccslice::oracle {
namespace {

constexpr std::uint64_t kVoxelStream = 13;    // Of random numbers.
constexpr double kMostEdgesALayer = 1e6;      // Looked at for winding numbers.
constexpr double kRoundingOfContours = 1e-9;  // Of the farthest coordinate: as far from a loop a voxel may be anything.
constexpr double kRoundingOfArea = 1e-9;      // Of the area of the box round everything, from the origin.

double area_of(const Polygon& polygon) {
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2 a = polygon[i] - polygon[0], b = polygon[(i + 1) % polygon.size()] - polygon[0];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return twice / 2;
}

class ContourComparison {
 public:
  ContourComparison(const HostileRun& run, HostileFinding& finding)
      : run_(run), finding_(finding), extent_(run.job.job.grid.extent), random_(run.seed, kVoxelStream) {
    const Box3& box = run.job.job.grid.part_box;
    reach_mm_ = box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).maxCoeff();
    const SolidSummary& summary = run.solid->summary();
    folds_ = summary.folding_cells + summary.undecided_cells > 0;
  }

  void compare_whole(const Layer& delivered, const Layer& inverted) {
    ++finding_.compared;
    const bool same = polygons_of(delivered.contours) == polygons_of(inverted.contours);
    if (!same) fail(delivered, "other contours than with every voxel inverted");
  }

  void compare_by_region(const Layer& delivered, const Layer& inverted) {
    ++finding_.compared;
    if (!delivered.contours.loops.empty()) fail(delivered, "contours of the whole besides those by region");
    std::vector<std::vector<Polygon>> regions(run_.solid->summary().cell_regions.size());
    double area = 0, points = 1;
    for (const RegionLoop& loop : delivered.region_loops) {
      if (loop.region >= regions.size() || loop.points.size() < 3) return fail(delivered, "a loop that is none");
      regions[loop.region].push_back(loop.points);
      area += area_of(loop.points);
      points += static_cast<double>(loop.points.size());
    }
    compare_area(delivered, inverted, area);
    const double share = std::min(1.0, kMostEdgesALayer / points / extent_.columns / extent_.rows);
    for (std::uint32_t row = 0; row < extent_.rows; ++row) {
      for (std::uint32_t column = 0; column < extent_.columns; ++column) {
        if (share == 1 || random_.chance(share)) compare_voxel(regions, {column, row, &inverted});
      }
    }
  }

 private:
  void compare_area(const Layer& delivered, const Layer& inverted, double area) {
    double whole = 0;
    for (const Polygon& polygon : polygons_of(inverted.contours)) whole += area_of(polygon);
    ++finding_.compared;
    if (std::abs(area - whole) <= kRoundingOfArea * reach_mm_ * reach_mm_) return;
    fail(delivered, "regions of " + number(area) + " mm2 together, the whole has " + number(whole));
  }

  /// Loops of the voxel's region have to wind round it once, those of other regions not at all.
  void compare_voxel(const std::vector<std::vector<Polygon>>& regions, const VoxelIndex& at) {
    const std::size_t shown =
        at.layer->planes[run_.region_plane()].bytes[std::size_t{at.row} * extent_.columns + at.column];
    const Vec2 centre = run_.centre(at.column, at.row, at.layer->index).head<2>();
    ++finding_.compared;
    for (std::size_t region = 0; region < regions.size(); ++region) {
      const int winding = winding_number(regions[region], centre), expected = shown == region + 1 ? 1 : 0;
      if (winding == expected || distance_to(regions[region], centre) < kRoundingOfContours * reach_mm_) continue;
      return fail(*at.layer, voxel_text(at) + " of region " + std::to_string(shown) + ", and region " +
                                 std::to_string(region + 1) + " winds round it " + std::to_string(winding) + " times");
    }
  }

  void fail(const Layer& layer, const std::string& what) {
    if (folds_) {
      ++finding_.excused;
    } else if (finding_.failed++ == 0) {
      finding_.where = "layer " + std::to_string(layer.index) + ": " + what;
    }
  }

  const HostileRun& run_;
  HostileFinding& finding_;
  const GridExtent extent_;
  HostileRandom random_;
  double reach_mm_ = 0;
  bool folds_ = false;
};

}  // namespace

void compare_contours(const HostileRun& run, HostileFinding& finding) {
  const SliceJob& asked = run.job.asked;
  if (!asked.contours) return;
  ContourComparison comparison(run, finding);
  for (const Layer& inverted : run.inverted) {
    const Layer& delivered = run.delivered[inverted.index - run.job.first_layer];
    if (asked.contours_by_cell_region) {
      comparison.compare_by_region(delivered, inverted);
    } else {
      comparison.compare_whole(delivered, inverted);
    }
  }
}

}  // namespace ccslice::oracle
