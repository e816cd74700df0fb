// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Printed materials. Of every layer: one material in each voxel inside, none outside, and all planes and the count
// agree. Of the inverted layers: each voxel's material is one that the map of its cell region may give it, for channels
// as far from the inverted ones as the tolerance lets them be; and so it is where every voxel is inverted.
//
// Which of a mix's materials a voxel takes is known for thresholds and for the largest fraction. Error diffusion may
// take any that isn't absent; over a layer it keeps to the fractions, but for what is lost at edges.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "core/channel/channel_table.h"
#include "core/printing/blue_noise_mask.h"
#include "core/printing/halftone.h"
#include "core/printing/voxel_hash.h"
#include "tests/oracle/hostile/hostile_comparisons.h"
#include "tests/oracle/hostile/hostile_layers.h"
#include "tests/oracle/hostile/hostile_maps.h"
#include "tests/oracle/hostile/hostile_numbers.h"
#include "tests/oracle/hostile/hostile_text.h"

namespace ccslice::oracle {
namespace {

constexpr std::size_t kMostOddVoxels = 1000;  // Looked into.
constexpr double kRoundingOfThresholds = 1e-6;
constexpr double kErrorsAtEdge = 0.15, kErrorsLeft = 4;  // Lost with each voxel at an edge, and in all: measured.

using Numbers = std::vector<std::uint8_t>;

/// The thresholds that mixes are compared with, by voxel.
class Thresholds {
 public:
  Thresholds(const Printing& printing, const VoxelPitch& pitch) : halftone_(printing.halftone) {
    if (const auto shape = mask_shape(printing, pitch.x_mm, pitch.y_mm, pitch.z_mm)) mask_ = shared_mask(*shape);
  }

  double at(const VoxelIndex& at) const {
    const std::uint32_t layer = at.layer->index;
    if (mask_) {
      return mask_->row(at.row + shift(1), layer + shift(2))[(at.column + shift(0)) % kMaskEdge];
    }
    return ((random_bits(row_key(halftone_.seed, at.row, layer), at.column) >> 14) + 0.5) * 0x1p-18;
  }

 private:
  std::uint32_t shift(std::uint64_t axis) const {
    if (halftone_.seed == 0) return 0;
    return static_cast<std::uint32_t>(mix64(mix64(halftone_.seed) + axis) % kMaskEdge);
  }

  const Halftone halftone_;
  std::shared_ptr<const BlueNoiseMask> mask_;
};

/// A voxel's number that its map doesn't seem to give.
struct OddVoxel {
  VoxelIndex at;
  std::uint8_t number = 0;
  bool interpolated = false;
};

/// The sums of mixes over a layer, for error diffusion.
struct LayerMix {
  std::array<Interval, kMaxPrintMaterials> shares{};
  std::array<double, kMaxPrintMaterials> voxels{};
  double edge_voxels = 0;
};

class PrintedComparison {
 public:
  PrintedComparison(const HostileRun& run, HostileFinding& finding)
      : run_(run),
        printing_(*run.job.job.printing),
        extent_(run.job.job.grid.extent),
        finding_(finding),
        thresholds_(printing_, run.job.job.grid.pitch) {
    const auto colours = colour_table_of(printing_);
    for (const MaterialMap* map : maps_of(printing_)) maps_.emplace_back(printing_, *map, colours);
    for (std::size_t i = 0; i < printing_.cell_region_maps.size(); ++i) {
      map_of_region_[printing_.cell_region_maps[i].cell_region] = i + 1;
    }
    for (std::uint32_t c = 0; c < run.solid->channel_count(); ++c) {
      tolerances_.push_back(tolerance_of(run.solid->summary(), run.job.job, c));
    }
  }

  void compare(const Layer& inverted) {
    Numbers regions;
    if (run_.has_regions()) regions = bytes_of(inverted, run_.region_plane());
    compare(inverted, regions, bytes_of(inverted, inverted.planes.size() - 1), false);
    HostileFinding ignored;  // What isn't shown is known to have failed already.
    compare(inverted, regions, shown_materials(run_.layer(inverted.index), ignored), true);
  }

