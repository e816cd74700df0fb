// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/preview/layer_painter.h"

#include <utility>
#include <vector>

#include "core/preview/outline_lines.h"
#include "core/preview/pixel_colours.h"
#include "core/preview/plane_painter.h"

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

/// The runs of a picture of regions: 1 + the number of each, 0 outside.
std::vector<RegionRun> region_runs_of(std::span<const std::uint8_t> numbers, std::uint32_t columns,
                                      std::uint32_t rows) {
  std::vector<RegionRun> runs;
  for (std::uint32_t y = 0; y < rows; ++y) {
    const std::span<const std::uint8_t> row = numbers.subspan(std::size_t{columns} * y, columns);
    for (std::uint32_t begin = 0, end = 0; begin < columns; begin = end) {
      while (end < columns && row[end] == row[begin]) ++end;
      if (row[begin] != 0) runs.push_back({{y, begin, end}, static_cast<std::uint8_t>(row[begin] - 1)});
    }
  }
  return runs;
}

bool mixes_by_region(const PreviewColours& show) {
  return show.content == PreviewContent::kMix && !show.printing->cell_region_maps.empty();
}

}  // namespace

SliceJob layer_preview_job(SliceJob job, const PreviewColours& show, bool contours) {
  job.order = {};
  job.contours = contours || show.lines;
  job.contours_by_cell_region = false;
  job.planes.clear();
  if (show.printing) job.printing = *show.printing;
  if (show.content == PreviewContent::kHalftone) {
    job.planes = {raw_plane(PlaneContent::kMaterials, SampleType::kUint8)};
    return job;
  }
  job.planes = {mixes_by_region(show) ? raw_plane(PlaneContent::kCellRegions, SampleType::kUint8)
                                      : raw_plane(PlaneContent::kOccupancy, SampleType::kBit)};
  std::vector<std::uint32_t> channels;
  if (show.content == PreviewContent::kChannel) channels = {show.channel};
  if (show.content == PreviewContent::kMix) channels = channels_of(*show.printing);
  for (const std::uint32_t channel : channels) {
    job.planes.push_back(raw_plane(PlaneContent::kChannel, SampleType::kFloat32, channel));
  }
  return job;
}

LayerPainter::LayerPainter(std::shared_ptr<const LimitSolid> solid, SliceJob job, PreviewColours show,
                           const CancellationToken& cancel)
    : job_(std::move(job)), show_(std::move(show)), slicer_(std::move(solid), job_, cancel) {
  if (show_.content != PreviewContent::kMix) return;
  plan_.emplace(plan_of_mix(*show_.printing, cancel));
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
    const std::vector<std::uint8_t>& inside = layer.planes.front().bytes;
    if (mixes_by_region(show_)) {
      mix_pixels(*plan_, values, mixed_runs(*plan_, region_runs_of(inside, window.columns, window.rows)), picture,
                 cancel);
    } else if (plan_) {
      std::vector<MixedRun> runs;
      for (const VoxelRun& run : runs_of(inside, window.columns, window.rows)) runs.push_back({run, 0});
      mix_pixels(*plan_, values, runs, picture, cancel);
    } else {
      colour_pixels(show_, values, runs_of(inside, window.columns, window.rows), picture);
    }
  }
  const LayerLattice lattice = job_.grid.lattice();
  const Vec2 corner(lattice.x0_mm + window.first_column * lattice.dx_mm,
                    lattice.y0_mm + window.first_row * lattice.dy_mm);
  picture.outlines = outlines_of(layer.contours.loops, corner);
  if (show_.lines) draw_lines(show_, 1, picture, cancel);
  return picture;
}

}  // namespace ccslice
