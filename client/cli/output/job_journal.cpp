// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output/job_journal.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <system_error>
#include <utility>
#include <vector>

#include "client/cli/base/message_json.h"
#include "client/cli/output/layer_entry.h"
#include "client/mesh_bytes.h"
#include "core/base/error.h"
#include "core/base/read_file.h"

namespace ccslice::cli {
namespace {

namespace fs = std::filesystem;

bool is_whole_layer(const fs::path& folder, const JobKey& job, const v1::LayerEntry& layer) {
  const std::vector<v1::StoredFile> files = files_of_entry(layer);
  return files.size() == job.files_of_layer.value_or(files.size()) &&
         std::ranges::all_of(files,
                             [&](const v1::StoredFile& file) { return read_whole_file(folder, file).has_value(); });
}

std::string first_line(const std::string& job_id) {
  v1::JournalHead head;
  head.set_format("ccslice-journal");
  head.set_job(job_id);
  return json_of(head);
}

}  // namespace

JobKey job_key_of(const v1::SliceRangeRequest& request, const v1::PlanSlicesResponse& plan,
                  std::string_view contour_format) {
  const std::string job = request.SerializeAsString() + plan.engine_version() + plan.grid().SerializeAsString() +
                          std::string(contour_format);
  const auto files = static_cast<std::size_t>(request.job().planes_size() + (request.job().has_contours() ? 1 : 0));
  return {client::sha256_of(job), request.layer_count(), request.first_layer(), std::nullopt, files};
}

JobKey job_key_of(const ShareRecord& record, std::optional<std::size_t> files_of_layer) {
  const std::string job = record.job_id + " " + describe(record.share);
  return {client::sha256_of(job), record.layers.last - record.layers.first + 1, record.layers.first, record,
          files_of_layer};
}

bool holds_whole_job(const fs::path& folder, const JobKey& job) {
  constexpr std::uint64_t kMostBytes = std::uint64_t{4} << 30;
  const fs::path path = folder / "manifest.json";
  if (!fs::exists(path)) return false;
  v1::Manifest manifest;
  const bool readable = read_json(read_file_bytes(path.string(), kMostBytes), manifest);
  const std::string remedy = "; take another folder, or --force to replace them";
  if (!readable || manifest.job() != job.id) {
    throw Error(ErrorCode::kFileUnwritable, folder.string() + " holds all layers of another job" + remedy);
  }
  std::uint64_t next = job.first_layer;
  const bool whole = std::ranges::all_of(manifest.layers(), [&](const v1::LayerEntry& layer) {
    return layer.layer() == next++ && is_whole_layer(folder, job, layer);
  });
  if (!whole || next != std::uint64_t{job.first_layer} + job.layers) {
    throw Error(ErrorCode::kFileUnwritable,
                folder.string() + " holds this job, but files of it have changed since it was complete" + remedy);
  }
  return true;
}

FinishedLayers read_journal(const fs::path& folder, const JobKey& job) {
  FinishedLayers finished;
  std::ifstream file(folder / JobJournal::kName);
  std::string line;
  if (!std::getline(file, line)) return finished;
  if (line != first_line(job.id)) {
    throw Error(ErrorCode::kFileUnwritable, folder.string() +
                                                " holds layers of another job, or of another version of the server; "
                                                "take another folder, or --force to replace them");
  }
  while (finished.counts.layers + 1 < job.layers && std::getline(file, line)) {
    v1::LayerEntry layer;
    const std::uint64_t next = job.first_layer + finished.counts.layers;  // A line may be there twice, or be missing.
    if (!read_json(line, layer) || layer.layer() != next || !is_whole_layer(folder, job, layer)) break;
    finished.counts.add_counts(counts_of_entry(layer));
    *finished.layers.Add() = std::move(layer);
  }
  return finished;
}

JobJournal::JobJournal(const fs::path& folder, const JobKey& job, const FinishedLayers& finished)
    : path_(folder / kName), file_(nullptr, std::fclose) {
  std::string text = first_line(job.id) + "\n";
  for (const v1::LayerEntry& layer : finished.layers) text += json_of(layer) + "\n";
  write_file(path_, text);
  file_ = open_to_append(path_);
}

void JobJournal::add(const v1::LayerEntry& layer) {
  const std::string line = json_of(layer) + "\n";
  if (std::fputs(line.c_str(), file_.get()) < 0 || std::fflush(file_.get()) != 0) fail();
}

void JobJournal::remove() {
  file_.reset();
  std::error_code ignored;
  fs::remove(path_, ignored);
}

void JobJournal::fail() const {
  throw Error(ErrorCode::kFileUnwritable, "cannot write " + path_.string() + ": " + std::strerror(errno));
}

}  // namespace ccslice::cli
