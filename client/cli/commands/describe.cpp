// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <cmath>
#include <cstddef>
#include <string>

#include "client/cli/base/console.h"
#include "client/cli/output/documents.h"
#include "core/base/echo.h"
#include "core/base/number_text.h"
#include "core/mesh/rounded_edges.h"

namespace ccslice::cli {
namespace {

constexpr std::size_t kMeshIdBytes = 71;  // "sha256:" and 64 digits.

std::string describe_place(const v1::Vector3& place) { return show_place({place.x(), place.y(), place.z()}); }

std::string describe_fold(const v1::FoldPlace& fold) {
  return "\n  folds      control cell " + std::to_string(fold.control_cell()) + " at " +
         describe_place(fold.position_mm()) + " mm";
}

/// Empty without any.
std::string describe_overlaps(const v1::Overlaps& overlaps) {
  if (overlaps.limit_cells() == 0) {
    return overlaps.more()
               ? "\n  overlaps   none found, but so many faces are close to others that not all were looked at"
               : "";
  }
  constexpr int kMost = 3;
  std::string text = std::string("\n  overlaps   ") + (overlaps.more() ? "at least " : "") +
                     show_count(overlaps.limit_cells()) +
                     " limit cells overlap others that they don't touch, by up to " + show_number(overlaps.depth_mm()) +
                     " mm and about " + show_number(overlaps.volume_mm3()) + " mm^3 in all";
  for (int i = 0; i < overlaps.places_size() && i < kMost; ++i) {
    const v1::OverlapPlace& place = overlaps.places(i);
    text += "\n             control cells " + std::to_string(place.control_cell()) + " and " +
            std::to_string(place.other_control_cell()) + " at " + describe_place(place.position_mm()) + " mm, " +
            show_number(place.depth_mm()) + " mm deep";
  }
  return text;
}

constexpr const char* kNoChange = "the same";

/// "+1.23 %".
std::string change_text(double value, double from) {
  if (!(from > 0)) return "no part to compare with";
  const double percent = std::round(1e4 * (value / from - 1)) / 100;
  return percent == 0 ? kNoChange : (percent > 0 ? "+" : "") + show_number(percent) + " %";
}

/// Whether the volume of a fitted mesh changed because its limit is round or because its fit missed vertices, whichever
/// is more.
std::string cause_of_change(const v1::LimitDeviation& deviation) {
  const double at_vertices = deviation.vertex_limits_volume_mm3();
  if (!(at_vertices > 0)) return "";  // Older servers don't say.
  const double round = std::abs(deviation.limit_volume_mm3() - at_vertices);
  const double missed = std::abs(at_vertices - deviation.control_volume_mm3());
  return round < missed ? "; most of it at vertices that the fit missed"
                        : "; between vertices the mesh is flat, and the limit round";
}

RoundedEdges rounded_edges_of(const v1::LimitDeviation& deviation) {
  const v1::Vector3& at = deviation.rounded_edge_mm();
  return {deviation.rounded_edges(), Vec3(at.x(), at.y(), at.z()), deviation.rounded_edge_deg()};
}

/// The plan's, without the rounded edges where a warning tells of them: that of the whole part, which has places.
v1::LimitDeviation deviation_to_tell(const v1::PlanSlicesResponse& plan) {
  v1::LimitDeviation deviation = plan.deviation();
  for (const v1::PlanWarning& warning : plan.warnings()) {
    if (warning.kind() == v1::PLAN_WARNING_KIND_DEVIATION && warning.places_mm_size() > 0) {
      deviation.clear_rounded_edges();
    }
  }
  return deviation;
}

std::string describe_volume(const v1::VolumeSummary& volume) {
  std::string text = "\n  volume     " + show_count(volume.samples_i()) + " x " + show_count(volume.samples_j()) +
                     " x " + show_count(volume.samples_k()) + " samples";
  for (int c = 0; c < volume.channels_size(); ++c) {
    const v1::VolumeChannel& channel = volume.channels(c);
    text += "\n  channel    " + std::to_string(c) + ": " + show_number(channel.min_sample()) + " to " +
            show_number(channel.max_sample());
    if (channel.nan_samples() > 0) text += ", " + show_count(channel.nan_samples()) + " NaN";
  }
  return text;
}

}  // namespace

std::string describe(const v1::Box3& box) {
  const v1::Vector3& min = box.min_mm();
  const v1::Vector3& max = box.max_mm();
  return show_box({min.x(), min.y(), min.z()}, {max.x(), max.y(), max.z()});
}

std::string describe(const v1::LimitDeviation& deviation) {
  const double control = deviation.control_volume_mm3(), limit = deviation.limit_volume_mm3();
  const v1::Vector3& place = deviation.farthest_vertex_mm();
  const double rounding = 1e-12 * (1 + std::abs(place.x()) + std::abs(place.y()) + std::abs(place.z()));
  const bool moved = deviation.farthest_distance_mm() > rounding;
  const std::string change = change_text(limit, control);
  std::string text = "\n  mesh size  " + describe(deviation.control_box());
  if (deviation.as_meshed()) return text + "\n  volume     " + show_number(limit) + " mm^3, as meshed";
  text += "\n  volume     " + show_number(limit) + " mm^3 (" + change + "), ";
  if (!deviation.interpolating()) {
    text += "control mesh " + show_number(control) + " mm^3";
  } else {
    text +=
        std::string("mesh that it ") + (moved ? "was fitted to " : "interpolates ") + show_number(control) + " mm^3";
    if (change != kNoChange) text += cause_of_change(deviation);
  }
  if (deviation.rounded_edges() > 0) text += "\n  rounded    " + describe(rounded_edges_of(deviation));
  text += "\n  moved      ";
  if (!moved) return text + "no boundary vertex";
  return text + "up to " + show_number(deviation.farthest_distance_mm()) +
         " mm: " + (deviation.farthest_on_interface() ? "interface" : "boundary") + " vertex " +
         std::to_string(deviation.farthest_vertex()) + " from " + describe_place(place) + " to its limit point " +
         describe_place(deviation.farthest_limit_mm());
}

std::string describe(const v1::CellRegion& region) {
  const std::string text = "\n  region     " + echoed(region.name()) + ": " +
                           show_count(region.control_cells(), "cell") + ", " + show_number(region.volume_mm3()) +
                           " mm^3";
  if (region.control_volume_mm3() == 0) return text;  // Older servers don't say.
  return text + " (" + change_text(region.volume_mm3(), region.control_volume_mm3()) + ")";
}

std::string describe(const v1::MeshSummary& mesh) {
  std::string text = echoed(mesh.mesh_id(), kMeshIdBytes);
  if (mesh.has_volume()) {
    return text + describe_volume(mesh.volume()) + "\n  memory     " + show_bytes(mesh.memory_bytes()) +
           " on the server";
  }
  text += "\n  control    " + show_count(mesh.control_cells(), "cell") + ", " +
          show_count(mesh.control_vertices(), "vertex") + ", " + show_count(mesh.sharp_edges(), "sharp edge");
  text += "\n  irregular  " + show_count(mesh.extraordinary_edges(), "extraordinary edge") + ", " +
          show_count(mesh.extraordinary_vertices(), "extraordinary vertex") + ", " +
          show_count(mesh.irregular_boundary_edges(), "boundary edge");
  text += "\n  limit      " + show_count(mesh.limit_cells(), "cell") + ": " + show_count(mesh.regular_cells()) +
          " regular, " + show_count(mesh.line_cells()) + " along a line, " + show_count(mesh.vertex_cells()) +
          " at a vertex";
  text += "\n  size       " + describe(mesh.bounding_box());
  if (mesh.has_deviation()) text += describe(mesh.deviation());
  for (const v1::Channel& channel : mesh.channels()) {
    text += "\n  channel    " + echoed(channel.name()) + ": " + show_number(channel.min_value()) + " to " +
            show_number(channel.max_value());
  }
  for (const v1::CellRegion& region : mesh.cell_regions()) text += describe(region);
  if (mesh.inverted_control_cell_count() > 0) {
    text += "\n  inverted   " + show_count(mesh.inverted_control_cell_count(), "control cell");
  }
  text += describe_faults(mesh);
  return text + "\n  memory     " + show_bytes(mesh.memory_bytes()) + " on the server, prepared in " +
         show_duration(seconds_of(mesh.preparation_time()));
}

std::string describe_faults(const v1::MeshSummary& mesh) {
  std::string text;
  constexpr int kMostFolds = 5;
  for (int i = 0; i < mesh.folds_size() && i < kMostFolds; ++i) text += describe_fold(mesh.folds(i));
  if (mesh.folding_cells() > kMostFolds) {
    text += "\n             and more: " + show_count(mesh.folding_cells()) + " limit cells fold in all";
  }
  if (mesh.undecided_cells() > 0) {
    text += "\n  undecided  " + show_count(mesh.undecided_cells(), "limit cell") + " that may fold, by next to nothing";
  }
  return text + describe_overlaps(mesh.overlaps());
}

std::string describe(const v1::GetServerInfoResponse& info) {
  std::string encodings;
  for (const int encoding : info.encodings()) {
    encodings += (encodings.empty() ? "" : ", ") + encoding_name(static_cast<v1::PlaneEncoding>(encoding));
  }
  std::string printers;
  for (const v1::PrinterProfile& profile : info.printer_profiles()) {
    printers += (printers.empty() ? "" : ", ") + echoed(profile.name());
  }
  return "ccsliced " + echoed(info.server_version()) + ", engine " + echoed(info.engine_version()) + "\n  threads    " +
         std::to_string(info.threads()) + ", up to " + std::to_string(info.max_concurrent_calls()) +
         " calls at once\n  cache      " + show_count(info.cached_meshes()) + " meshes, " +
         show_bytes(info.cache_used_bytes()) + " of " + show_bytes(info.cache_capacity_bytes()) +
         "\n  meshes     up to " + show_bytes(info.max_mesh_bytes()) + ", " +
         show_count(info.mesh_limits().max_cells()) + " cells, " + std::to_string(info.mesh_limits().max_channels()) +
         " channels\n  layers     up to " + show_count(info.slice_limits().max_columns()) + " x " +
         show_count(info.slice_limits().max_rows()) + " voxels, " +
         show_count(info.slice_limits().max_voxels_per_layer()) + " in all; pitch " +
         show_number(info.slice_limits().min_pitch_mm()) + " to " + show_number(info.slice_limits().max_pitch_mm()) +
         " mm\n  encodings  " + encodings + "\n  printers   " + printers;
}

std::string describe(const v1::SnappedCopies& snapped) {
  constexpr double kMicrons = 1000;
  const v1::Vector3& most = snapped.most_mm();
  const auto microns = [](double mm) { return number_text(kMicrons * mm, 3); };
  return (snapped.copies() == 0
              ? std::string("none had to be moved to whole voxels")
              : show_count(snapped.copies()) + " moved to whole voxels, by up to " + microns(most.x()) + ", " +
                    microns(most.y()) + " and " + microns(most.z()) + " um") +
         "; " + show_count(snapped.computed(), "solid") + " to compute";
}

std::string describe(const v1::PlanSlicesResponse& plan) {
  const v1::Grid& grid = plan.grid();
  const v1::VoxelBox region = client::region_of(plan);
  std::string text = show_count(region.extent().columns()) + " x " + show_count(region.extent().rows()) + " voxels, " +
                     show_count(plan.layer_count(), "layer");
  text += "\n  pitch      " + show_size(grid.pitch().x_mm(), grid.pitch().y_mm(), grid.pitch().z_mm()) + " mm";
  text += "\n  grid       " + show_size(plan.size_mm().x(), plan.size_mm().y(), plan.size_mm().z()) + " mm, from (" +
          show_number(grid.origin_mm().x()) + ", " + show_number(grid.origin_mm().y()) + ", " +
          show_number(grid.origin_mm().z()) + ")";
  if (region.extent().SerializeAsString() != grid.extent().SerializeAsString()) {
    text += "\n  region     from column " + std::to_string(region.first_column()) + ", row " +
            std::to_string(region.first_row()) + ", layer " + std::to_string(region.first_layer()) + " of " +
            show_count(grid.extent().columns()) + " x " + show_count(grid.extent().rows()) + " x " +
            show_count(grid.extent().layers());
  }
  text += "\n  part       " + describe(grid.part_box());
  if (plan.has_deviation()) text += describe(deviation_to_tell(plan));
  if (plan.has_snapped()) text += "\n  copies     " + describe(plan.snapped());
  if (plan.raw_bytes() > 0) {
    text += "\n  samples    " + show_bytes(plan.raw_bytes()) + ", " + show_bytes(plan.raw_bytes_per_layer()) +
            " a layer\n  download   about " + show_bytes(plan.estimated_bytes());
  }
  for (const v1::PlanWarning& warning : plan.warnings())
    text += "\n  warning    " + echoed(warning.message(), kMaxMessageBytes);
  return text;
}

}  // namespace ccslice::cli
