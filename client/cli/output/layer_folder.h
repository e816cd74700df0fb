// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The folder that sliced layers go to:
//
//   layer_0017_...              the files of layers (layer_files.h)
//   contact_sheet.png           some of the layers, small (contact_sheet.h)
//   manifest.json               grid, planes, and for every layer its height, counts, files and checksums
//   journal.jsonl               only while the job isn't complete (job_journal.h)
//   .ccslice.lock               only while a job runs (folder_lock.h)
//
// manifest.json is written last, once all else is on the disk: a folder without it is incomplete. Every file appears
// whole or not at all.

#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "client/cli/base/messages.h"
#include "client/cli/output/folder_lock.h"
#include "client/cli/output/job_journal.h"
#include "client/cli/output/layer_files.h"
#include "client/cli/output/layer_sink.h"
#include "client/client.h"

namespace ccslice::cli {

/// What to do with layers that are there already.
enum class Existing {
  kRefuse,
  kReplace,
  kResume,  // Go on after those of the same job.
};

/// Throws Error{kFileUnwritable} if the folder holds layers or a manifest.json that `existing` doesn't allow for, or if
/// another job is writing to it. Looks only.
void refuse_used_folder(const std::filesystem::path& path, Existing existing);

/// A folder that one job writes to: made, locked, and without what an earlier run left, except for what `existing`
/// keeps. All throw Error{kFileUnwritable}.
class ClaimedFolder {
 public:
  ClaimedFolder(std::filesystem::path path, Existing existing);

  const std::filesystem::path& path() const { return path_; }
  /// Removes layers, manifest, contact sheet and journal.
  void clear();
  /// Writes manifest.json once all else is on the disk.
  void complete(const std::string& manifest);

 private:
  const std::filesystem::path path_;
  const FolderLock lock_;
};

class LayerFolder : public LayerSink {
 public:
  /// Makes the folder. Throws Error{kFileUnwritable}, for layers that are there already and for other jobs in it too.
  LayerFolder(std::filesystem::path path, LayerFiles files, Existing existing, const JobKey& job);

  const client::SliceOutcome& finished() const override { return finished_.counts; }
  void write(const client::Layer& layer) override;
  std::string write_contact_sheet(const std::string& png) override;
  void finish(const client::SliceOutcome& outcome, const v1::SliceJob& sliced,
              const v1::PlanSlicesResponse& plan) override;
  std::uint64_t written_bytes() const override { return written_bytes_; }

 private:
  void write_file_in_folder(const std::string& name, std::string_view bytes);

  std::optional<ClaimedFolder> folder_;  // Until it is finished.
  const LayerFiles files_;
  JobKey job_;
  FinishedLayers finished_;  // Its layers are in the manifest.
  std::optional<JobJournal> journal_;
  v1::Manifest manifest_;
  std::uint64_t written_bytes_ = 0;
};

}  // namespace ccslice::cli
