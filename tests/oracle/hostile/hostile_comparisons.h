// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The comparisons of a hostile job, which hostile_check.h lists.

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/job/slice_job.h"
#include "tests/oracle/hostile/hostile_channels.h"
#include "tests/oracle/hostile/hostile_finding.h"
#include "tests/oracle/hostile/hostile_job.h"
#include "tests/oracle/hostile/hostile_truth.h"

namespace ccslice::oracle {

/// Of a check that looks into each voxel: after so many the rest count as failed, too.
inline constexpr std::size_t kEnoughFailures = 10;
/// How far off the solid a voxel inside the contours may be, beyond their tolerance: as LayerSlicer has it.
inline constexpr double kOutsideSlackMm = 1e-3;

/// A job that was sliced.
struct HostileRun {
  std::uint64_t seed = 0;
  std::shared_ptr<const LimitSolid> solid;
  /// The same with the number of the cell region as one more channel, if it has several; else the same.
  std::shared_ptr<const LimitSolid> marked;
  std::vector<std::optional<LinearMaterial>> linear;  // By channel.
  HostileJob job;
  std::vector<Layer> delivered;  // As job.asked has them,
  std::vector<Layer> layers;     // and as they read for job.job.
  std::vector<Layer> inverted;   // job.inverted_layers of `marked`, as inverting_job() has them.

  const Layer& layer(std::uint32_t index) const { return layers[index - job.first_layer]; }
  Vec3 centre(std::uint32_t column, std::uint32_t row, std::uint32_t layer) const;
  /// Of the contours of one of the inverted layers round a voxel's centre.
  int winding(const Layer& layer, std::uint32_t column, std::uint32_t row) const;
  bool has_regions() const { return !solid->summary().cell_regions.empty(); }
  /// Of the inverted layers. REQUIRES: cell regions.
  std::size_t region_plane() const { return 1 + marked->channel_count(); }
};

/// A voxel of an inverted layer.
struct VoxelIndex {
  std::uint32_t column = 0, row = 0;
  const Layer* layer = nullptr;
};

TruthFinder truths_of(const HostileRun& run);
/// Ambiguous where the contours wind round it more than once.
std::optional<VoxelTruth> find_truth(TruthFinder& truths, const HostileRun& run, const VoxelIndex& at);
/// The value of a channel there, as floats have it.
double inverted_value(const HostileRun& run, const VoxelIndex& at, std::uint32_t channel);
void note_failure(const std::optional<VoxelTruth>& truth, HostileFinding& finding);
/// For messages: where that is.
std::string place_text(const std::optional<VoxelTruth>& truth);
std::string voxel_text(const VoxelIndex& at);

/// Looks into voxels that don't look right, each an `at` with what makes it so: one fails unless nothing is known of it
/// or is_right(suspect, truth, truths). After `most` of them, or enough failures, the rest count as failed if any did,
/// or else as excused.
template <typename Suspect, typename IsRight, typename Describe>
void look_into(const HostileRun& run, const std::vector<Suspect>& suspects, std::size_t most, IsRight is_right,
               Describe describe, HostileFinding& finding) {
  if (suspects.empty()) return;
  TruthFinder truths = truths_of(run);
  for (std::size_t i = 0; i < suspects.size(); ++i) {
    if (i == most || finding.failed >= kEnoughFailures) {
      (finding.failed > 0 ? finding.failed : finding.excused) += suspects.size() - i;
      break;
    }
    const std::optional<VoxelTruth> truth = find_truth(truths, run, suspects[i].at);
    if (!truth || is_ambiguous(truth->place) || is_right(suspects[i], *truth, truths)) {
      ++finding.excused;
      finding.overlapped += truth && truth->place == VoxelPlace::kOverlap;
      continue;
    }
    note_failure(truth, finding);
    if (finding.failed == 1) finding.where = describe(suspects[i]) + place_text(truth);
  }
}

/// Appends the voxels that were looked into since they are beyond the tolerance.
void compare_tolerance(const HostileRun& run, std::vector<VoxelIndex>& beyond, HostileFinding& finding);

/// Every voxel of channels that are linear in the position, in all layers: their values are known.
void compare_linear(const HostileRun& run, HostileFinding& finding);

/// Compares these voxels, and some random ones.
void compare_with_truth(const HostileRun& run, std::vector<VoxelIndex> voxels, HostileFinding& finding);

/// Some of its pieces of cells, and some tiles, by polynomial and by evaluation.
void compare_pieces(const HostileRun& run, HostileFinding& finding, HostileFinding& finding_of_shells);

void compare_occupancy(const HostileRun& run, HostileFinding& finding);

void count_unresolved(const HostileRun& run, HostileFinding& finding);

/// Every voxel of the inverted layers: its cell region against that of the cell that holds it.
void compare_regions(const HostileRun& run, HostileFinding& finding);

/// All planes of materials of all layers against one another; of the inverted layers every voxel's material against
/// what its channels allow.
void compare_printed(const HostileRun& run, HostileFinding& finding);

/// The contours that the job asks for, by cell region too: against those of the inverted layers, and winding numbers
/// against the cell regions there.
void compare_contours(const HostileRun& run, HostileFinding& finding);

/// Slices again with the strict maps of the job as they are: against what the inverted channels say of each map.
void compare_strict(const HostileRun& run, HostileFinding& finding);

/// Slices again, three times.
void compare_bytes(const HostileRun& run, HostileFinding& finding);

}  // namespace ccslice::oracle
