// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The folder that sliced layers go to:
//
//   layer_0017_occupancy.png    a picture: .png, .tif, .exr, .zst (one zstd frame) or .bin (samples as they are)
//   layer_0017_hardness.zst
//   layer_0017_contours.json    {"layer":17,"z_mm":...,"loops":[[[x,y],...],...]}, or .csv: loop,x_mm,y_mm
//   manifest.json               grid, planes, and for every layer its height, counts, files and checksums
//
// Layer numbers are the grid's, padded with zeros. manifest.json is written last: a folder without it is incomplete.
// Every file appears whole or not at all.

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "client/cli/json.h"
#include "client/client.h"

namespace ccslice::cli {

enum class ContourFormat { kNone, kJson, kCsv };

/// Throws Error{kFileUnwritable} if the folder holds layers or a manifest.json, unless `force`. Looks only.
void refuse_used_folder(const std::filesystem::path& path, bool force);

class LayerFolder {
 public:
  /// Makes the folder. Layers or a manifest.json that are there already: removed with `force`, else an error. Throws
  /// Error{kFileUnwritable}.
  LayerFolder(std::filesystem::path path, const std::vector<v1::PlaneSpec>& planes, ContourFormat contours,
              std::uint32_t grid_layers, bool force);

  void write(const client::Layer& layer);
  /// manifest.json.
  void finish(const client::SliceOutcome& outcome, const v1::Placement& placement);

  std::uint64_t written_bytes() const { return written_bytes_; }

 private:
  std::string layer_prefix(std::uint32_t layer) const;
  void write_file_in_folder(const std::string& name, const std::string& bytes);
  void add_to_manifest(const client::Layer& layer);

  const std::filesystem::path path_;
  const ContourFormat contours_;
  std::vector<std::string> suffixes_;  // "_hardness.png", one a plane.
  std::size_t digits_;
  JsonWriter layers_;
  std::uint64_t written_bytes_ = 0;
};

}  // namespace ccslice::cli
