// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/pictures/contact_sheet.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>

#include "client/cli/base/console.h"
#include "client/cli/pictures/pixel_font.h"

namespace ccslice::cli {
namespace {

constexpr std::uint32_t kMostLayers = 24;
constexpr int kSheetWidth = 1200, kSheetHeight = 900;
constexpr int kLargestTile = 480;
constexpr int kGap = 8;
constexpr int kCaptionHeight = kGlyphHeight + 6;
constexpr int kNarrowestCell = 15 * kGlyphAdvance;  // Room for a caption.

int cell_width(const SheetLayout& layout) { return std::max(layout.tile_width, kNarrowestCell); }

class Sheet {
 public:
  Sheet(const VoxelBlock& block, const SheetLayout& layout) : block_(block), layout_(layout) {
    const int columns = std::min(layout.columns, block.size[2]);
    const int rows = (block.size[2] + layout.columns - 1) / layout.columns;
    picture_ = blank_picture(kGap + columns * (cell_width(layout) + kGap),
                             kGap + rows * (layout.tile_height + kCaptionHeight + kGap));
  }

  void draw_layer(int layer, const SheetCaption& caption) {
    const int left = kGap + layer % layout_.columns * (cell_width(layout_) + kGap);
    const int top = kGap + layer / layout_.columns * (layout_.tile_height + kCaptionHeight + kGap);
    draw_text(caption.number, left, top, picture_);
    draw_text(caption.height, left + cell_width(layout_) - text_width(caption.height), top, picture_);
    const int tile_left = left + (cell_width(layout_) - layout_.tile_width) / 2;
    for (int row = 0; row < layout_.tile_height; ++row) {
      for (int column = 0; column < layout_.tile_width; ++column) {
        const int x = static_cast<int>((column + 0.5) / layout_.tile_width * block_.size[0]);
        const int y = static_cast<int>((row + 0.5) / layout_.tile_height * block_.size[1]);
        set_colour(tile_left + column, top + kCaptionHeight + row, colour_of(block_.index(x, y, layer)), picture_);
      }
    }
  }

  Picture take() { return std::move(picture_); }

 private:
  Colour colour_of(std::size_t voxel) const {
    return block_.inside[voxel] == 0 ? Colour::Constant(0.93) : block_.colour(voxel);
  }

