// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What is to be sliced, and into what: the options of `plan` and `slice`, turned into requests.

#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "ccslice/v1/job.pb.h"
#include "client/cli/options/placement.h"
#include "client/cli/options/printing.h"

namespace ccslice::cli {

struct GridOptions {
  std::string printer = {};    // Name of a profile.
  std::string pitch;           // "0.05" or "0.0423,0.0846,0.03", mm.
  std::string dpi;             // "600" or "600,300".
  double layer_height_mm = 0;  // With dpi.
  std::string origin;
  std::string extent;
  std::string region = {};         // mm.
  std::string region_voxels = {};  // Of the grid.
};

struct LayoutOptions {
  std::string row_order = {};  // Empty: ascending.
  std::string flip = {};       // "x", "y" or "xy".
};

struct PlaneOptions {
  bool occupancy = false;
  std::vector<std::string> channels;  // NAME[:u8|u16|f32[:MIN..MAX]].
  bool all_channels = false;          // One picture of all of them.
  bool masks = false;                 // One picture a material.
  bool cell_regions = false;
  std::string encoding = "auto";
  std::string outside = {};  // A sample, or "alpha".
  std::optional<double> tolerance_mm = std::nullopt;
  std::optional<double> channel_tolerance = std::nullopt;
  bool prove_channels = false;
};

void add_grid_options(CLI::App& command, GridOptions& options);
void add_layout_options(CLI::App& command, LayoutOptions& options);
void add_plane_options(CLI::App& command, PlaneOptions& options);

// All throw UsageError.

v1::GridSpec parse_grid(const GridOptions& options);
/// The region that the options give, or nothing.
[[nodiscard]] std::optional<v1::Region> parse_region(const GridOptions& options);
/// The job but for the id of its mesh, and for what is to be known of its layers.
v1::SliceJob parse_job(const GridOptions& grid, const PlacementOptions& placement, const PrintingOptions& printing);
v1::PictureLayout parse_layout(const LayoutOptions& options);
/// Occupancy first, then the channels in order, then all of them in one, then the materials of `printing` (null if
/// there are none), and a mask for each; occupancy if nothing is named and `contours_only` isn't set.
std::vector<v1::PlaneSpec> parse_planes(const PlaneOptions& options, bool contours_only,
                                        const v1::Printing* printing = nullptr);

}  // namespace ccslice::cli
