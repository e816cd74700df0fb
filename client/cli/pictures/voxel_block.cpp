// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/pictures/voxel_block.h"

#include <algorithm>
#include <cstdint>
#include <vector>

#include "client/cli/base/console.h"
#include "core/output/region_colours.h"

namespace ccslice::cli {
namespace {

void append_layer(const v1::GridExtent& extent, const client::Layer& layer, VoxelBlock& block) {
  block.size = {static_cast<int>(extent.columns()), static_cast<int>(extent.rows()), block.size[2] + 1};
  const std::size_t columns = extent.columns(), stride = (columns + 7) / 8;
  const std::string& inside = layer.planes[0].samples;
  for (std::size_t row = 0; row < extent.rows(); ++row) {
    for (std::size_t column = 0; column < columns; ++column) {
      const auto bits = static_cast<unsigned char>(inside[row * stride + column / 8]);
      block.inside.push_back(bits >> (7 - column % 8) & 1);
    }
  }
  if (layer.planes.size() > 1) {
    const std::string& values = layer.planes[1].samples;
    block.value.insert(block.value.end(), values.begin(), values.end());
  } else {
    block.value.resize(block.inside.size());
  }
}

v1::PlaneSpec& add_plane(v1::SliceJob& job, v1::SampleType type) {
  v1::PlaneSpec& plane = *job.add_planes();
  plane.set_sample_type(type);
  plane.set_encoding(v1::PLANE_ENCODING_RUNS_ZSTD);
  return plane;
}

Colour colour_of(std::uint32_t rgba) { return Colour(rgba >> 24, rgba >> 16 & 0xff, rgba >> 8 & 0xff) / 255; }

/// What the values of the block's second plane stand for.
Legend legend_of(const v1::SliceHeader& header) {
  if (header.planes_size() < 2) return {};
  const v1::PlaneSpec& plane = header.planes(1);
  Legend legend;
  if (plane.has_channel()) {
    legend.title = plane.channel().name();
    legend.range = {plane.value_range().min(), plane.value_range().max()};
  } else if (plane.has_cell_regions()) {
    legend.title = "cell regions";
    const auto regions = static_cast<std::size_t>(header.cell_region_names_size());
    const std::vector<std::uint32_t> palette = region_palette(regions);
    for (std::size_t i = 0; i < regions; ++i) {
      legend.entries.push_back({header.cell_region_names(static_cast<int>(i)), colour_of(palette[i + 1])});
    }
  } else {
    legend.title = "materials";
    for (const v1::PrintMaterial& material : header.printing().materials()) {
      if (material.leaves_empty()) {
        legend.entries.push_back({material.name() + ", left empty", Colour::Ones()});
      } else {
        legend.entries.push_back({material.name(), colour_of(material.rgba())});
      }
    }
  }
  return legend;
}

void describe_block(const v1::SliceHeader& header, VoxelBlock& block) {
  const v1::Grid& grid = header.grid();
  block.legend = legend_of(header);
  block.origin_mm = Vec3(grid.origin_mm().x(), grid.origin_mm().y(), grid.origin_mm().z());
  block.pitch_mm = Vec3(grid.pitch().x_mm(), grid.pitch().y_mm(), grid.pitch().z_mm());
}

}  // namespace

bool leaves_empty(const v1::Printing& printing) {
  return std::ranges::any_of(printing.materials(), &v1::PrintMaterial::leaves_empty);
}

void ask_for_block(v1::SliceJob& job, const std::string& channel) {
  add_plane(job, v1::SAMPLE_TYPE_BIT).mutable_occupancy();
  if (!channel.empty()) add_plane(job, v1::SAMPLE_TYPE_UINT8).mutable_channel()->set_name(channel);
}

void ask_for_material_block(v1::SliceJob& job, const v1::Printing& printing) {
  *job.mutable_printing() = printing;
  add_plane(job, v1::SAMPLE_TYPE_BIT).mutable_occupancy();
  add_plane(job, v1::SAMPLE_TYPE_UINT8).mutable_materials();
}

void ask_for_region_block(v1::SliceJob& job) {
  add_plane(job, v1::SAMPLE_TYPE_BIT).mutable_occupancy();
  add_plane(job, v1::SAMPLE_TYPE_UINT8).mutable_cell_regions();
}

VoxelBlock slice_block(Session& session, const v1::SliceRangeRequest& request, const std::string& what) {
  VoxelBlock block;
  Progress progress(what, "layers", request.layer_count(), session.quiet());
  session.client().slice(
      request,
      [&](const v1::SliceHeader& header, const client::Layer& layer) {
        if (block.size[2] == 0) describe_block(header, block);
        append_layer(client::region_of(header).extent(), layer, block);
        progress.update(static_cast<std::uint64_t>(block.size[2]));
      },
      session.call());
  return block;
}

}  // namespace ccslice::cli
