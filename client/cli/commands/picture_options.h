// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The options of `picture`, which draws a part in space, a cut along a plane, a layer, or a sweep of cuts.

#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "ccslice/v1/preview.pb.h"
#include "client/cli/meshes/mesh_source.h"
#include "client/cli/options/job.h"
#include "client/cli/options/part_places.h"
#include "client/cli/options/placement.h"
#include "client/cli/options/printing.h"

namespace ccslice::cli {

struct PictureOptions {
  MeshOptions mesh;
  PartOptions parts;  // Of layers.
  GridOptions grid;
  PlacementOptions placement;
  PrintingOptions printing;
  std::string show, channel, output;
  std::uint32_t pixels = 640;
  bool terminal = false, force = false;
  // Options of planes:
  std::string plane, colours = "viridis", range;
  std::optional<std::uint32_t> layer;
  std::uint32_t sweep = 0, frame_ms = 80;
  std::optional<double> lines;
  bool animate = false;
  // Options of the part in space:
  std::string view;
  std::vector<std::string> cuts;
  std::uint32_t voxels = 240;
  bool cell_regions = false, no_legend = false;

  bool in_space() const { return plane.empty() && !layer && sweep == 0 && !terminal; }
};

inline constexpr std::uint32_t kMostPicturePixels = 2048;

struct DrawnPicture {
  std::string bytes;  // Of the file, or lines of characters for the terminal.
  std::uint32_t width = 0, height = 0;
  std::optional<v1::PreviewHeader> header = std::nullopt;  // Of one plane.
  double character_mm = 0;                                 // For the terminal: the width of one.
};

/// Throws UsageError for options that don't go together. Before anything is uploaded.
void check_plane_options(const PictureOptions& options);
/// `mesh_ids`: of all parts.
DrawnPicture draw_planes(Session& session, const PictureOptions& options, const std::vector<std::string>& mesh_ids);

void check_space_options(const PictureOptions& options);
DrawnPicture draw_in_space(Session& session, const PictureOptions& options, const std::string& mesh_id);

}  // namespace ccslice::cli
