// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output/layer_folder.h"

#include <system_error>
#include <utility>

#include "client/cli/base/console.h"
#include "client/cli/base/message_json.h"
#include "client/cli/base/output_file.h"
#include "client/cli/output/manifest.h"
#include "client/mesh_bytes.h"
#include "core/base/error.h"

namespace ccslice::cli {
namespace {

namespace fs = std::filesystem;

/// Files of ours from an earlier run.
bool is_ours(const fs::path& path) {
  const std::string name = path.filename().string();
  return name == kManifest || name == kContactSheet || name == JobJournal::kName || is_layer_file(name);
}

/// Nothing if there is no such folder.
std::vector<fs::path> files_of_ours(const fs::path& path) {
  std::vector<fs::path> files;
  std::error_code status;
  if (!fs::exists(path, status)) return files;
  for (const fs::directory_entry& entry : fs::directory_iterator(path, status)) {
    if (is_ours(entry.path())) files.push_back(entry.path());
  }
  if (status) {
    const char* const remedy = status == std::errc::not_a_directory ? "; name a folder that is new or empty" : "";
    throw Error(ErrorCode::kFileUnwritable,
                "cannot read the folder " + path.string() + ": " + status.message() + remedy);
  }
  return files;
}

const fs::path& make_folder(const fs::path& path) {
  std::error_code status;
  fs::create_directories(path, status);
  if (status) {
    throw Error(ErrorCode::kFileUnwritable, "cannot make the folder " + path.string() + ": " + status.message());
  }
  return path;
}

/// What a job that was killed was writing just then.
void remove_temporary_files(const fs::path& path) {
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(path, ignored)) {
    const std::string name = entry.path().filename().string();
    if (is_ours(final_name_of_temporary(name))) fs::remove(entry.path(), ignored);
  }
}

void refuse_files(const fs::path& path, Existing existing) {
  const std::size_t files = files_of_ours(path).size();
  if (files == 0 || existing == Existing::kReplace) return;
  std::string remedy = "take another folder, or --force to replace them";
  if (fs::exists(path / JobJournal::kName)) {
    if (existing == Existing::kResume) return;
    remedy = "--resume to go on with that job, " + remedy;
  } else if (existing == Existing::kResume) {
    if (fs::exists(path / kManifest)) return;  // A job that is complete: holds_whole_job() says whether it is this one.
    remedy = "no job was interrupted here; " + remedy;
  }
  throw Error(ErrorCode::kFileUnwritable,
              path.string() + " holds " + std::to_string(files) + " files of an earlier run; " + remedy);
}

}  // namespace

void refuse_used_folder(const fs::path& path, Existing existing) {
  refuse_locked_folder(path);
  refuse_files(path, existing);
}

ClaimedFolder::ClaimedFolder(fs::path path, Existing existing) : path_(std::move(path)), lock_(make_folder(path_)) {
  if (!lock_.excludes_others()) {
    print_note(path_.string() + " is on a file system without locks: see that no other job writes to it");
  }
  refuse_files(path_, existing);
  remove_temporary_files(path_);
  if (existing != Existing::kResume) clear();
}

void ClaimedFolder::clear() {
  std::error_code ignored;
  for (const fs::path& file : files_of_ours(path_)) fs::remove(file, ignored);
}

void ClaimedFolder::complete(const std::string& manifest) {
  sync_folder(path_);
  write_file_on_disk(path_ / kManifest, manifest);
}

LayerFolder::LayerFolder(fs::path path, LayerFiles files, Existing existing, const JobKey& job)
    : folder_(std::in_place, std::move(path), existing),
      files_(std::move(files)),
      job_(job),
      finished_(existing == Existing::kResume ? read_journal(folder_->path(), job) : FinishedLayers()) {
  journal_.emplace(folder_->path(), job, finished_);
  manifest_.mutable_layers()->Swap(&finished_.layers);
}

void LayerFolder::write_file_in_folder(const std::string& name, std::string_view bytes) {
  write_file(folder_->path() / name, bytes);
  written_bytes_ += bytes.size();
}

void LayerFolder::write(const client::Layer& layer) {
  const std::vector<LayerFile> files = files_.of(layer);
  for (const LayerFile& file : files) write_file_in_folder(file.name, file.bytes);
  *manifest_.add_layers() = files_.manifest_entry(layer, files);
  journal_->add(*manifest_.layers().rbegin());
}

std::string LayerFolder::write_contact_sheet(const std::string& png) {
  write_file_in_folder(kContactSheet, png);
  if (job_.share) job_.share->contact_sheet = client::sha256_of(png);
  return (folder_->path() / kContactSheet).string();
}

void LayerFolder::finish(const client::SliceOutcome& outcome, const v1::SliceJob& sliced,
                         const v1::PlanSlicesResponse& plan) {
  complete_manifest(outcome, sliced, plan, job_, manifest_);
  const std::string text = json_of(manifest_) + "\n";
  folder_->complete(text);
  written_bytes_ += text.size();
  journal_->remove();
  folder_.reset();
}

}  // namespace ccslice::cli
