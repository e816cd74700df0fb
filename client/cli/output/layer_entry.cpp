// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output/layer_entry.h"

#include <fstream>
#include <iterator>
#include <system_error>

#include "client/cli/base/json_fields.h"
#include "client/mesh_bytes.h"

namespace ccslice::cli {
namespace {

using google::protobuf::Struct;

FileEntry file_entry(const Struct& entry) {
  return {std::filesystem::path(text(entry, "file")).filename(), count(entry, "file_bytes"), text(entry, "sha256")};
}

}  // namespace

std::vector<FileEntry> files_of_entry(const Struct& layer) {
  std::vector<FileEntry> files;
  for (const auto& plane : items(layer, "planes")) files.push_back(file_entry(plane.struct_value()));
  if (layer.fields().contains("contours")) files.push_back(file_entry(field(layer, "contours").struct_value()));
  return files;
}

client::SliceOutcome counts_of_entry(const Struct& layer) {
  client::SliceOutcome counts;
  counts.layers = 1;
  counts.empty_layers = field(layer, "empty").bool_value();
  counts.voxel_count = count(layer, "voxel_count");
  counts.voxels_interpolated = count(layer, "voxels_interpolated");
  counts.voxels_unresolved = count(layer, "voxels_unresolved");
  counts.voxels_repainted = count(layer, "voxels_repainted");
  counts.max_residual_mm = number(layer, "max_residual_mm");
  for (const auto& voxels : items(layer, "material_voxels")) {
    counts.material_voxels.push_back(static_cast<std::uint64_t>(voxels.number_value()));
  }
  counts.voxels_off_map = count(layer, "voxels_off_map");
  counts.voxels_scaled_up = count(layer, "voxels_scaled_up");
  counts.least_fraction_sum = number(layer, "least_fraction_sum");
  for (const auto& plane : items(layer, "planes")) {
    counts.encoded_bytes += count(plane.struct_value(), "file_bytes");
  }
  return counts;
}

std::optional<std::string> read_whole_file(const std::filesystem::path& folder, const FileEntry& entry) {
  const std::filesystem::path path = folder / entry.name;
  std::error_code status;
  if (std::filesystem::file_size(path, status) != entry.bytes || status) return std::nullopt;
  std::ifstream file(path, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(file), {}};
  if (client::sha256_of(bytes) != entry.sha256) return std::nullopt;
  return bytes;
}

}  // namespace ccslice::cli
