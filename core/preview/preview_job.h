// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What a picture of a cut is to show.

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/colour_map.h"
#include "core/base/types.h"
#include "core/channel/channel_source.h"
#include "core/job/grid.h"
#include "core/limit/limit_solid.h"
#include "core/output/plane.h"
#include "core/preview/preview_plane.h"
#include "core/printing/printing.h"

namespace ccslice {

enum class PreviewContent : std::uint8_t {
  kOccupancy,  // Material or none.
  kChannel,    // A channel through a colour map.
  kMix,        // The colour of the materials' mix, which adds up in linear light.
  kHalftone,   // In planes: the material of the job's voxel that the pixel lies in, by the fractions at the pixel. In
               // layers: the voxels' own.
};

/// The outlines of the cut, drawn on top.
struct PreviewLines {
  double width_pixels = 1.5;  // Of the full picture.
  Srgb colour = {0, 0, 0};
};

inline constexpr double kMinLineWidthPixels = 0.25, kMaxLineWidthPixels = 16;

/// What the pixels show.
struct PreviewColours {
  PreviewContent content = PreviewContent::kOccupancy;
  std::string channel;  // kChannel.
  ColourMapName colours = ColourMapName::kViridis;
  std::optional<ValueRange> range;  // kChannel. DEFAULT: from the lowest to the highest value of the picture.
  // REQUIRED by kMix and kHalftone. What is made of it is kept as long as it is the same object.
  std::shared_ptr<const Printing> printing;
  std::optional<PreviewLines> lines;
};

struct PreviewJob {
  Placement placement = Placement::Identity();
  PreviewPlane plane;
  ChannelSources sources;          // Of channels besides the solid's own.
  std::optional<std::string> cut;  // As in SliceJob.
  PreviewColours show;
  std::optional<Grid> voxels;  // REQUIRED by kHalftone: the grid of the job that prints.
  bool contours = false;       // Give the outlines too, drawn or not.
};

/// What lies beyond a fixed range counts in the first and in the last.
inline constexpr std::size_t kValueBins = 64;

enum class PreviewStage : std::uint8_t {
  kCoarse,  // An eighth as fine each way: contours to half a pixel, materials to 1/32 of the range shown.
  kFull,    // Contours to a tenth of a pixel, materials to 1/256.
};

struct PreviewPicture {
  std::uint32_t columns = 0, rows = 0;
  double across_mm = 0, up_mm = 0;  // Of a pixel.
  std::vector<std::uint8_t> rgba;   // Rows from the top, 4 bytes a pixel, not premultiplied; all 0 outside.
  std::uint64_t pixels_inside = 0;
  std::optional<ValueRange> range;             // kChannel: of the colours; nothing if no pixel is inside.
  std::vector<std::uint64_t> value_pixels;     // kChannel: by value, in kValueBins even steps of the range.
  std::vector<std::uint64_t> material_pixels;  // kHalftone: of material 1, 2, ...
  std::vector<std::vector<Vec2>> outlines;     // If asked for: closed, in mm from the picture's lower left corner.
};

/// Throws Error{kChannelUnknown, kValueRangeInvalid, kContentInvalid}, and for printed contents
/// Error{kMaterialsMissing} and what validate_printing() throws. `sources`: as in PreviewJob.
void validate_colours(const SolidSummary& summary, const PreviewColours& show, const ChannelSources& sources = {});

/// Throws what validate_plane(), validate_placement() and validate_colours() throw, and Error{kContentInvalid}: error
/// diffusion has no threshold of a voxel's own.
void validate_preview(const SolidSummary& summary, const PreviewJob& job, const SliceLimits& limits = {});

}  // namespace ccslice
