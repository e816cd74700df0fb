// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The folder that sliced layers go to:
//
//   layer_0017_occupancy.png    a picture: .png, .tif, .exr, .zst (one zstd frame) or .bin (samples as they are)
//   layer_0017_hardness.zst
//   layer_0017_contours.json    {"layer":17,"z_mm":...,"loops":[[[x,y],...],...]}, or .csv: loop,x_mm,y_mm
//   contact_sheet.png           some of the layers, small (contact_sheet.h)
//   manifest.json               grid, planes, and for every layer its height, counts, files and checksums
//   journal.jsonl               only while the job isn't complete (job_journal.h)
//
// Layer numbers are the grid's, padded with zeros. manifest.json is written last, once all else is on the disk: a
// folder without it is incomplete. Every file appears whole or not at all.

#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/job_journal.h"
#include "client/cli/json.h"
#include "client/client.h"

namespace ccslice::cli {

enum class ContourFormat { kNone, kJson, kCsv };

/// What to do with layers that are there already.
enum class Existing {
  kRefuse,
  kReplace,
  kResume,  // Go on after those of the same job.
};

/// Throws Error{kFileUnwritable} if the folder holds layers or a manifest.json that `existing` doesn't allow for. Looks
/// only.
void refuse_used_folder(const std::filesystem::path& path, Existing existing);

class LayerFolder {
 public:
  /// Makes the folder. Throws Error{kFileUnwritable}, for layers that are there already too.
  LayerFolder(std::filesystem::path path, const std::vector<v1::PlaneSpec>& planes, ContourFormat contours,
              std::uint32_t grid_layers, Existing existing, const JobKey& job);

  /// Counts of the layers that are there already: the first ones of the job.
  const client::SliceOutcome& finished() const { return finished_.counts; }
  void write(const client::Layer& layer);
  /// `png`: the file's bytes. Returns its path.
  std::filesystem::path write_contact_sheet(const std::string& png);
  /// manifest.json.
  void finish(const client::SliceOutcome& outcome, const v1::Placement& placement);

  std::uint64_t written_bytes() const { return written_bytes_; }

 private:
  std::string layer_prefix(std::uint32_t layer) const;
  void write_file_in_folder(const std::string& name, const std::string& bytes);
  std::string manifest_entry(const client::Layer& layer, const std::string& contours) const;

  const std::filesystem::path path_;
  const ContourFormat contours_;
  const FinishedLayers finished_;
  std::vector<std::string> suffixes_;  // "_hardness.png", one a plane.
  std::size_t digits_;
  std::optional<JobJournal> journal_;
  JsonWriter layers_;
  std::uint64_t written_bytes_ = 0;
};

}  // namespace ccslice::cli
