// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Values of voxels: against those of inverted ones, and those against the truth.

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "core/slicer/channel_tolerances.h"
#include "tests/oracle/hostile/hostile_comparisons.h"
#include "tests/oracle/hostile/hostile_layers.h"
#include "tests/oracle/hostile/hostile_random.h"
#include "tests/oracle/hostile/hostile_text.h"

namespace ccslice::oracle {
namespace {

constexpr std::size_t kMostLookedInto = 5000;  // Of the samples of a job that are beyond the tolerance.
constexpr std::size_t kMostPassedOn = 300;     // Of their voxels.
constexpr std::size_t kRandomVoxels = 200, kBorderRows = 20;
constexpr double kFloatRounding = 0x1p-22;  // Of two floats, and of the arithmetic before.
constexpr double kTruthRounding = 1e-9;     // Of a channel's range.

/// A sample beyond the tolerance.
struct Suspect {
  VoxelIndex at;
  std::uint32_t channel = 0;
  double value = 0, inverted = 0, error = 0, tolerance = 0;
  double ratio() const { return error / tolerance; }
};

std::string sample_text(const HostileRun& run, const VoxelIndex& at, std::uint32_t channel) {
  return voxel_text(at) + " channel " + run.solid->summary().channels[channel].name;
}

std::string describe(const HostileRun& run, const Suspect& suspect, const std::optional<VoxelTruth>& truth) {
  std::string text = sample_text(run, suspect.at, suspect.channel) + ": " + number(suspect.value) + ", inverted " +
                     number(suspect.inverted) + " +- " + number(suspect.tolerance);
  if (truth) text += ", truth " + number(truth->values[suspect.channel]);
  return text + place_text(truth);
}

/// What interpolation is asked for is no more than the job promises: voxels that happen to be exact don't say so.
void compare_asked(const HostileRun& run, HostileFinding& finding) {
  const SolidSummary& solid = run.solid->summary();
  for (const ChannelTolerance& asked : channel_tolerances(run.job.job, solid.channels)) {
    const double promised = tolerance_of(solid, run.job.job, asked.channel);
    ++finding.compared;
    if (asked.tolerance <= promised * (1 + kTruthRounding)) continue;
    ++finding.failed;
    finding.where = "channel " + solid.channels[asked.channel].name + " is asked for within " +
                    number(asked.tolerance) + ", promised within " + number(promised);
  }
}

/// Compares one channel of one plane of one layer.
class SampleComparison {
 public:
  SampleComparison(const HostileRun& run, const ChannelSamples& samples, std::vector<Suspect>& suspects,
                   HostileFinding& finding)
      : run_(run), samples_(samples), suspects_(suspects), finding_(finding) {}

  void compare(const EncodedPlane& plane, const Layer& inverted) {
    const GridExtent& extent = run_.job.job.grid.extent;
    for (std::uint32_t row = 0; row < extent.rows; ++row) {
      for (std::uint32_t column = 0; column < extent.columns; ++column) {
        if (!bit_at(inverted.planes[0], extent.columns, column, row)) continue;
        const std::size_t voxel = std::size_t{row} * extent.columns + column;
        compare(samples_.value(plane, voxel), {column, row, &inverted});
      }
    }
  }

 private:
  void compare(double value, const VoxelIndex& at) {
    double inverted = inverted_value(run_, at, samples_.channel);
    const bool integer = samples_.type != SampleType::kFloat32;
    if (integer) inverted = std::clamp(inverted, samples_.range.min, samples_.range.max);
    double scale = std::max(std::abs(inverted), std::abs(value));
    if (integer) scale += samples_.range.max - samples_.range.min;
    const double off = std::abs(value - inverted) - 0.5 * samples_.quantum() - kFloatRounding * scale;
    const double error = std::isnan(off) ? std::numeric_limits<double>::infinity() : std::max(0.0, off);
    ++finding_.compared;
    if (error <= samples_.tolerance) {
      finding_.worst = std::max(finding_.worst, error / samples_.tolerance);
    } else {
      suspects_.push_back({at, samples_.channel, value, inverted, error, samples_.tolerance});
    }
  }

