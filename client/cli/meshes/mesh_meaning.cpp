// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/meshes/mesh_meaning.h"

#include <cmath>
#include <utility>

#include "client/cli/base/console.h"
#include "client/cli/base/option_group.h"
#include "client/cli/base/processors.h"
#include "client/cli/base/text_values.h"
#include "core/base/error.h"
#include "core/mesh/rounded_edges.h"
#include "core/mesh/validate.h"
#include "core/prepare/deviation.h"
#include "core/prepare/prepare_solid.h"

namespace ccslice::cli {
namespace {

constexpr double kPartAngleDeg = 40;
constexpr double kRoundingOfVolume = 1e-6;  // A share of it.
constexpr double kMostWorse = 2;            // Times what the volume is off without fitting.

// Places are those of the mesh before --size, --center and --on-bed: how far they move it shows after fitting only.
constexpr const char* kInTheFile = ", in the file at ";

PrepareOptions prepare_options() {
  PrepareOptions options;
  options.threads = processors();
  return options;
}

/// Why a fitted mesh isn't the part: a vertex that is missed by too much, cells that fold, or a volume that is off by
/// much more than without fitting. Empty if it is. The mesh's own volume isn't the part's where that is round: between
/// its vertices a fitted limit stands off the mesh by about as much as the limit of its control points lies within it.
std::string fault_of(const FittedMesh& fitted, const ControlMesh& sharpened, double most_missed_mm, double scale) {
  const FitReport& report = fitted.report();
  const double missed_mm = scale * report.farthest.distance_mm();
  if (report.missed > 0 && missed_mm > most_missed_mm) {
    const Vec3& at = report.farthest.position;
    return "the limit would miss " + show_count(report.missed, "vertex") +
           " of the boundary by more than half a voxel, the most by " + show_number(missed_mm) + " mm: vertex " +
           std::to_string(report.farthest.vertex) + kInTheFile + show_place({at.x(), at.y(), at.z()}) + " mm";
  }
  const auto solid = prepare_solid(fitted.fitted(), prepare_options());
  const SolidSummary& summary = solid->summary();
  if (summary.folding_cells > 0) {
    const FoldPlace& fold = summary.folds.front();
    const Vec3& at = fold.position;
    return "the limit would fold in " + show_count(summary.folding_cells) + " of its cells, the first in cell " +
           std::to_string(static_cast<std::uint32_t>(fold.control_cell)) + kInTheFile +
           show_place({at.x(), at.y(), at.z()}) + " mm";
  }
  const Deviation sharp = measure_limit(sharpened, prepare_options()).deviation;
  const double mesh_mm3 = sharp.control_volume_mm3, fitted_mm3 = summary.deviation.limit_volume_mm3;
  const double off = std::abs(fitted_mm3 - mesh_mm3), off_before = std::abs(sharp.limit_volume_mm3 - mesh_mm3);
  if (off <= kMostWorse * off_before + kRoundingOfVolume * mesh_mm3) return "";
  return "the limit's volume would be " + show_number(100 * (fitted_mm3 / mesh_mm3 - 1)) + " % off the mesh's, and " +
         show_number(100 * (sharp.limit_volume_mm3 / mesh_mm3 - 1)) + " % without fitting";
}

}  // namespace

void add_meaning_options(CLI::App& command, MeaningOptions& options) {
  const OptionGroup group(command, "Mesh");
  command.add_flag(
      "--as-meshed", options.as_meshed,
      "Take the mesh as it is, as finite elements do: straight edges or those of second-order cells, its exact "
      "volume, values linear within cells. For meshes of a finite-element analysis");
  command.add_flag(
      "--part", options.part,
      "The mesh was made of a CAD part: keep edges sharp that turn by 40 degrees, and place the control points "
      "so that the limit passes through the mesh's vertices. Taken as meshed, with a note, where a vertex "
      "would be missed by more than half a voxel (0.05 mm in commands without --pitch), cells would fold, or the "
      "volume would get far worse");
  add_sharp_options(command, options.sharp);
  add_fit_option(command, options.fit);
  command.add_flag("--smooth", options.smooth,
                   "With --fit: take a fit that rounds edges that turn by 75 degrees or more, which is refused "
                   "otherwise");
}

std::optional<FittedVertices> parse_meaning(const MeaningOptions& options) {
  const bool by_hand = options.sharp.any() || !options.fit.empty();
  if (options.as_meshed && (options.part || by_hand)) {
    throw UsageError("--as-meshed takes the mesh as it is: leave out --part, --sharp-... and --fit");
  }
  if (options.part && by_hand) {
    throw UsageError("--part says what --sharp-... and --fit say: give it alone, or these");
  }
  if (options.smooth && options.fit.empty()) throw UsageError("--smooth goes with --fit");
  return parse_fit(options.fit);
}

void take_as(bool as_meshed, ControlMesh& mesh, std::vector<std::string>& notes) {
  mesh.as_meshed = as_meshed;
  if (as_meshed || mesh.mid_nodes.empty()) return;
  const std::size_t nodes = mesh.mid_nodes.positions.size();
  mesh.mid_nodes = {};
  notes.push_back("cells of second order are taken by their corners: curved edges become straight, and " +
                  show_count(nodes) + " nodes between corners are left out; --as-meshed keeps them");
}

std::optional<FittedMesh> fit_part(const MeaningOptions& options, const Vec3& scale, ControlMesh& mesh, bool quiet,
                                   std::vector<std::string>& notes) {
  ControlMesh sharpened = mesh;
  std::vector<std::string> own_notes;
  take_as(false, sharpened, own_notes);
  validate(sharpened);
  (void)sharpen_by_angle({.angle_deg = kPartAngleDeg, .reentrant = true, .file = {}}, ControlMesh(sharpened), sharpened,
                         own_notes);
  std::string fault;
  for (const FittedVertices vertices : {FittedVertices::kAll, FittedVertices::kBoundary}) {
    try {
      FittedMesh fitted(sharpened, vertices, quiet);
      fault = fault_of(fitted, sharpened, 0.5 * options.voxel_mm, scale.cwiseAbs().maxCoeff());
      if (!fault.empty()) break;
      notes.insert(notes.end(), own_notes.begin(), own_notes.end());
      mesh = std::move(sharpened);
      return fitted;
    } catch (const Error& error) {
      if (error.code() != ErrorCode::kMeshNotInterpolable) throw;
      fault = error.what();
    }
  }
  notes.push_back("--part: taken as meshed, since " + fault);
  return std::nullopt;
}

void refuse_rounded_edges(const MeaningOptions& options, const FittedMesh& fitted) {
  const RoundedEdges& rounded = fitted.report().rounded;
  if (options.smooth || rounded.count == 0) return;
  throw Error(
      ErrorCode::kMeshNotInterpolable,
      "the fit rounds edges that look sharp: " + describe(rounded) +
          "; --part keeps such edges sharp, --sharp-angle 40 those that you choose; --smooth says that they are "
          "meant to be round");
}

}  // namespace ccslice::cli
