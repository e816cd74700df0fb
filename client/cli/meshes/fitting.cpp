// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/meshes/fitting.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

#include "client/cli/base/console.h"
#include "client/cli/base/processors.h"
#include "client/cli/base/text_values.h"
#include "client/cli/meshes/local_preparation.h"
#include "core/mesh/cell_regions.h"
#include "core/mesh/validate.h"
#include "core/mesh_import/channels.h"
#include "core/subdivision/refined_mesh.h"

namespace ccslice::cli {
namespace {

/// Shows its progress.
FitOptions fit_options(bool quiet) {
  const auto display = std::make_shared<LocalPreparation>("fitting", quiet);
  FitOptions options;
  options.threads = processors();
  options.progress.preparing = [display] { return display->begin(); };
  options.progress.reserve = [display](std::uint64_t bytes) { display->tell_memory(bytes); };
  options.progress.sampling = [display](std::size_t done, std::size_t total) {
    display->count("sampling channels", done, total);
  };
  return options;
}

std::string met_note(FittedVertices vertices, const FitReport& report) {
  const bool all = vertices == FittedVertices::kAll;
  std::string note = all ? "control points fitted" : "control points fitted to the boundary";
  note += ": the limit passes through ";
  if (report.missed == 0 && report.inside_missed == 0) return note + "every vertex";
  if (report.missed == 0) {
    note += "every vertex of the boundary";
  } else {
    const Vec3& at = report.farthest.position;
    note += "all vertices of the boundary but " + show_count(report.missed) +
            ", which stay behind so that nothing folds, or are out of reach, by up to " +
            show_number(report.farthest.distance_mm()) + " mm: vertex " + std::to_string(report.farthest.vertex) +
            " at " + show_place({at.x(), at.y(), at.z()});
  }
  if (all) note += ", and would fold if it passed through those inside";
  if (report.inside_missed == 0) return note;
  return note + "; those inside are up to " + show_number(report.inside_mm) + " mm from their limit points";
}

/// Where the limit swells much depends on the boundary's vertices alone, which --fit=boundary meets as well.
/// Edges that it rounds are refused, or taken knowingly.
std::string swelling_note(const Swelling& swelling, FittedVertices vertices) {
  const Vec3& at = swelling.place;
  std::string face;
  for (const std::uint32_t v : swelling.vertices) face += (face.empty() ? "" : ", ") + std::to_string(v);
  const std::string most = show_number(swelling.offset.norm()) + " mm off the middle of the mesh's face of vertices " +
                           face + ", by " + show_number(swelling.edges) + " of an edge, near " +
                           show_place({at.x(), at.y(), at.z()});
  if (swelling.much == 0) return "the limit is up to " + most;
  return "the limit swells between the vertices by more than a tenth of an edge at " +
         show_count(swelling.much, "face") + " of the boundary, most by " + most +
         ": keep more edges sharp (--sharp-angle, --sharp-reentrant), or use a finer mesh there" +
         (vertices == FittedVertices::kAll ? "; --fit=boundary swells as much" : "");
}

/// The mesh that the limit of a fitted one passes through. Copies of a vertex have one limit point, and where channels
/// jump values of their own.
ControlMesh meant_by(ControlMesh fitted) {
  if (!has_several_regions(fitted)) return mesh_of_limit_points(fitted);
  const ConnectedMesh checked = validate_and_connect(fitted, {}, {});
  const SplitMesh split = split_cell_regions(fitted, checked.complex);
  fitted.interpolating = false;
  fitted.missed_vertices.clear();
  take_from_copies(split, mesh_of_limit_points(split.mesh), fitted);
  return fitted;
}

/// As scaled along each axis, then moved. Of lengths without a direction the longest that they may become counts.
FitReport placed(FitReport report, const Vec3& scale, const Vec3& offset = Vec3::Zero()) {
  for (Vec3* place :
       {&report.farthest.position, &report.farthest.limit, &report.swelling.place, &report.rounded.place}) {
    *place = place->cwiseProduct(scale) + offset;
  }
  report.inside_mm *= scale.cwiseAbs().maxCoeff();
  report.swelling.offset = report.swelling.offset.cwiseProduct(scale);
  return report;
}

/// Control points overshoot, and their range is the one that planes have unless another is given.
void add_range_notes(const ControlMesh& meant, const ControlMesh& fitted, std::vector<std::string>& notes) {
  constexpr float kMuch = 0.01f;
  for (std::size_t c = 0; c < meant.channel_count(); ++c) {
    const auto [low, high] = channel_range(meant, c);
    const auto [fitted_low, fitted_high] = channel_range(fitted, c);
    if (std::max(low - fitted_low, fitted_high - high) <= kMuch * (high - low)) continue;
    notes.push_back("channel " + meant.channel_names[c] + " is " + show_number(low) + " to " + show_number(high) +
                    " at vertices, and " + show_number(fitted_low) + " to " + show_number(fitted_high) +
                    " at control points: pictures of 8 and 16 bits have that range unless another is given, as in "
                    "--channel NAME:u8:LOW..HIGH");
  }
}

std::string ringing_note(const ControlMesh& meant, const ChannelRinging& ringing) {
  const auto [low, high] = channel_range(meant, ringing.channel);
  return "channel " + meant.channel_names[ringing.channel] + " rings: it is " + show_number(low) + " to " +
         show_number(high) + " at vertices, and the limit reaches " + show_number(ringing.value) +
         " between them, in cell " + std::to_string(ringing.cell) + " near " +
         show_place({ringing.place.x(), ringing.place.y(), ringing.place.z()}) +
         " mm: use a grade that changes over more cells, or a finer mesh there; without --fit channels stay "
         "within the range of their vertices";
}

}  // namespace

void add_fit_option(CLI::App& command, std::string& fit) {
  command
      .add_flag("--fit{all}", fit,
                "Place the control points so that the limit passes through the mesh's own vertices, in position and in "
                "materials: for meshes of a part, as from CAD and finite elements, not for meshes designed as control "
                "meshes. Vertices inside may be missed so that nothing folds. Refused if the boundary folds all the "
                "same; --fit=boundary keeps such places back")
      ->group("Mesh");
}

std::optional<FittedVertices> parse_fit(const std::string& fit) {
  if (fit.empty()) return std::nullopt;
  if (fit == "all") return FittedVertices::kAll;
  if (fit == "boundary") return FittedVertices::kBoundary;
  throw UsageError("--fit takes nothing, or =boundary, not '" + fit + "'");
}

FittedMesh::FittedMesh(const ControlMesh& mesh, FittedVertices vertices, bool quiet)
    : fit_(mesh, fit_options(quiet)), vertices_(vertices), meant_(mesh) {
  fitted_ = fit_.fit_positions(vertices, report_);
  if (report_.missed + report_.inside_missed > 0) meant_.positions = fit_.limit_points(fitted_);
}

FittedMesh::FittedMesh(const ControlMesh& fitted, bool quiet)
    : fit_(fitted, fit_options(quiet)), fitted_(fitted), meant_(meant_by(fitted)) {}

void FittedMesh::place(const Similarity& similarity) {
  similarity.apply(fitted_);
  similarity.apply(meant_);
  report_ = placed(report_, Vec3::Constant(similarity.scale), similarity.offset);
}

ControlMesh FittedMesh::finish(const Vec3& scale, std::vector<std::string>& notes) {
  constexpr double kRounding = 1e-6;
  if (vertices_) {
    const FitReport report = placed(report_, scale);
    notes.push_back(met_note(*vertices_, report));
    if (report.swelling.edges > kRounding) notes.push_back(swelling_note(report.swelling, *vertices_));
  }
  const ChannelFit channels = fit_.fit_channels(meant_, fitted_);
  add_range_notes(meant_, fitted_, notes);
  for (ChannelRinging ringing : channels.ringing) {
    ringing.place = ringing.place.cwiseProduct(scale);
    notes.push_back(ringing_note(meant_, ringing));
  }
  if (channels.miss > kRounding) {
    notes.push_back("no control points give every vertex its channels: they are up to " +
                    show_number(100 * channels.miss) + " % of a channel's range off; use a finer mesh");
  }
  return std::move(fitted_);
}

}  // namespace ccslice::cli
