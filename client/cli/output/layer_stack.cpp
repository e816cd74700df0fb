// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output/layer_stack.h"

#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

#include "client/cli/base/json_fields.h"
#include "client/cli/base/message_json.h"
#include "client/cli/output/manifest.h"
#include "client/cli/pictures/png_file.h"
#include "client/mesh_bytes.h"
#include "core/base/echo.h"
#include "core/base/error.h"
#include "core/base/read_file.h"
#include "core/mesh_import/mesh_file.h"

namespace ccslice::cli {
namespace {

namespace fs = std::filesystem;
using google::protobuf::Struct;

constexpr std::uint64_t kMostFileBytes = std::uint64_t{4} << 30;
constexpr std::uint64_t kMostVoxels = std::numeric_limits<std::uint32_t>::max();  // Along an axis.

std::array<double, 3> triple(const Struct& object, const char* name) {
  const auto& values = items(object, name);
  if (values.size() != 3) return {};
  return {values[0].number_value(), values[1].number_value(), values[2].number_value()};
}

}  // namespace

LayerStack::LayerStack(fs::path folder) : folder_(std::move(folder)) {
  if (!fs::exists(folder_ / "manifest.json")) {
    throw Error(ErrorCode::kFileUnreadable,
                folder_.string() +
                    " holds no manifest.json: it isn't a folder of layers, or the job isn't "
                    "complete (ccslice slice --resume goes on with it)");
  }
  const std::optional<Struct> manifest =
      parse_object(read_file_bytes((folder_ / "manifest.json").string(), kMostFileBytes));
  if (!manifest) fail("isn't a manifest of layers");
  if (const std::string fault = fault_of_manifest(*manifest); !fault.empty()) fail(fault);
  if (manifest->fields().contains("share")) {
    fail("is that of a share of a job; make the job of all its shares first, with ccslice join");
  }
  mesh_id_ = text(*manifest, "mesh_id");
  has_several_parts_ = manifest->fields().contains("parts");
  for (const auto& entry : items(*manifest, "placement")) placement_.push_back(entry.number_value());
  for (const auto& value : items(*manifest, "planes")) {
    const Struct& plane = value.struct_value();
    planes_.push_back(
        {text(plane, "content"), text(plane, "channel"), text(plane, "sample_type"), text(plane, "encoding")});
    const auto& range = items(plane, "value_range");
    if (range.size() == 2) planes_.back().value_range = {range[0].number_value(), range[1].number_value()};
  }
  read_materials(*manifest);
  read_layers(*manifest);
  read_grid(*manifest);
  if (manifest->fields().contains("region")) read_region(*manifest);
  read_layout(*manifest);
}

void LayerStack::read_grid(const Struct& manifest) {
  const Struct& grid = field(manifest, "grid").struct_value();
  columns_ = static_cast<std::uint32_t>(count(grid, "columns", kMostVoxels));
  rows_ = static_cast<std::uint32_t>(count(grid, "rows", kMostVoxels));
  origin_mm_ = triple(grid, "origin_mm");
  pitch_mm_ = triple(grid, "pitch_mm");
  const auto& layers = items(manifest, "layers");
  origin_mm_[2] = number(layers[0].struct_value(), "z_mm") - 0.5 * pitch_mm_[2];
  is_region_ = layers.size() != number(grid, "layers");
  if (columns_ == 0 || rows_ == 0 || !(pitch_mm_[0] > 0 && pitch_mm_[1] > 0 && pitch_mm_[2] > 0)) fail("has no grid");
}

void LayerStack::read_region(const Struct& manifest) {
  const Struct& region = field(manifest, "region").struct_value();
  const auto columns = static_cast<std::uint32_t>(count(region, "columns", kMostVoxels));
  const auto rows = static_cast<std::uint32_t>(count(region, "rows", kMostVoxels));
  if (columns == 0 || rows == 0) fail("has an empty region");
  is_region_ = is_region_ || columns != columns_ || rows != rows_;
  columns_ = columns;
  rows_ = rows;
  origin_mm_[0] += number(region, "first_column") * pitch_mm_[0];
  origin_mm_[1] += number(region, "first_row") * pitch_mm_[1];
}

void LayerStack::read_layout(const Struct& manifest) {
  const Struct& layout = field(manifest, "layout").struct_value();
  columns_descend_ = field(layout, "flip_x").bool_value();
  rows_descend_ = field(layout, "flip_y").bool_value() != (text(layout, "row_order") == "descending");
}

void LayerStack::read_materials(const Struct& manifest) {
  for (const auto& value : items(manifest, "materials")) {
    const Struct& material = value.struct_value();
    const std::optional<std::uint32_t> colour = colour_of_text(text(material, "rgba"));
    if (!colour) fail("has a material without a colour");
    materials_.push_back({text(material, "name"), *colour, count(material, "voxel_count")});
  }
  const Struct& printing = field(manifest, "printing").struct_value();
  if (printing.fields().contains("background_rgba")) {
    const std::optional<std::uint32_t> colour = colour_of_text(text(printing, "background_rgba"));
    if (!colour) fail("has a background without a colour");
    background_rgba_ = *colour;
  }
}

void LayerStack::read_layers(const Struct& manifest) {
  for (const auto& value : items(manifest, "layers")) {
    std::vector<File>& files = files_.emplace_back();
    for (const auto& plane : items(value.struct_value(), "planes")) {
      files.push_back({text(plane.struct_value(), "file"), text(plane.struct_value(), "sha256")});
    }
    if (files.size() != planes_.size()) fail("lacks files of a layer");
  }
  if (files_.empty()) fail("has no layers");
}

std::string LayerStack::picture(std::uint32_t layer, std::size_t plane) const {
  const File& file = files_[layer][plane];
  std::string bytes = read_file_bytes((folder_ / fs::path(file.name).filename()).string(), kMostFileBytes);
  if (client::sha256_of(bytes) != file.sha256) fail("doesn't fit " + echoed(file.name) + ", which has changed since");
  return bytes;
}

std::string LayerStack::samples(std::uint32_t layer, std::size_t plane) const {
  std::optional<std::string> samples = grey_samples(picture(layer, plane), columns_, rows_);
  if (!samples) fail("names " + echoed(files_[layer][plane].name) + ", which isn't a grey picture of its size");
  return std::move(*samples);
}

void LayerStack::fail(const std::string& what) const {
  throw Error(ErrorCode::kFileSyntax, (folder_ / "manifest.json").string() + " " + what);
}

}  // namespace ccslice::cli