  const VoxelBlock& block_;
  const SheetLayout layout_;
  Picture picture_;
};

bool shows_materials(const v1::SliceHeader& header) {
  return std::ranges::any_of(
      header.planes(), [](const v1::PlaneSpec& plane) { return plane.has_materials() || plane.has_material_mask(); });
}

bool shows_cell_regions(const v1::SliceHeader& header) {
  return std::ranges::any_of(header.planes(), [](const v1::PlaneSpec& plane) { return plane.has_cell_regions(); });
}

/// The first channel of the job's planes as `channel`, with the range that it is shown in; nothing if there is none.
std::string channel_of(const v1::SliceHeader& header, v1::ValueRange& range) {
  for (const v1::PlaneSpec& plane : header.planes()) {
    if (plane.has_channels()) return plane.channels().names(0);
    if (!plane.has_channel()) continue;
    if (plane.has_value_range()) range = plane.value_range();
    return plane.channel().name();
  }
  return {};
}

/// A grid over the job's region whose layers lie at the heights of those that are spread.
v1::GridSpec sheet_grid(const v1::SliceHeader& header, const SpreadLayers& layers, const SheetLayout& layout) {
  v1::GridSpec sheet;
  const v1::Grid& grid = header.grid();
  const v1::VoxelBox region = client::region_of(header);
  const v1::VoxelPitch& fine = grid.pitch();
  const v1::GridExtent& extent = *sheet.mutable_extent() =
      client::extent_of(std::min(region.extent().columns(), static_cast<std::uint32_t>(layout.tile_width)),
                        std::min(region.extent().rows(), static_cast<std::uint32_t>(layout.tile_height)), layers.count);
  *sheet.mutable_pitch() =
      client::pitch_of(fine.x_mm() * region.extent().columns() / extent.columns(),
                       fine.y_mm() * region.extent().rows() / extent.rows(), fine.z_mm() * layers.stride);
  *sheet.mutable_origin_mm() = client::vector_of(
      grid.origin_mm().x() + region.first_column() * fine.x_mm(),
      grid.origin_mm().y() + region.first_row() * fine.y_mm(),
      grid.origin_mm().z() + (layers.first + 0.5 - 0.5 * static_cast<double>(layers.stride)) * fine.z_mm());
  return sheet;
}

/// A blue-noise mask for the sheet's own pitch would take the server a second.
v1::Printing sheet_printing(const v1::SliceHeader& header) {
  v1::Printing printing = header.printing();
  v1::Halftone& halftone = *printing.mutable_halftone();
  if (halftone.method() == v1::HALFTONE_METHOD_BLUE_NOISE) halftone.set_method(v1::HALFTONE_METHOD_ERROR_DIFFUSION);
  return printing;
}

void ask_for_sheet(const v1::SliceHeader& header, v1::SliceJob& sheet) {
  if (shows_materials(header)) return ask_for_material_block(sheet, sheet_printing(header));
  if (leaves_empty(header.printing())) *sheet.mutable_printing() = sheet_printing(header);
  v1::ValueRange range;
  const std::string channel = channel_of(header, range);
  if (channel.empty() && shows_cell_regions(header)) return ask_for_region_block(sheet);
  ask_for_block(sheet, channel);
  if (range.min() < range.max()) *sheet.mutable_planes(1)->mutable_value_range() = range;
}

v1::SliceRangeRequest sheet_request(const v1::SliceJob& job, const v1::SliceHeader& header, const SpreadLayers& layers,
                                    const SheetLayout& layout) {
  v1::SliceRangeRequest request;
  request.set_layer_count(layers.count);
  v1::SliceJob& sheet = *request.mutable_job();
  *sheet.mutable_parts() = job.parts();
  *sheet.mutable_fields() = job.fields();
  sheet.set_cut(job.cut());
  *sheet.mutable_grid() = sheet_grid(header, layers, layout);
  *sheet.mutable_layout() = job.layout();
  ask_for_sheet(header, sheet);
  return request;
}

}  // namespace

SpreadLayers spread_layers(std::uint32_t first, std::uint32_t count) {
  SpreadLayers layers;
  layers.stride = (count + kMostLayers - 1) / kMostLayers;
  layers.count = (count + layers.stride - 1) / layers.stride;
  const std::uint32_t covered = (layers.count - 1) * layers.stride + 1;
  layers.first = first + (count - covered) / 2;
  return layers;
}

SheetLayout lay_out_sheet(int count, double width_mm, double height_mm) {
  SheetLayout best;
  double best_scale = 0;
  for (int columns = 1; columns <= std::min(count, kSheetWidth / (kNarrowestCell + kGap)); ++columns) {
    const int rows = (count + columns - 1) / columns;
    const double width = std::min(kLargestTile, kSheetWidth / columns - kGap);
    const double height = std::min(kLargestTile, kSheetHeight / rows - kGap - kCaptionHeight);
    const double scale = std::min(width / width_mm, height / height_mm);
    if (scale <= best_scale) continue;
    best_scale = scale;
    best = {columns, std::max(1, static_cast<int>(std::lround(scale * width_mm))),
            std::max(1, static_cast<int>(std::lround(scale * height_mm)))};
  }
  return best;
}

Picture draw_contact_sheet(const VoxelBlock& block, const std::vector<SheetCaption>& captions,
                           const SheetLayout& layout) {
  Sheet sheet(block, layout);
  for (int layer = 0; layer < block.size[2]; ++layer) {
    sheet.draw_layer(layer, captions[static_cast<std::size_t>(layer)]);
  }
  constexpr int kWide = 800;
  Picture picture = sheet.take();
  const int scale = picture.width >= kWide ? 2 : 1;
  return with_legend(std::move(picture), block.legend, scale);
}

Picture contact_sheet(Session& session, const v1::SliceRangeRequest& job, const v1::SliceHeader& header) {
  const v1::Grid& grid = header.grid();
  const v1::GridExtent extent = client::region_of(header).extent();
  const SpreadLayers layers = spread_layers(job.first_layer(), job.layer_count());
  const SheetLayout layout = lay_out_sheet(static_cast<int>(layers.count), grid.pitch().x_mm() * extent.columns(),
                                           grid.pitch().y_mm() * extent.rows());
  std::vector<SheetCaption> captions;
  for (std::uint32_t i = 0; i < layers.count; ++i) {
    const std::uint32_t layer = layers.first + i * layers.stride;
    const double z_mm = grid.origin_mm().z() + (layer + 0.5) * grid.pitch().z_mm();
    captions.push_back({std::to_string(layer), show_number(z_mm) + " mm"});
  }
  const VoxelBlock block =
      slice_block(session, sheet_request(job.job(), header, layers, layout), "drawing the contact sheet");
  return draw_contact_sheet(block, captions, layout);
}

}  // namespace ccslice::cli
