// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output/layer_entry.h"

#include <algorithm>
#include <cstddef>
#include <fstream>
#include <iterator>
#include <system_error>

#include "client/mesh_bytes.h"

namespace ccslice::cli {

namespace {

constexpr std::uint32_t kMostParts = 256;  // Of a job: a file that was tampered with can't ask for more.

void add_parts(const v1::LayerEntry& layer, client::SliceOutcome& counts) {
  for (const v1::LayerPart& part : layer.parts()) {
    if (part.part() >= kMostParts) continue;
    counts.parts.resize(std::max<std::size_t>(counts.parts.size(), part.part() + std::size_t{1}));
    v1::PartVoxels& voxels = counts.parts[part.part()];
    voxels.set_voxel_count(part.voxel_count());
    *voxels.mutable_material_voxels() = part.material_voxels();
  }
  for (const v1::LayerOverlap& overlap : layer.overlaps()) {
    v1::PartOverlap& added = counts.overlaps.emplace_back();
    added.set_owner(overlap.owner());
    added.set_covered(overlap.covered());
    added.set_voxel_count(overlap.voxel_count());
    if (overlap.place_mm_size() != 3) continue;
    added.mutable_place_mm()->set_x(overlap.place_mm(0));
    added.mutable_place_mm()->set_y(overlap.place_mm(1));
    added.mutable_place_mm()->set_z(overlap.place_mm(2));
  }
}

}  // namespace

std::vector<v1::StoredFile> files_of_entry(const v1::LayerEntry& layer) {
  std::vector<v1::StoredFile> files(layer.planes().begin(), layer.planes().end());
  if (layer.has_contours()) files.push_back(layer.contours());
  for (v1::StoredFile& file : files) file.set_file(std::filesystem::path(file.file()).filename().string());
  return files;
}

client::SliceOutcome counts_of_entry(const v1::LayerEntry& layer) {
  client::SliceOutcome counts;
  counts.layers = 1;
  counts.empty_layers = layer.empty() ? 1 : 0;
  counts.voxel_count = layer.voxel_count();
  counts.voxels_covered = layer.voxels_covered();
  counts.voxels_cut = layer.voxels_cut();
  counts.voxels_interpolated = layer.voxels_interpolated();
  counts.voxels_unresolved = layer.voxels_unresolved();
  counts.voxels_repainted = layer.voxels_repainted();
  counts.max_residual_mm = layer.max_residual_mm();
  counts.material_voxels = {layer.material_voxels().begin(), layer.material_voxels().end()};
  counts.voxels_off_map = layer.voxels_off_map();
  counts.voxels_scaled_up = layer.voxels_scaled_up();
  counts.least_fraction_sum = layer.least_fraction_sum();
  add_parts(layer, counts);
  for (const v1::StoredFile& plane : layer.planes()) counts.encoded_bytes += plane.file_bytes();
  return counts;
}

std::optional<std::string> read_whole_file(const std::filesystem::path& folder, const v1::StoredFile& entry) {
  const std::filesystem::path path = folder / entry.file();
  std::error_code status;
  if (std::filesystem::file_size(path, status) != entry.file_bytes() || status) return std::nullopt;
  std::ifstream file(path, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(file), {}};
  if (client::sha256_of(bytes) != entry.sha256()) return std::nullopt;
  return bytes;
}

}  // namespace ccslice::cli
