// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/oracle/hostile/hostile_check.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/job/validate_job.h"
#include "core/prepare/prepare_solid.h"
#include "core/slicer/layer_slicer.h"
#include "tests/oracle/hostile/hostile_comparisons.h"
#include "tests/oracle/hostile/hostile_job.h"
#include "tests/oracle/hostile/hostile_layers.h"
#include "tests/oracle/hostile/hostile_meshed.h"
#include "tests/oracle/hostile/hostile_pictures.h"
#include "tests/oracle/hostile/hostile_regions.h"
#include "tests/oracle/hostile/hostile_strict.h"
#include "tests/oracle/hostile/hostile_text.h"

namespace ccslice::oracle {
namespace {

/// Every layer of a job that is small enough, not only those drawn.
void choose_inverted(HostileRun& run, HostileResult& result) {
  result.every_voxel = static_cast<double>(result.voxels) <= run.job.most_inverted;
  if (!result.every_voxel) return;
  run.job.inverted_layers.clear();
  for (const Layer& layer : run.layers) run.job.inverted_layers.push_back(layer.index);
}

void slice_inverted(HostileRun& run) {
  LayerSlicer inverter(run.marked, inverting_job(*run.marked, run.job.job));
  for (const std::uint32_t layer : run.job.inverted_layers) run.inverted.push_back(inverter.slice(layer, {}));
}

void slice_interpolated(HostileRun& run, HostileResult& result) {
  const HostileJob& job = run.job;
  run.delivered = slice_layers(run.solid, without_strict_maps(job.asked), job.first_layer, job.layer_count);
  for (const Layer& layer : run.delivered) {
    run.layers.push_back(
        read_pictures(run.solid->summary(), job.asked, layer, job.job.grid.extent, result[HostileCheck::kPictures]));
    result.voxels += layer.stats.voxels_inside;
    result.interpolated += layer.stats.voxels_interpolated;
  }
}

void compare(HostileRun& run, const HostileOptions& options, HostileResult& result) {
  slice_interpolated(run, result);
  compare_linear(run, result[HostileCheck::kLinear]);
  if (options.only_linear) return;
  choose_inverted(run, result);
  slice_inverted(run);
  std::vector<VoxelIndex> beyond;
  compare_tolerance(run, beyond, result[HostileCheck::kTolerance]);
  compare_with_truth(run, std::move(beyond), result[HostileCheck::kTruth]);
  compare_pieces(run, result[HostileCheck::kPieces], result[HostileCheck::kShells]);
  compare_occupancy(run, result[HostileCheck::kOccupancy]);
  compare_contours(run, result[HostileCheck::kContours]);
  compare_regions(run, result[HostileCheck::kRegions]);
  compare_printed(run, result[HostileCheck::kPrinted]);
  compare_strict(run, result[HostileCheck::kStrict]);
  count_unresolved(run, result[HostileCheck::kUnresolved]);
  compare_bytes(run, result[HostileCheck::kBytes]);
}

/// A channel that compare_linear() knows is asked for.
bool shows_linear(const HostileRun& run) {
  for (const PlaneSpec& plane : run.job.job.planes) {
    for (const ChannelSamples& samples : samples_of(*run.solid, run.job.job, plane)) {
      if (run.linear[samples.channel]) return true;
    }
  }
  return false;
}

/// A mesh that isn't a solid, and a job that isn't one: null.
std::shared_ptr<const LimitSolid> prepare(const HostileMesh& mesh, HostileResult& result) {
  try {
    return prepare_solid(mesh.mesh);
  } catch (const Error& error) {
    if (static_cast<int>(error.code()) >= 200) throw;
    result.refused = error.what();
    return nullptr;
  }
}

std::optional<HostileJob> plan(std::uint64_t seed, const LimitSolid& solid, const HostileOptions& options,
                               HostileResult& result) {
  try {
    HostileJob job = make_hostile_job(seed, solid, options.most_voxels, options.only_channels);
    result.description += "; " + job.description;
    validate_job(solid, job.asked);
    return job;
  } catch (const Error& error) {
    if (static_cast<int>(error.code()) >= 300) throw;
    result.refused = error.what();
    return std::nullopt;
  }
}

std::string places_text(const HostileFinding& finding) {
  std::string text;
  for (std::size_t i = 0; i < kVoxelPlaces; ++i) {
    if (finding.failed_at[i] == 0) continue;
    text +=
        (text.empty() ? " " : ", ") + std::to_string(finding.failed_at[i]) + " " + to_text(static_cast<VoxelPlace>(i));
  }
  return text;
}

void describe_folds(const SolidSummary& summary, std::string& description) {
  if (summary.overlaps.cells > 0) {
    description += ", " + std::to_string(summary.overlaps.cells) + " limit cells overlap others by up to " +
                   std::to_string(summary.overlaps.depth_mm) + " mm";
  }
  if (summary.folding_cells + summary.undecided_cells == 0) return;
  description += ", " + std::to_string(summary.folding_cells) + " folding and " +
                 std::to_string(summary.undecided_cells) + " undecided of " + std::to_string(summary.limit_cells) +
                 " limit cells";
}

void run(std::uint64_t seed, const HostileOptions& options, HostileResult& result) {
  HostileMesh mesh = make_hostile_mesh(seed, options.files);
  if (!options.only_subdivided) take_some_as_meshed(seed, mesh);
  if (!options.only_channels) add_hostile_regions(seed, mesh);
  result.description = mesh.description;
  const std::shared_ptr<const LimitSolid> solid = prepare(mesh, result);
  if (!solid) return;
  describe_folds(solid->summary(), result.description);
  std::optional<HostileJob> job = plan(seed, *solid, options, result);
  if (!job) return;
  job->job.prove_channels = job->asked.prove_channels = options.prove;
  const bool marked = solid->has_several_regions() && !options.only_linear;
  HostileRun run{.seed = seed,
                 .solid = solid,
                 .marked = marked ? prepare_solid(with_region_channel(mesh.mesh)) : solid,
                 .linear = mesh.linear,
                 .job = std::move(*job),
                 .delivered = {},
                 .layers = {},
                 .inverted = {}};
  if (!options.only_linear || shows_linear(run)) compare(run, options, result);
}

}  // namespace

std::string_view to_text(HostileCheck check) {
  switch (check) {
    case HostileCheck::kTolerance: return "tolerance";
    case HostileCheck::kLinear: return "linear";
    case HostileCheck::kTruth: return "truth";
    case HostileCheck::kPieces: return "pieces";
    case HostileCheck::kShells: return "shells";
    case HostileCheck::kPictures: return "pictures";
    case HostileCheck::kOccupancy: return "occupancy";
    case HostileCheck::kContours: return "contours";
    case HostileCheck::kRegions: return "regions";
    case HostileCheck::kPrinted: return "printed";
    case HostileCheck::kStrict: return "strict";
    case HostileCheck::kUnresolved: return "unresolved";
    default: return "bytes";
  }
}

bool HostileResult::failed() const {
  return !broken.empty() || std::any_of(findings.begin(), findings.end(),
                                        [](const HostileFinding& finding) { return finding.failed > 0; });
}

HostileResult run_hostile_seed(std::uint64_t seed, const HostileOptions& options) {
  HostileResult result;
  result.seed = seed;
  const auto start = std::chrono::steady_clock::now();
  try {
    run(seed, options, result);
  } catch (const std::exception& error) {
    result.broken = error.what();
  }
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

std::string to_text(const HostileResult& result) {
  std::string text = "seed " + std::to_string(result.seed) + ": " + result.description;
  if (!result.refused.empty()) text += " | refused: " + result.refused;
  if (!result.broken.empty()) text += " | BROKEN: " + result.broken;
  for (std::size_t i = 0; i < kHostileChecks; ++i) {
    const HostileFinding& finding = result.findings[i];
    if (finding.failed == 0) continue;
    text += " | " + std::string(to_text(static_cast<HostileCheck>(i))) + ": " + std::to_string(finding.failed) +
            " of " + std::to_string(finding.compared) + " failed, worst " + number(finding.worst) + " (" +
            finding.where + ")" + places_text(finding);
  }
  return text;
}

}  // namespace ccslice::oracle
