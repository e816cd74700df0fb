// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/oracle/hostile_check.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <limits>
#include <optional>

#include "core/base/error.h"
#include "tests/oracle/hostile_job.h"
#include "tests/oracle/hostile_layers.h"
#include "tests/oracle/hostile_truth.h"

namespace ccslice::oracle {
namespace {

constexpr double kOutsideSlackMm = 1e-3;       // As LayerSlicer has it.
constexpr std::size_t kMostLookedInto = 5000;  // Of the samples of a job that are beyond the tolerance.

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", value);
  return text;
}

/// A sample beyond the tolerance.
struct Suspect {
  std::uint32_t column, row, layer;
  std::uint32_t channel;
  double value, exact, error, tolerance;
  double ratio() const { return error / tolerance; }
};

class JobCheck {
 public:
  JobCheck(std::shared_ptr<const LimitSolid> solid, const HostileJob& job, HostileResult& result)
      : solid_(std::move(solid)), job_(job), result_(result) {}

  void run() {
    const SliceJob inverting = inverting_job(*solid_, job_.job);
    LayerSlicer inverter(solid_, inverting);
    for (const std::uint32_t layer : job_.inverted_layers) exact_.push_back(inverter.slice(layer, {}));
    layers_ = slice_layers(solid_, job_.job, job_.first_layer, job_.layer_count);
    check_tolerance();
    check_resolved();
  }

 private:
  void check_tolerance() {
    for (std::size_t plane = 0; plane < job_.job.planes.size(); ++plane) {
      for (const ChannelSamples& samples : samples_of(*solid_, job_.job, job_.job.planes[plane])) {
        for (const Layer& exact : exact_) {
          compare(samples, layers_[exact.index - job_.first_layer].planes[plane], exact);
        }
      }
    }
    look_into_suspects();
  }

  void compare(const ChannelSamples& samples, const EncodedPlane& plane, const Layer& exact_layer) {
    const GridExtent& extent = job_.job.grid.extent;
    ChannelSamples exact_samples;  // One a voxel.
    exact_samples.channel = samples.channel;
    HostileFinding& finding = result_[HostileCheck::kTolerance];
    const bool integer = samples.quantum() > 0;
    for (std::uint32_t row = 0; row < extent.rows; ++row) {
      for (std::uint32_t column = 0; column < extent.columns; ++column) {
        const bool inside = bit_at(exact_layer.planes[0], extent.columns, column, row);
        if (!inside) continue;
        const std::size_t voxel = std::size_t{row} * extent.columns + column;
        double exact = exact_samples.value(exact_layer.planes[1 + samples.channel], voxel);
        if (samples.type != SampleType::kFloat32) exact = std::clamp(exact, samples.range.min, samples.range.max);
        const double value = samples.value(plane, voxel);
        const double scale =
            std::max(std::abs(exact), std::abs(value)) + (integer ? samples.range.max - samples.range.min : 0);
        const double rounding = 0.5 * samples.quantum() + 2e-7 * scale;
        const double error = std::max(0.0, std::abs(value - exact) - rounding);
        ++finding.compared;
        if (error <= samples.tolerance) {
          finding.worst = std::max(finding.worst, error / samples.tolerance);
        } else {
          suspects_.push_back({column, row, exact_layer.index, samples.channel, value, exact,
                               std::isnan(error) ? std::numeric_limits<double>::infinity() : error, samples.tolerance});
        }
      }
    }
  }

  void look_into_suspects() {
    if (suspects_.empty()) return;
    std::stable_sort(suspects_.begin(), suspects_.end(),
                     [](const Suspect& a, const Suspect& b) { return a.ratio() > b.ratio(); });
    TruthFinder truths(solid_, job_.job.placement, job_.job.contour_tolerance_mm + kOutsideSlackMm);
    HostileFinding& finding = result_[HostileCheck::kTolerance];
    for (std::size_t i = 0; i < suspects_.size(); ++i) {
      const Suspect& suspect = suspects_[i];
      if (i == kMostLookedInto) {
        (finding.failed > 0 ? finding.failed : finding.excused) += suspects_.size() - i;
        break;
      }
      const std::optional<VoxelTruth> truth = truths.find(centre(suspect));
      const double slack = truth ? truths.slack(*truth)[suspect.channel] : 0;
      if (suspect.error <= suspect.tolerance + slack) {
        ++finding.excused;
        continue;
      }
      ++finding.failed;
      if (finding.where.empty()) {
        finding.worst = suspect.ratio();
        finding.where = describe(suspect, truth);
      }
    }
  }

