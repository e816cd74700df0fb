// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/preview/layer_painter.h"

#include <list>
#include <utility>
#include <vector>

#include "core/output/arrange.h"
#include "core/preview/outline_lines.h"
#include "core/preview/plane_painter.h"

namespace ccslice {
namespace {

PlaneSpec raw_plane(PlaneContent content, SampleType type, const std::string& channel = "") {
  PlaneSpec plane;
  plane.content = content;
  plane.sample_type = type;
  plane.encoding = Encoding::kRaw;
  plane.channel = channel;
  return plane;
}

/// The runs of a picture's bits.
std::vector<VoxelRun> runs_of(std::span<const std::uint8_t> bits, std::uint32_t columns, std::uint32_t rows) {
  std::vector<VoxelRun> runs;
  const std::size_t row_bytes = (columns + 7) / 8;
  for (std::uint32_t y = 0; y < rows; ++y) {
    const auto inside = [&](std::uint32_t x) { return bits[row_bytes * y + x / 8] >> (7 - x % 8) & 1; };
    for (std::uint32_t x = 0; x < columns; ++x) {
      if (!inside(x)) continue;
      const std::uint32_t begin = x;
      while (x < columns && inside(x)) ++x;
      runs.push_back({y, begin, x});
    }
  }
  return runs;
}

}  // namespace

SliceJob layer_preview_job(SliceJob job, const PreviewColours& show, bool contours) {
  job.order = {};
  job.contours = contours || show.lines;
  job.contours_by_cell_region = false;
  if (show.content == PreviewContent::kMix) *job.printing = mixed_only(*job.printing);
  if (show.content == PreviewContent::kMix || show.content == PreviewContent::kHalftone) {
    job.planes = {raw_plane(PlaneContent::kMaterials, SampleType::kUint8)};
    return job;
  }
  job.planes = {raw_plane(PlaneContent::kOccupancy, SampleType::kBit)};
  if (show.content == PreviewContent::kChannel) {
    job.planes.push_back(raw_plane(PlaneContent::kChannel, SampleType::kFloat32, show.channel));
  }
  return job;
}

LayerPainter::LayerPainter(const PlacedParts& parts, PreviewColours show, const CancellationToken& cancel,
                           std::span<const std::optional<bool>> tiles_fit)
    : job_(parts.front().job), show_(std::move(show)), slicer_(parts, cancel, tiles_fit) {}

/// The parts that were sliced, the lowest first.
void LayerPainter::mix(PreviewPicture& picture, const CancellationToken& cancel) const {
  const LayerWindow region = region_of(job_).window();
  std::vector<MixedPixels> parts;
  std::list<std::vector<std::uint8_t>> cropped;
  const std::span<const PaintedPart> painted = slicer_.painted();
  for (std::size_t left = painted.size(); left > 0; --left) {
    const PaintedPart& part = painted[left - 1];
    MixedPixels& mixed = parts.emplace_back(MixedPixels{part.halftone, {}, {}});
    for (const ContonePlane& plane : part.mixed) {
      const auto samples = arrange(plane.image().samples, plane.image().outside, {part.window, region, {}},
                                   cropped.emplace_back(), cancel);
      mixed.values.push_back({SampleType::kFloat32, region.columns, region.rows, samples});
    }
    const auto add = [&](const VoxelRun& run, std::size_t mixture) {
      VoxelRun kept = region.clipped(run);
      if (kept.begin == kept.end) return;
      mixed.runs.push_back(
          {{kept.row - region.first_row, kept.begin - region.first_column, kept.end - region.first_column}, mixture});
    };
    if (part.halftone->printing().cell_region_maps.empty()) {
      for (const VoxelRun& span : part.shape->spans) add(span, 0);
    } else {
      for (const MixedRun& run : mixed_runs(*part.halftone, part.shape->regions)) add(run, run.mixture);
    }
  }
  mix_pixels(parts, picture, cancel);
}

PreviewPicture LayerPainter::paint(std::uint32_t index, const CancellationToken& cancel) {
  const Layer layer = slicer_.slice(index, cancel);
  const LayerWindow window = region_of(job_).window();
  PreviewPicture picture;
  picture.columns = window.columns;
  picture.rows = window.rows;
  picture.across_mm = job_.grid.pitch.x_mm;
  picture.up_mm = job_.grid.pitch.y_mm;
  if (show_.content == PreviewContent::kMix) {
    mix(picture, cancel);
  } else if (show_.content == PreviewContent::kHalftone) {
    material_pixels(layer.planes.front().bytes, *job_.printing, picture);
  } else {
    std::vector<SampleImage> values;
    for (std::size_t p = 1; p < layer.planes.size(); ++p) {
      values.push_back({SampleType::kFloat32, window.columns, window.rows, layer.planes[p].bytes});
    }
    colour_pixels(show_, values, runs_of(layer.planes.front().bytes, window.columns, window.rows), picture);
  }
  const LayerLattice lattice = job_.grid.lattice();
  const Vec2 corner(lattice.x0_mm + window.first_column * lattice.dx_mm,
                    lattice.y0_mm + window.first_row * lattice.dy_mm);
  picture.outlines = outlines_of(layer.contours.loops, corner);
  if (show_.lines) draw_lines(show_, 1, picture, cancel);
  return picture;
}

}  // namespace ccslice
