// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The files of a layer, wherever they go:
//
//   layer_0017_occupancy.png    a picture: .png, .tif, .exr, .zst (one zstd frame) or .bin (samples as they are)
//   layer_0017_hardness.zst
//   layer_0017_contours.json    {"layer":17,"z_mm":...,"loops":[[[x,y],...],...]}, or .csv: loop,x_mm,y_mm; of contours
//                               by region also "cell_regions":[1,...], the number of each loop's, or a fourth column;
//                               otherwise "faces" and "parameters" of all points; or .svg: a path in mm, y upwards
//
// Layer numbers are the grid's, padded with zeros; other LayerNames give slice_0.png, slice_1.png, ... instead.

#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "client/cli/base/messages.h"
#include "client/client.h"

namespace ccslice::cli {

inline constexpr const char* kManifest = "manifest.json";
inline constexpr const char* kContactSheet = "contact_sheet.png";

enum class ContourFormat { kNone, kJson, kCsv, kSvg };

struct ContourFiles {
  ContourFormat format = ContourFormat::kNone;
  bool by_region = false;
  std::array<double, 4> box_mm = {};  // What drawings show: the grid's lowest x and y, width and height.
  bool by_part = false;               // Which placed part each is of, in jobs of several.
};

/// How the files of layers are named.
struct LayerNames {
  bool plain = false;          // slice_17.png: not padded, and without the name of the one plane.
  std::uint32_t number_0 = 0;  // The layer that gets number 0.
};

struct LayerFile {
  std::string name, bytes;
};

/// Whether it is the name of a layer's file, of whatever job.
bool is_layer_file(const std::string& name);

class LayerFiles {
 public:
  /// REQUIRES: one plane, if names are plain.
  LayerFiles(const std::vector<v1::PlaneSpec>& planes, ContourFiles contours, std::uint32_t grid_layers,
             LayerNames names = {});

  /// A file for each plane, then that of the contours if there is one.
  std::vector<LayerFile> of(const client::Layer& layer) const;
  /// What manifest.json says of the layer. `files`: of(layer).
  v1::LayerEntry manifest_entry(const client::Layer& layer, const std::vector<LayerFile>& files) const;

 private:
  std::string prefix_of(std::uint32_t layer) const;

  const ContourFiles contours_;
  const LayerNames names_;
  const std::vector<std::string> suffixes_;  // "_hardness.png", one a plane.
  const std::size_t digits_;
};

}  // namespace ccslice::cli