  /// The material of each voxel, as all planes show it.
  Numbers shown_materials(const Layer& layer, HostileFinding& finding) const {
    const std::vector<PlaneSpec>& planes = run_.job.job.planes;
    std::vector<Numbers> shown;
    Numbers materials(std::size_t{extent_.columns} * extent_.rows, 0);
    for (std::size_t i = 0; i < planes.size(); ++i) {
      shown.push_back(shows(planes[i]) ? numbers_of(planes[i], layer.planes[i], extent_, palette_of(printing_))
                                       : Numbers());
      if (planes[i].content == PlaneContent::kMaterials) materials = shown.back();
    }
    const auto is_numbers = [](const PlaneSpec& plane) { return plane.content == PlaneContent::kMaterials; };
    const bool from_masks = std::ranges::none_of(planes, is_numbers);
    for (std::size_t i = 0; i < planes.size() && from_masks; ++i) {
      for (std::size_t v = 0; v < shown[i].size(); ++v) {
        if (shown[i][v] != 0) materials[v] = static_cast<std::uint8_t>(planes[i].material);
      }
    }
    for (std::size_t i = 0; i < planes.size(); ++i) {
      if (!shows(planes[i])) continue;
      ++finding.compared;
      const bool is_mask = planes[i].content == PlaneContent::kMaterialMask;
      const auto differs = [&](std::uint8_t a, std::uint8_t b) {
        return is_mask ? a != (b == planes[i].material) : a != b;
      };
      const auto odd = std::ranges::mismatch(shown[i], materials, [&](auto a, auto b) { return !differs(a, b); }).in1;
      if (odd != shown[i].end()) fail_in(layer, odd - shown[i].begin(), "plane " + std::to_string(i), finding);
    }
    return materials;
  }

  void compare_inside(const Layer& layer, const Numbers& materials, HostileFinding& finding) const {
    std::vector<std::uint64_t> counts(printing_.materials.size());
    for (std::size_t v = 0; v < materials.size(); ++v) {
      ++finding.compared;
      const bool inside = bit_at(layer.planes.back(), extent_.columns, static_cast<std::uint32_t>(v % extent_.columns),
                                 static_cast<std::uint32_t>(v / extent_.columns));
      if (inside != (materials[v] > 0)) fail_in(layer, static_cast<std::ptrdiff_t>(v), "occupancy", finding);
      if (materials[v] > 0 && materials[v] <= counts.size()) ++counts[materials[v] - 1u];
    }
    if (counts != layer.stats.material_voxels) fail_in(layer, 0, "the count of materials", finding);
  }

  void look_into_odd_voxels() {
    const auto is_right = [&](const OddVoxel& odd, const VoxelTruth& truth, TruthFinder& truths) {
      return is_right_by_truth(odd, truth, truths);
    };
    look_into(
        run_, odd_, kMostOddVoxels, is_right, [&](const OddVoxel& odd) { return describe(odd); }, finding_);
  }

 private:
  static bool shows(const PlaneSpec& plane) {
    return plane.content == PlaneContent::kMaterials || plane.content == PlaneContent::kMaterialMask;
  }

  void fail_in(const Layer& layer, std::ptrdiff_t voxel, const std::string& what, HostileFinding& finding) const {
    if (finding.failed++ > 0) return;
    finding.where = "layer " + std::to_string(layer.index) + ", voxel " + std::to_string(voxel % extent_.columns) +
                    "," + std::to_string(voxel / extent_.columns) + ": " + what + " is another one";
  }

  static Numbers bytes_of(const Layer& layer, std::size_t plane) { return layer.planes[plane].bytes; }

  void compare(const Layer& inverted, const Numbers& regions, const Numbers& materials, bool interpolated) {
    LayerMix sums;
    std::vector<double> values(run_.solid->channel_count());
    for (std::size_t v = 0; v < materials.size(); ++v) {
      const VoxelIndex at{static_cast<std::uint32_t>(v % extent_.columns),
                          static_cast<std::uint32_t>(v / extent_.columns), &inverted};
      if (!bit_at(inverted.planes[0], extent_.columns, at.column, at.row) || materials[v] == 0) continue;
      for (std::uint32_t c = 0; c < values.size(); ++c) values[c] = inverted_value(run_, at, c);
      const std::vector<double> none(values.size(), 0);
      const MixBounds mix = mix_of(regions.empty() ? 1 : regions[v], values, interpolated ? tolerances_ : none);
      ++finding_.compared;
      if (!may_be(materials[v], at, mix)) odd_.push_back({at, materials[v], interpolated});
      add(mix, materials[v], sums);
      sums.edge_voxels += at_edge(materials, regions, at);
    }
    if (printing_.halftone.traits().carries_errors) compare_sums(inverted, sums, interpolated);
  }

  /// By the map of a region's number.
  MixBounds mix_of(std::size_t region, std::span<const double> values, std::span<const double> tolerances) const {
    const MapTruth& map = maps_[map_of_region_[region - 1]];
    std::vector<Interval> intervals;
    for (const std::string& channel : map.channels()) {
      const std::uint32_t c = *ChannelTable(run_.solid->summary().channels).at(channel).of_solid;
      intervals.push_back({values[c] - tolerances[c], values[c] + tolerances[c]});
    }
    return map.bounds(intervals);
  }

