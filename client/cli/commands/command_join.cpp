// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "client/call.h"
#include "client/cli/base/console.h"
#include "client/cli/base/message_json.h"
#include "client/cli/base/output_file.h"
#include "client/cli/base/text_values.h"
#include "client/cli/commands/commands.h"
#include "client/cli/output/joined_job.h"
#include "client/cli/output/layer_entry.h"
#include "client/cli/output/layer_folder.h"
#include "core/base/error.h"

namespace ccslice::cli {
namespace {

namespace fs = std::filesystem;

struct JoinOptions {
  std::vector<std::string> shares;
  std::string output;
  bool force = false;
};

/// What was done.
struct JoinResult {
  std::uint64_t files = 0, linked_files = 0;
  std::uint64_t written_bytes = 0;  // Links aren't counted.
  std::string contact_sheet;        // Its path, unless there is none.
  double seconds = 0;
};

/// The folder of the job is to be new or empty: what else is in it would look like a part of the job.
void refuse_output(const JoinOptions& options) {
  if (options.output == "-") throw UsageError("join writes to a folder: -o takes its name, not -");
  std::error_code status;
  for (const std::string& share : options.shares) {
    if (!fs::equivalent(share, options.output, status) || status) continue;
    throw UsageError("-o " + options.output + " is the folder of a share; name another one");
  }
  refuse_used_folder(options.output, options.force ? Existing::kReplace : Existing::kRefuse);
  if (options.force || !fs::exists(options.output, status) || fs::is_empty(options.output, status)) return;
  throw Error(ErrorCode::kFileUnwritable,
              options.output + " isn't empty; take another folder, or --force to write beside what is in it");
}

std::string fault_of_file(const fs::path& path, const v1::StoredFile& file) {
  std::error_code status;
  const std::uintmax_t bytes = fs::file_size(path, status);
  if (status) return "can't be read: " + status.message();
  if (bytes == file.file_bytes()) return "has changed since: its SHA-256 is another one";
  return "has " + std::to_string(bytes) + " bytes instead of " + std::to_string(file.file_bytes());
}

std::string whole_file(const ShareFolder& share, const v1::StoredFile& file) {
  std::optional<std::string> bytes = read_whole_file(share.path, file);
  if (bytes) return std::move(*bytes);
  const fs::path path = share.path / file.file();
  throw Error(ErrorCode::kFileSyntax, path.string() + " " + fault_of_file(path, file) + "; slice that share anew: " +
                                          "--share " + describe(share.record.share) + " --force");
}

/// A link if the file system has such, or else a copy. Links of symbolic links would lead elsewhere.
void put_file(const ShareFolder& share, const v1::StoredFile& file, const fs::path& folder, JoinResult& result) {
  const std::string bytes = whole_file(share, file);
  const fs::path from = share.path / file.file(), to = folder / file.file();
  std::error_code status;
  if (fs::exists(fs::symlink_status(to, status))) {
    throw Error(ErrorCode::kFileSyntax, (share.path / kManifest).string() + " names " + file.file() + " a second time");
  }
  ++result.files;
  if (fs::is_regular_file(fs::symlink_status(from, status))) {
    fs::create_hard_link(from, to, status);
    if (!status) {
      ++result.linked_files;
      return;
    }
  }
  write_file(to, bytes);
  result.written_bytes += bytes.size();
}

/// Files of layers that are in several shares are compared with their digests in each.
void put_layers(Session& session, const JoinedJob& job, const fs::path& folder, JoinResult& result) {
  Progress progress("joining", "layers", job.layers(), session.quiet());
  std::uint64_t done = 0;
  for (std::size_t s = 0; s < job.shares().size(); ++s) {
    const ShareFolder& share = job.shares()[s];
    for (std::size_t i = 0; i < share.layers.size(); ++i) {
      if (session.call().cancellation->cancelled()) client::throw_cancelled_here();
      for (const v1::StoredFile& file : files_of_entry(share.layers[i])) {
        job.takes(s, i) ? put_file(share, file, folder, result) : static_cast<void>(whole_file(share, file));
      }
      if (job.takes(s, i)) progress.update(++done);
    }
  }
}

void put_contact_sheet(const JoinedJob& job, const fs::path& folder, JoinResult& result) {
  const ShareFolder* const share = job.with_contact_sheet();
  if (share == nullptr) return;
  std::error_code status;
  const std::uintmax_t bytes = fs::file_size(share->path / kContactSheet, status);
  v1::StoredFile sheet;
  sheet.set_file(kContactSheet);
  sheet.set_file_bytes(status ? 0 : bytes);
  sheet.set_sha256(share->record.contact_sheet);
  put_file(*share, sheet, folder, result);
  result.contact_sheet = (folder / kContactSheet).string();
}

void report_joined(const Session& session, const JoinOptions& options, const JoinedJob& job, const JoinResult& result) {
  if (session.options().json) {
    const ShareFolder& any = job.shares().front();
    v1::JoinedLayers document;
    document.set_output(options.output);
    document.set_mesh_id(any.manifest.slice_job().parts(0).mesh_id());
    document.set_engine_version(any.manifest.engine_version());
    document.set_shares(static_cast<std::uint32_t>(job.shares().size()));
    document.set_layers(job.layers());
    document.set_files(result.files);
    document.set_linked_files(result.linked_files);
    document.set_written_bytes(result.written_bytes);
    document.set_seconds(result.seconds);
    if (!result.contact_sheet.empty()) document.set_contact_sheet(result.contact_sheet);
    return print_line(json_of(document));
  }
  print_line(show_count(job.layers(), "layer") + " of " + show_count(job.shares().size(), "folder") + ", " +
             show_count(result.files) + " files, " + show_count(result.linked_files) + " of them linked, in " +
             show_duration(result.seconds) + " -> " + options.output);
  if (!result.contact_sheet.empty()) print_line("contact sheet: " + result.contact_sheet);
}

void run_join(Session& session, const JoinOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  refuse_output(options);
  std::vector<ShareFolder> shares;
  for (const std::string& share : options.shares) shares.push_back(read_share_folder(share));
  const JoinedJob job(std::move(shares));
  const std::string manifest = json_of(job.manifest()) + "\n";
  ClaimedFolder folder(options.output, options.force ? Existing::kReplace : Existing::kRefuse);
  JoinResult result;
  try {
    put_layers(session, job, folder.path(), result);
    put_contact_sheet(job, folder.path(), result);
    folder.complete(manifest);
  } catch (...) {
    folder.clear();
    throw;
  }
  result.written_bytes += manifest.size();
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  report_joined(session, options, job, result);
}

}  // namespace

Command add_join(CLI::App& parent, CommonOptions& common) {
  auto options = std::make_shared<JoinOptions>();
  CLI::App* app = parent.add_subcommand("join", "Merge the folders of all shares into the folder of the whole job");
  app->add_option("SHARE", options->shares, "Folders that `slice --share` wrote, all shares of one job in any order")
      ->required();
  app->add_option("-o,--output", options->output,
                  "Folder to write: what `slice` would have written without --share, byte for byte. Files are hard "
                  "links where the file system has such, and copies elsewhere")
      ->required();
  app->add_flag("--force", options->force, "Replace the layers of an earlier run, or write beside other files");
  add_output_options(*app, common);
  app->footer(
      "Examples:\n  ccslice slice part.mesh --pitch 0.1 --share 1/2 -o part-1\n"
      "  ccslice slice part.mesh --pitch 0.1 --share 2/2 -o part-2\n"
      "  ccslice join part-1 part-2 -o part");
  return {app, [options](Session& session) { run_join(session, *options); }};
}

}  // namespace ccslice::cli