  std::string describe(const Suspect& suspect, const std::optional<VoxelTruth>& truth) const {
    std::string text = "voxel " + std::to_string(suspect.column) + "," + std::to_string(suspect.row) + "," +
                       std::to_string(suspect.layer) + " channel " + solid_->summary().channels[suspect.channel].name +
                       ": " + number(suspect.value) + ", inverted " + number(suspect.exact) + " +- " +
                       number(suspect.tolerance);
    if (!truth) return text + ", no parameter";
    return text + ", truth " + number(truth->values[suspect.channel]) + " in cell " + std::to_string(truth->at.cell) +
           " at " + number(truth->at.uvw.x()) + "," + number(truth->at.uvw.y()) + "," + number(truth->at.uvw.z()) +
           ", " + to_text(truth->place) +
           (truth->place == VoxelPlace::kOff ? " by " + number(truth->residual_mm) + " mm" : "");
  }

  Vec3 centre(const Suspect& at) const {
    const Grid& grid = job_.job.grid;
    return {grid.origin_mm.x() + (at.column + 0.5) * grid.pitch.x_mm,
            grid.origin_mm.y() + (at.row + 0.5) * grid.pitch.y_mm, grid.layer_z_mm(at.layer)};
  }

  void check_resolved() {
    const SolidSummary& summary = solid_->summary();
    HostileFinding& finding = result_[HostileCheck::kResolved];
    std::uint64_t unresolved = 0;
    for (const std::vector<Layer>* layers : {&exact_, &layers_}) {
      for (const Layer& layer : *layers) {
        finding.compared += layer.stats.voxels_inside;
        unresolved += layer.stats.voxels_unresolved;
        if (layer.stats.voxels_unresolved > 0 && finding.where.empty()) {
          finding.where = std::to_string(layer.stats.voxels_unresolved) + " in layer " + std::to_string(layer.index) +
                          (layers == &exact_ ? ", inverted" : ", interpolated");
        }
      }
    }
    for (const Layer& layer : layers_) {
      result_.voxels += layer.stats.voxels_inside;
      result_.interpolated += layer.stats.voxels_interpolated;
    }
    const bool folds = summary.folding_cells + summary.undecided_cells > 0;
    (folds ? finding.excused : finding.failed) = unresolved;
    finding.worst = static_cast<double>(unresolved);
  }

  const std::shared_ptr<const LimitSolid> solid_;
  const HostileJob& job_;
  HostileResult& result_;
  std::vector<Layer> exact_, layers_;
  std::vector<Suspect> suspects_;
};

/// A mesh that isn't a solid, and a job that isn't one: null.
std::shared_ptr<const LimitSolid> prepare(std::uint64_t seed, const HostileOptions& options, HostileResult& result) {
  try {
    HostileMesh mesh = make_hostile_mesh(seed, options.files);
    result.description = mesh.description;
    return LimitSolid::prepare(std::move(mesh.mesh));
  } catch (const Error& error) {
    if (static_cast<int>(error.code()) >= 200) throw;
    result.refused = error.what();
    return nullptr;
  }
}

std::optional<HostileJob> plan(std::uint64_t seed, const LimitSolid& solid, const HostileOptions& options,
                               HostileResult& result) {
  try {
    HostileJob job = make_hostile_job(seed, solid, options.most_voxels);
    result.description += "; " + job.description;
    validate_job(solid, job.job);
    return job;
  } catch (const Error& error) {
    if (static_cast<int>(error.code()) >= 300) throw;
    result.refused = error.what();
    return std::nullopt;
  }
}

void describe_folds(const SolidSummary& summary, std::string& description) {
  if (summary.folding_cells + summary.undecided_cells == 0) return;
  description += ", " + std::to_string(summary.folding_cells) + " folding and " +
                 std::to_string(summary.undecided_cells) + " undecided of " + std::to_string(summary.limit_cells) +
                 " limit cells";
}

void run(std::uint64_t seed, const HostileOptions& options, HostileResult& result) {
  const std::shared_ptr<const LimitSolid> solid = prepare(seed, options, result);
  if (!solid) return;
  describe_folds(solid->summary(), result.description);
  const std::optional<HostileJob> job = plan(seed, *solid, options, result);
  if (job) JobCheck(solid, *job, result).run();
}

}  // namespace

std::string_view to_text(HostileCheck check) {
  switch (check) {
    case HostileCheck::kTolerance: return "tolerance";
    default: return "resolved";
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
            finding.where + ")";
  }
  return text;
}

}  // namespace ccslice::oracle
