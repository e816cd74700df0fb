// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client/cli/base/text_values.h"
#include "client/cli/commands/picture_options.h"
#include "client/cli/options/part_box.h"
#include "client/cli/options/placement.h"
#include "client/cli/options/printing.h"
#include "client/cli/pictures/cut_view.h"
#include "client/cli/pictures/legend.h"
#include "client/cli/pictures/png_file.h"
#include "client/cli/pictures/voxel_block.h"
#include "client/cli/pictures/voxel_surface.h"
#include "client/client_error.h"

namespace ccslice::cli {
namespace {

CutView parse_view(const PictureOptions& options) {
  CutView view;
  view.width = static_cast<int>(options.pixels());
  if (!options.view.empty()) {
    const std::vector<double> angles = parse_numbers("--view", options.view, 2, 2);
    view.azimuth_deg = angles[0];
    view.elevation_deg = angles[1];
  }
  for (const std::string& cut : options.cuts) {
    const std::size_t axis = std::string_view("xyz").find(cut.substr(0, 1));
    const bool whole = cut.size() >= 3 && cut[1] == '=' && axis != std::string_view::npos;
    const double fraction = whole ? parse_number("--cut", std::string_view(cut).substr(2)) : -1;
    if (!(fraction >= 0 && fraction <= 1)) {
      throw UsageError("--cut takes an axis and a fraction of the part's extent from 0 to 1, as in x=0.5, not '" + cut +
                       "'");
    }
    view.cut[axis] = fraction;
  }
  return view;
}

double longest_side(const v1::Box3& box) {
  return std::max(
      {box.max_mm().x() - box.min_mm().x(), box.max_mm().y() - box.min_mm().y(), box.max_mm().z() - box.min_mm().z()});
}

/// Cubic voxels, as many as wanted along the longest side of the box.
v1::SliceRangeRequest block_request(const v1::SliceJob& drawn, const v1::Box3& box, const PictureOptions& options) {
  const double mm = longest_side(box) / options.voxels;
  v1::SliceRangeRequest request;
  v1::SliceJob& job = *request.mutable_job() = drawn;
  *job.mutable_grid()->mutable_pitch() = client::pitch_of(mm, mm, mm);
  if (drawn.has_printing()) {
    ask_for_material_block(job, drawn.printing());
  } else if (options.cell_regions) {
    ask_for_region_block(job);
  } else {
    ask_for_block(job, options.channel);
  }
  return request;
}

/// The surface, so near that no triangle can be told from it in the picture; somewhat coarser where that would be more
/// triangles than the server gives.
client::Surface picture_surface(Session& session, const v1::Part& part, const v1::Box3& box, int width) {
  constexpr double kShareOfPlace = 0.1, kFinestMm = 1e-5, kCoarsestMm = 1e3, kCoarser = 4, kMostPlaces = 2;
  const double place = longest_side(box) / width;
  v1::TessellateBoundaryRequest request;
  request.set_mesh_id(part.mesh_id());
  *request.mutable_placement() = part.placements(0);
  for (double tolerance = kShareOfPlace * place;; tolerance *= kCoarser) {
    request.set_chord_tolerance_mm(std::clamp(tolerance, kFinestMm, kCoarsestMm));
    try {
      return session.client().tessellate(request, session.call());
    } catch (const client::ClientError& error) {
      if (error.reason() != "TOO_MANY_TRIANGLES" || tolerance > kMostPlaces * place) throw;
    }
  }
}

/// Letters that grow with the picture.
int legend_scale(int width) {
  constexpr int kWidthPerDot = 320;
  return std::max(1, width / kWidthPerDot);
}

void ask_for_all_layers(Session& session, v1::SliceRangeRequest& request) {
  v1::PlanSlicesRequest plan;
  *plan.mutable_job() = request.job();
  request.set_layer_count(session.client().plan(plan, session.call()).layer_count());
}

}  // namespace

void check_space_options(const PictureOptions& options) { parse_view(options); }

DrawnPicture draw_in_space(Session& session, const PictureOptions& options, const v1::SliceJob& job) {
  CutView view = parse_view(options);
  const v1::Part& part = job.parts(0);
  const v1::Box3 box = part_box(session, part.mesh_id(), part.placements(0));
  v1::SliceRangeRequest request = block_request(job, box, options);
  ask_for_all_layers(session, request);
  const VoxelBlock block = slice_block(session, request, "slicing");
  client::Surface surface;
  const bool has_void = leaves_empty(job.printing());
  if (job.cut().empty() && !has_void) {
    surface = picture_surface(session, part, box, view.width);
  } else {
    constexpr double kVoxelCreaseDeg = 60;  // Voxels are steps, however smooth the part is.
    surface = voxel_surface(block);
    view.crease_deg = kVoxelCreaseDeg;
    if (surface.triangles.empty()) {
      throw UsageError(
          std::string(has_void ? "--material void" : "--cut-where") +
          " leaves nothing that the voxels of this picture show; leave more of the part, or give more --voxels");
    }
  }
  Picture picture = draw_cut_view(surface, block, view);
  if (!options.no_legend) picture = with_legend(std::move(picture), block.legend, legend_scale(view.width));
  return {to_png(picture), static_cast<std::uint32_t>(picture.width), static_cast<std::uint32_t>(picture.height)};
}

}  // namespace ccslice::cli
