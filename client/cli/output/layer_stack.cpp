// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output/layer_stack.h"

#include <cstdint>
#include <optional>
#include <utility>

#include "client/cli/base/message_json.h"
#include "client/cli/output/manifest.h"
#include "client/cli/pictures/png_file.h"
#include "client/mesh_bytes.h"
#include "core/base/echo.h"
#include "core/base/error.h"
#include "core/base/read_file.h"

namespace ccslice::cli {
namespace {

namespace fs = std::filesystem;
constexpr std::uint64_t kMostFileBytes = std::uint64_t{4} << 30;
std::array<double, 3> triple(const google::protobuf::RepeatedField<double>& values) {
  if (values.size() != 3) return {};
  return {values[0], values[1], values[2]};
}

}  // namespace

LayerStack::LayerStack(fs::path folder) : folder_(std::move(folder)) {
  if (!fs::exists(folder_ / "manifest.json")) {
    throw Error(ErrorCode::kFileUnreadable,
                folder_.string() +
                    " holds no manifest.json: it isn't a folder of layers, or the job isn't "
                    "complete (ccslice slice --resume goes on with it)");
  }
  const std::string fault =
      read_manifest(read_file_bytes((folder_ / "manifest.json").string(), kMostFileBytes), manifest_);
  if (!fault.empty()) fail(fault);
  if (manifest_.has_share()) {
    fail("is that of a share of a job; make the job of all its shares first, with ccslice join");
  }
  read_planes();
  read_materials();
  read_grid();
  rows_descend_ = manifest_.layout().flip_y() != (manifest_.layout().row_order() == "descending");
}

void LayerStack::read_planes() {
  for (const v1::Plane& plane : manifest_.planes()) {
    planes_.push_back({plane.content(), plane.channel(), plane.sample_type(), plane.encoding()});
    if (plane.value_range_size() == 2) planes_.back().value_range = {plane.value_range(0), plane.value_range(1)};
  }
  if (manifest_.layers().empty()) fail("has no layers");
  std::uint64_t number = manifest_.layers(0).layer();
  for (const v1::LayerEntry& layer : manifest_.layers()) {
    if (layer.layer() != number++) fail("doesn't have its layers in order, each once");
    if (static_cast<std::size_t>(layer.planes_size()) != planes_.size()) fail("lacks files of a layer");
  }
}

void LayerStack::read_grid() {
  const v1::VoxelGrid& grid = manifest_.grid();
  columns_ = grid.columns();
  rows_ = grid.rows();
  origin_mm_ = triple(grid.origin_mm());
  pitch_mm_ = triple(grid.pitch_mm());
  origin_mm_[2] = manifest_.layers(0).z_mm() - 0.5 * pitch_mm_[2];
  is_region_ = layers() != grid.layers();
  if (columns_ == 0 || rows_ == 0 || !(pitch_mm_[0] > 0 && pitch_mm_[1] > 0 && pitch_mm_[2] > 0)) fail("has no grid");
  if (!manifest_.has_region()) return;
  const v1::DeliveredBox& region = manifest_.region();
  if (region.columns() == 0 || region.rows() == 0) fail("has an empty region");
  is_region_ = is_region_ || region.columns() != columns_ || region.rows() != rows_;
  columns_ = region.columns();
  rows_ = region.rows();
  origin_mm_[0] += region.first_column() * pitch_mm_[0];
  origin_mm_[1] += region.first_row() * pitch_mm_[1];
}

void LayerStack::read_materials() {
  for (const v1::MaterialVoxels& material : manifest_.materials()) {
    const std::optional<std::uint32_t> colour = colour_of_text(material.rgba());
    if (!colour) fail("has a material without a colour");
    materials_.push_back({material.name(), *colour, material.voxel_count(), material.leaves_empty()});
  }
  const v1::Printing& printing = manifest_.slice_job().printing();
  if (printing.has_background_rgba()) background_rgba_ = printing.background_rgba();
}

const v1::StoredFile& LayerStack::stored(std::uint32_t layer, std::size_t plane) const {
  return manifest_.layers(static_cast<int>(layer)).planes(static_cast<int>(plane));
}

std::string LayerStack::picture(std::uint32_t layer, std::size_t plane) const {
  const v1::StoredFile& file = stored(layer, plane);
  std::string bytes = read_file_bytes((folder_ / fs::path(file.file()).filename()).string(), kMostFileBytes);
  if (client::sha256_of(bytes) != file.sha256())
    fail("doesn't fit " + echoed(file.file()) + ", which has changed since");
  return bytes;
}

std::string LayerStack::samples(std::uint32_t layer, std::size_t plane) const {
  std::optional<std::string> samples = grey_samples(picture(layer, plane), columns_, rows_);
  if (!samples) fail("names " + echoed(stored(layer, plane).file()) + ", which isn't a grey picture of its size");
  return std::move(*samples);
}

void LayerStack::fail(const std::string& what) const {
  throw Error(ErrorCode::kFileSyntax, (folder_ / "manifest.json").string() + " " + what);
}

}  // namespace ccslice::cli
