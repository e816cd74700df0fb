// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A folder of layers (layer_folder.h) read back, to be packed for other programs.

#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "client/cli/base/messages.h"

namespace ccslice::cli {

struct StackMaterial {
  std::string name;
  std::uint32_t rgba = 0;
  std::uint64_t voxels = 0;   // In all layers.
  bool leaves_empty = false;  // Nothing is printed there.
};

struct StackPlane {
  std::string content;  // As in manifest.json: "channel", "materials", ...
  std::string channel;  // Its name, if the content is "channel".
  std::string sample_type, encoding;
  std::array<double, 2> value_range = {0, 1};  // What 0 and the largest integer stand for.
};

/// All functions throw Error{kFileUnreadable, kFileSyntax, kFileUnsupported}.
class LayerStack {
 public:
  /// Reads manifest.json.
  explicit LayerStack(std::filesystem::path folder);

  /// The size of the pictures, and their number.
  std::uint32_t columns() const { return columns_; }
  std::uint32_t rows() const { return rows_; }
  std::uint32_t layers() const { return static_cast<std::uint32_t>(manifest_.layers_size()); }
  /// Lower corner of the voxel with the lowest x and y of the first layer here, and the pitch, mm.
  const std::array<double, 3>& origin_mm() const { return origin_mm_; }
  const std::array<double, 3>& pitch_mm() const { return pitch_mm_; }
  /// The part that was sliced, or the first of several.
  const v1::Part& part() const { return manifest_.slice_job().parts(0); }
  /// Or copies of one.
  bool has_several_parts() const { return manifest_.slice_job().parts_size() > 1 || part().placements_size() > 1; }
  /// Whether the layers are a region of the grid, not all of it.
  bool is_region() const { return is_region_; }
  /// Whether the pictures have the highest x, or y, first.
  bool columns_descend() const { return manifest_.layout().flip_x(); }
  bool rows_descend() const { return rows_descend_; }
  const std::vector<StackPlane>& planes() const { return planes_; }
  const std::vector<StackMaterial>& materials() const { return materials_; }
  /// The colour of voxels outside, 0xRRGGBBAA.
  std::uint32_t background_rgba() const { return background_rgba_; }

  /// The bytes of a picture. Compares them with their digest.
  std::string picture(std::uint32_t layer, std::size_t plane) const;
  /// Its samples, row by row. REQUIRES: a channel of 8 bits, as PNG.
  std::string samples(std::uint32_t layer, std::size_t plane) const;

 private:
  void read_grid();
  void read_planes();
  void read_materials();
  const v1::StoredFile& stored(std::uint32_t layer, std::size_t plane) const;
  [[noreturn]] void fail(const std::string& what) const;

  const std::filesystem::path folder_;
  v1::Manifest manifest_;
  std::uint32_t columns_ = 0, rows_ = 0;
  std::array<double, 3> origin_mm_{}, pitch_mm_{};
  bool is_region_ = false, rows_descend_ = false;
  std::vector<StackPlane> planes_;
  std::vector<StackMaterial> materials_;
  std::uint32_t background_rgba_ = 0x000000ff;
};

}  // namespace ccslice::cli
