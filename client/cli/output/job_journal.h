// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What lets an interrupted job go on: `journal.jsonl` in the folder of its layers, which says of every layer that is
// there whole what manifest.json will say of it.
//
//   {"format":"ccslice-journal","job":"<JobKey.id>"}
//   {"layer":0, ... "planes":[{"file":"layer_0000_occupancy.png","file_bytes":812,"sha256":"..."}]}
//   ...
//
// A line is written once the layer's files are. The journal goes when manifest.json comes.

#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "client/cli/base/messages.h"
#include "client/cli/base/output_file.h"
#include "client/cli/options/job_share.h"
#include "client/client.h"

namespace ccslice::cli {

struct JobKey {
  std::string id;  // The same for the same layers of the same job by the same engine.
  std::uint32_t layers = 0, first_layer = 0;
  std::optional<ShareRecord> share = std::nullopt;           // If it is of a share.
  std::optional<std::size_t> files_of_layer = std::nullopt;  // How many each has; unset if nobody knows.
};

JobKey job_key_of(const v1::SliceRangeRequest& request, const v1::PlanSlicesResponse& plan,
                  std::string_view contour_format);
/// That of a share. Shares of other sizes have other keys, even where they have the same layers.
JobKey job_key_of(const ShareRecord& record, std::optional<std::size_t> files_of_layer = std::nullopt);

/// Layers that an earlier run finished: the first ones of the job.
struct FinishedLayers {
  google::protobuf::RepeatedPtrField<v1::LayerEntry> layers;
  client::SliceOutcome counts;  // Of these layers; the header is empty.
};

/// What the journal says, or nothing if there is none. Layers count as long as their files are there with the size and
/// digest that the journal says; the job's last layer never does, as somebody has to tell the header. Throws
/// Error{kFileUnwritable} if it is another job's.
FinishedLayers read_journal(const std::filesystem::path& folder, const JobKey& job);

/// Whether the folder's manifest.json is that of this job, with all layers there in the size and digest that it says.
/// False if there is no manifest.json. Throws Error{kFileUnwritable} if it is another job's, or if files of it have
/// changed since.
bool holds_whole_job(const std::filesystem::path& folder, const JobKey& job);

class JobJournal {
 public:
  static constexpr const char* kName = "journal.jsonl";

  /// Begins anew with the finished layers. All throw Error{kFileUnwritable}.
  JobJournal(const std::filesystem::path& folder, const JobKey& job, const FinishedLayers& finished);
  void add(const v1::LayerEntry& layer);
  void remove();

 private:
  [[noreturn]] void fail() const;

  const std::filesystem::path path_;
  Stream file_;
};

}  // namespace ccslice::cli