  const HostileRun& run_;
  const ChannelSamples& samples_;
  std::vector<Suspect>& suspects_;
  HostileFinding& finding_;
};

/// Beyond the tolerance by no more than inversion may be off; or the voxel lies on an interface, and the value is right
/// by one of the cell regions there, of which inversion took another one.
bool is_excused(const Suspect& suspect, const HostileRun& run, const VoxelTruth& truth, TruthFinder& truths) {
  const double slack = truths.slack(truth)[suspect.channel], bound = suspect.tolerance + slack;
  if (suspect.error <= bound) return true;
  const double rounding = std::abs(suspect.value - suspect.inverted) - suspect.error;
  const VoxelIndex& at = suspect.at;
  const Vec3 centre = run.centre(at.column, at.row, at.layer->index);
  std::vector<VoxelTruth> places = truths.places_beyond_interfaces(centre, truth);
  if (places.empty()) return false;
  places.push_back(truth);
  return std::ranges::any_of(places, [&](const VoxelTruth& place) {
    return std::abs(suspect.value - place.values[suspect.channel]) - rounding <= bound;
  });
}

/// Ratio of error and bound, of one voxel's inverted values.
void judge(const HostileRun& run, const VoxelIndex& at, const VoxelTruth& truth, TruthFinder& truths,
           HostileFinding& finding) {
  const std::vector<double> slack = truths.slack(truth);
  for (std::uint32_t c = 0; c < slack.size(); ++c) {
    const ChannelRange& channel = run.solid->summary().channels[c];
    const double inverted = inverted_value(run, at, c), error = std::abs(inverted - truth.values[c]);
    const double bound = slack[c] + kFloatRounding * std::abs(inverted) + kTruthRounding * (channel.max - channel.min) +
                         std::numeric_limits<float>::denorm_min();
    ++finding.compared;
    const double ratio = std::isnan(error) ? std::numeric_limits<double>::infinity() : error / bound;
    if (ratio > 1) {
      const Vec3 centre = run.centre(at.column, at.row, at.layer->index);
      const std::vector<VoxelTruth> others = truths.places_beyond_interfaces(centre, truth);
      const auto is_right = [&](const VoxelTruth& other) { return std::abs(inverted - other.values[c]) <= bound; };
      if (std::ranges::any_of(others, is_right)) {
        ++finding.excused;
        continue;
      }
      note_failure(truth, finding);
    }
    if (ratio <= finding.worst) continue;
    finding.worst = ratio;
    if (ratio <= 1) continue;
    finding.where = sample_text(run, at, c) + ": inverted " + number(inverted) + ", truth " + number(truth.values[c]) +
                    " +- " + number(bound) + place_text(truth);
  }
}

/// Some anywhere, and some with a neighbour outside, of which a few lie off the solid.
void add_random_voxels(const HostileRun& run, std::vector<VoxelIndex>& voxels) {
  HostileRandom random(run.seed, 4);
  const GridExtent& extent = run.job.job.grid.extent;
  const auto is_inside = [&](const Layer& layer, std::uint32_t column, std::uint32_t row) {
    return column < extent.columns && row < extent.rows && bit_at(layer.planes[0], extent.columns, column, row);
  };
  for (std::size_t i = 0; i < kRandomVoxels && !run.inverted.empty(); ++i) {
    const Layer& layer = run.inverted[random.bits() % run.inverted.size()];
    const auto column = static_cast<std::uint32_t>(random.bits() % extent.columns);
    const auto row = static_cast<std::uint32_t>(random.bits() % extent.rows);
    if (is_inside(layer, column, row)) voxels.push_back({column, row, &layer});
  }
  for (std::size_t i = 0; i < kBorderRows && !run.inverted.empty(); ++i) {
    const Layer& layer = run.inverted[random.bits() % run.inverted.size()];
    const auto row = static_cast<std::uint32_t>(random.bits() % extent.rows);
    for (std::uint32_t column = 0; column < extent.columns; ++column) {
      if (!is_inside(layer, column, row)) continue;
      const bool at_border = !is_inside(layer, column + 1, row) || !is_inside(layer, column - 1, row) ||
                             !is_inside(layer, column, row + 1) || !is_inside(layer, column, row - 1);
      if (at_border) voxels.push_back({column, row, &layer});
    }
  }
}

}  // namespace

void compare_tolerance(const HostileRun& run, std::vector<VoxelIndex>& beyond, HostileFinding& finding) {
  compare_asked(run, finding);
  std::vector<Suspect> suspects;
  const std::vector<PlaneSpec>& planes = run.job.job.planes;
  for (std::size_t plane = 0; plane < planes.size(); ++plane) {
    for (const ChannelSamples& samples : samples_of(*run.solid, run.job.job, planes[plane])) {
      SampleComparison comparison(run, samples, suspects, finding);
      for (const Layer& inverted : run.inverted) comparison.compare(run.layer(inverted.index).planes[plane], inverted);
    }
  }
  if (suspects.empty()) return;
  std::stable_sort(suspects.begin(), suspects.end(),
                   [](const Suspect& a, const Suspect& b) { return a.ratio() > b.ratio(); });
  TruthFinder truths = truths_of(run);
  for (std::size_t i = 0; i < suspects.size(); ++i) {
    const Suspect& suspect = suspects[i];
    if (i < kMostPassedOn) beyond.push_back(suspect.at);
    if (i == kMostLookedInto) {  // The rest is less far beyond.
      (finding.failed > 0 ? finding.failed : finding.excused) += suspects.size() - i;
      break;
    }
    const std::optional<VoxelTruth> truth = find_truth(truths, run, suspect.at);
    const bool overlaps = truth && truth->place == VoxelPlace::kOverlap;
    if (overlaps || (truth && is_excused(suspect, run, *truth, truths))) {
      ++finding.excused;
      finding.overlapped += overlaps;
      continue;
    }
    note_failure(truth, finding);
    if (finding.failed > 1) continue;
    finding.worst = suspect.ratio();
    finding.where = describe(run, suspect, truth);
  }
}

void compare_with_truth(const HostileRun& run, std::vector<VoxelIndex> voxels, HostileFinding& finding) {
  add_random_voxels(run, voxels);
  TruthFinder truths = truths_of(run);
  for (const VoxelIndex& at : voxels) {
    const std::optional<VoxelTruth> truth = find_truth(truths, run, at);
    if (truth && (truth->place == VoxelPlace::kInside || truth->place == VoxelPlace::kOff)) {
      judge(run, at, *truth, truths, finding);
    } else {
      ++finding.excused;
      finding.overlapped += truth && truth->place == VoxelPlace::kOverlap;
    }
  }
}

}  // namespace ccslice::oracle
