// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/preview/layer_painter.h"

#include <utility>
#include <vector>

#include "core/preview/outline_lines.h"
#include "core/preview/pixel_colours.h"
#include "core/preview/plane_painter.h"
#include "core/printing/colour_table.h"

namespace ccslice {
namespace {

PlaneSpec raw_plane(PlaneContent content, SampleType type, std::uint32_t channel = 0) {
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
  job.contours_by_region = false;
  job.planes.clear();
  if (show.printing) job.printing = *show.printing;
  if (show.content == PreviewContent::kHalftone) {
    job.planes = {raw_plane(PlaneContent::kMaterials, SampleType::kUint8)};
    return job;
  }
  job.planes = {raw_plane(PlaneContent::kOccupancy, SampleType::kBit)};
  std::vector<std::uint32_t> channels;
  if (show.content == PreviewContent::kChannel) channels = {show.channel};
  if (show.content == PreviewContent::kMix) channels = channels_of(show.printing->map);
  for (const std::uint32_t channel : channels) {
    job.planes.push_back(raw_plane(PlaneContent::kChannel, SampleType::kFloat32, channel));
  }
  return job;
}

LayerPainter::LayerPainter(std::shared_ptr<const LimitSolid> solid, SliceJob job, PreviewColours show,
                           const CancellationToken& cancel)
    : job_(std::move(job)), show_(std::move(show)), slicer_(std::move(solid), job_, cancel) {
  if (show_.content != PreviewContent::kMix) return;
  mixture_.emplace(*show_.printing, show_.printing->map, colour_table_of(*show_.printing, cancel));
}

PreviewPicture LayerPainter::paint(std::uint32_t index, const CancellationToken& cancel) {
  const Layer layer = slicer_.slice(index, cancel);
  const LayerWindow window = region_of(job_).window();
  PreviewPicture picture;
  picture.columns = window.columns;
  picture.rows = window.rows;
  picture.across_mm = job_.grid.pitch.x_mm;
  picture.up_mm = job_.grid.pitch.y_mm;
  if (show_.content == PreviewContent::kHalftone) {
    material_pixels(layer.planes.front().bytes, *show_.printing, picture);
  } else {
    std::vector<SampleImage> values;
    for (std::size_t p = 1; p < layer.planes.size(); ++p) {
      values.push_back({SampleType::kFloat32, window.columns, window.rows, layer.planes[p].bytes});
    }
    colour_pixels(show_, mixture_ ? &*mixture_ : nullptr, values,
                  runs_of(layer.planes.front().bytes, window.columns, window.rows), picture, cancel);
  }
  const LayerLattice lattice = job_.grid.lattice();
  const Vec2 corner(lattice.x0_mm + window.first_column * lattice.dx_mm,
                    lattice.y0_mm + window.first_row * lattice.dy_mm);
  picture.outlines = outlines_of(layer.contours.loops, corner);
  if (show_.lines) draw_lines(show_, 1, picture, cancel);
  return picture;
}

}  // namespace ccslice
