// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The cell regions of voxels, which come from the contours of interfaces, against those of the cells that hold them,
// which inversion finds: a channel of the marked solid is the number of the region.

#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "tests/oracle/hostile/hostile_comparisons.h"
#include "tests/oracle/hostile/hostile_layers.h"
#include "tests/oracle/hostile/hostile_numbers.h"

namespace ccslice::oracle {
namespace {

constexpr std::size_t kMostMismatches = 200;  // Looked into, which takes milliseconds each.

/// On another side of an interface than the cell that holds it.
struct Mismatch {
  VoxelIndex at;
  int shown = 0, held_by = 0;  // Regions from 0.
};

class SideComparison {
 public:
  SideComparison(const HostileRun& run, HostileFinding& finding)
      : run_(run), finding_(finding), columns_(run.job.job.grid.extent.columns) {}

  void compare(const Layer& inverted) {
    const GridExtent& extent = run_.job.job.grid.extent;
    const PlaneSpec spec = inverting_job(*run_.marked, run_.job.job).planes[run_.region_plane()];
    const std::vector<std::uint8_t> numbers = numbers_of(spec, inverted.planes[run_.region_plane()], extent, {});
    for (std::uint32_t row = 0; row < extent.rows; ++row) {
      for (std::uint32_t column = 0; column < columns_; ++column) {
        compare({column, row, &inverted}, numbers[std::size_t{row} * columns_ + column]);
      }
    }
    compare_planes(run_.layer(inverted.index), numbers);
  }

  void look_into_mismatches() {
    const auto is_right = [&](const Mismatch& mismatch, const VoxelTruth& truth, TruthFinder& truths) {
      return is_near(mismatch, truth, truths);
    };
    const auto describe = [](const Mismatch& mismatch) {
      return voxel_text(mismatch.at) + " is of region " + std::to_string(mismatch.shown) +
             ", the cell that holds it of " + std::to_string(mismatch.held_by);
    };
    look_into(run_, mismatches_, kMostMismatches, is_right, describe, finding_);
  }

 private:
  void compare(const VoxelIndex& at, int number) {
    ++finding_.compared;
    const bool inside = bit_at(at.layer->planes[0], columns_, at.column, at.row);
    if (inside != (number > 0)) {
      note_failure(std::nullopt, finding_);
      finding_.where = voxel_text(at) + (inside ? " is inside, in no region" : " is outside, in a region");
    } else if (inside) {
      const int held_by = run_.solid->has_several_regions()
                              ? static_cast<int>(std::lround(inverted_value(run_, at, run_.solid->channel_count())))
                              : run_.solid->region_of(ControlCellId{0});
      if (held_by != number - 1) mismatches_.push_back({at, number - 1, held_by});
    }
  }

  /// Contours are as far off an interface as they may be off the boundary.
  bool is_near(const Mismatch& mismatch, const VoxelTruth& truth, TruthFinder& truths) const {
    const Vec3 centre = run_.centre(mismatch.at.column, mismatch.at.row, mismatch.at.layer->index);
    return truths.region_is_near(static_cast<std::uint8_t>(mismatch.shown), centre, truth,
                                 run_.job.job.contour_tolerance_mm);
  }

  /// The job's own planes show the same.
  void compare_planes(const Layer& layer, const std::vector<std::uint8_t>& numbers) {
    const std::vector<PlaneSpec>& planes = run_.job.job.planes;
    for (std::size_t i = 0; i < planes.size(); ++i) {
      if (planes[i].content != PlaneContent::kCellRegions) continue;
      ++finding_.compared;
      const auto palette = palette_of_plane(run_.job.job, planes[i], run_.solid->summary().cell_regions.size());
      if (numbers_of(planes[i], layer.planes[i], run_.job.job.grid.extent, palette) == numbers) continue;
      note_failure(std::nullopt, finding_);
      finding_.where = "plane " + std::to_string(i) + " in layer " + std::to_string(layer.index);
    }
  }

  const HostileRun& run_;
  HostileFinding& finding_;
  const std::uint32_t columns_;
  std::vector<Mismatch> mismatches_;
};

}  // namespace

void compare_regions(const HostileRun& run, HostileFinding& finding) {
  if (!run.has_regions()) return;
  SideComparison comparison(run, finding);
  for (const Layer& inverted : run.inverted) comparison.compare(inverted);
  comparison.look_into_mismatches();
}

}  // namespace ccslice::oracle