  bool may_be(std::uint8_t number, const VoxelIndex& at, const MixBounds& mix) const {
    const std::size_t m = number - 1u, count = printing_.materials.size();
    if (m >= count) return false;
    if (count == 1) return true;
    switch (printing_.halftone.method) {
      case HalftoneMethod::kErrorDiffusion: return mix.shares[m].high > kRoundingOfShares;
      case HalftoneMethod::kLargestFraction:
        return std::none_of(mix.shares.begin(), mix.shares.begin() + static_cast<std::ptrdiff_t>(count),
                            [&](const Interval& other) { return other.low > mix.shares[m].high; });
      default: break;
    }
    const double threshold = thresholds_.at(at);
    const bool is_last = m + 1 == count;  // Takes what rounding leaves.
    return mix.sums[m].low <= threshold + kRoundingOfThresholds &&
           (is_last || threshold - kRoundingOfThresholds <= mix.sums[m + 1].high);
  }

  /// With what two inversions may differ by, and by the channels of another cell region that holds the voxel, too.
  bool is_right_by_truth(const OddVoxel& odd, const VoxelTruth& truth, TruthFinder& truths) const {
    const std::size_t voxel = std::size_t{odd.at.row} * extent_.columns + odd.at.column;
    const std::size_t region = run_.has_regions() ? bytes_of(*odd.at.layer, run_.region_plane())[voxel] : 1;
    std::vector<double> slack = truths.slack(truth);
    for (std::size_t c = 0; c < slack.size(); ++c) slack[c] += odd.interpolated ? tolerances_[c] : 0;
    if (may_be(odd.number, odd.at, mix_of(region, truth.values, slack))) return true;
    const Vec3 centre = run_.centre(odd.at.column, odd.at.row, odd.at.layer->index);
    const std::vector<VoxelTruth> others = truths.places_beyond_interfaces(centre, truth);
    return std::ranges::any_of(others, [&](const VoxelTruth& other) {
      return may_be(odd.number, odd.at, mix_of(region, other.values, slack));
    });
  }

  void add(const MixBounds& mix, std::uint8_t number, LayerMix& sums) const {
    for (std::size_t m = 0; m < printing_.materials.size(); ++m) {
      sums.shares[m].low += mix.shares[m].low;
      sums.shares[m].high += mix.shares[m].high;
      sums.voxels[m] += number == m + 1;
    }
  }

  /// Errors may be lost here: another voxel around is outside, or of another region.
  bool at_edge(const Numbers& materials, const Numbers& regions, const VoxelIndex& at) const {
    const std::size_t here = std::size_t{at.row} * extent_.columns + at.column;
    for (int step = 0; step < 9; ++step) {
      const std::int64_t column = std::int64_t{at.column} + step % 3 - 1, row = std::int64_t{at.row} + step / 3 - 1;
      if (column < 0 || row < 0 || column >= extent_.columns || row >= extent_.rows) return true;
      const std::size_t there = static_cast<std::size_t>(row) * extent_.columns + static_cast<std::size_t>(column);
      if (materials[there] == 0 || (!regions.empty() && regions[there] != regions[here])) return true;
    }
    return false;
  }

  void compare_sums(const Layer& layer, const LayerMix& sums, bool interpolated) {
    for (std::size_t m = 0; m < printing_.materials.size(); ++m) {
      ++finding_.compared;
      const double slack = kErrorsLeft + kErrorsAtEdge * sums.edge_voxels;
      if (sums.voxels[m] >= sums.shares[m].low - slack && sums.voxels[m] <= sums.shares[m].high + slack) continue;
      if (finding_.failed++ > 0) continue;
      finding_.where = "layer " + std::to_string(layer.index) + (interpolated ? "" : ", inverted") + ": " +
                       number(sums.voxels[m]) + " voxels of material " + std::to_string(m + 1) + ", by its fractions " +
                       number(sums.shares[m].low) + " to " + number(sums.shares[m].high) + " +- " + number(slack);
    }
  }

  std::string describe(const OddVoxel& odd) const {
    std::string text = voxel_text(odd.at) + (odd.interpolated ? "" : ", inverted") + ": material " +
                       std::to_string(odd.number) + ", threshold " + number(thresholds_.at(odd.at)) + ", channels";
    for (std::uint32_t c = 0; c < tolerances_.size(); ++c) {
      text += " " + number(inverted_value(run_, odd.at, c));
      if (odd.interpolated) text += " +- " + number(tolerances_[c]);
    }
    return text;
  }

  const HostileRun& run_;
  const Printing& printing_;
  const GridExtent extent_;
  HostileFinding& finding_;
  const Thresholds thresholds_;
  std::vector<MapTruth> maps_;
  std::array<std::size_t, 256> map_of_region_{};
  std::vector<double> tolerances_;  // By channel.
  std::vector<OddVoxel> odd_;
};

}  // namespace

void compare_printed(const HostileRun& run, HostileFinding& finding) {
  if (!run.job.job.printing) return;
  PrintedComparison comparison(run, finding);
  for (const Layer& layer : run.layers) {
    comparison.compare_inside(layer, comparison.shown_materials(layer, finding), finding);
  }
  for (const Layer& inverted : run.inverted) comparison.compare(inverted);
  comparison.look_into_odd_voxels();
}

}  // namespace ccslice::oracle
