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
#include "client/cli/commands/job_options.h"

namespace ccslice::cli {

struct PictureOptions {
  JobOptions job;
  std::string show, channel, output;
  std::optional<std::uint32_t> given_pixels;
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
  /// Along the longer side, or characters across.
  std::uint32_t pixels() const { return given_pixels.value_or(terminal ? kTerminalWidth : kPixels); }

  static constexpr std::uint32_t kPixels = 640, kTerminalWidth = 78;
};

inline constexpr std::uint32_t kMostPicturePixels = 2048;

/// The content that --show names, or that the other options suggest. `has_materials`: the job or the options name some.
std::string what_to_show(const PictureOptions& options, bool has_materials);

struct DrawnPicture {
  std::string bytes;  // Of the file, or lines of characters for the terminal.
  std::uint32_t width = 0, height = 0;
  std::optional<v1::PreviewHeader> header = std::nullopt;  // Of one plane.
  double character_mm = 0;                                 // For the terminal: the width of one.
  std::vector<std::string> materials = {};                 // Names, as header->material_pixels() counts them.
};

/// The job whose layer is drawn, or one with the part's placement and printing only, but for the ids of meshes. Throws
/// UsageError.
v1::SliceJob job_to_draw(const PictureOptions& options);

/// The request, but for what it takes the meshes to know: ids, and a free plane. Throws UsageError.
v1::PreviewRequest request_of(const PictureOptions& options, const v1::SliceJob& job);
/// `job`: with the meshes' ids, here and below.
DrawnPicture draw_planes(Session& session, const PictureOptions& options, const v1::SliceJob& job);

/// Throws UsageError for options of the part in space that can't be read.
void check_space_options(const PictureOptions& options);
DrawnPicture draw_in_space(Session& session, const PictureOptions& options, const v1::SliceJob& job);

}  // namespace ccslice::cli
