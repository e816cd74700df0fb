// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The folder of a share (job_share.h), read back to make the job of it and of others.

#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/options/job_share.h"
#include "client/cli/output/layer_entry.h"

namespace ccslice::cli {

struct ShareLayer {
  std::string entry;  // What manifest.json says of it, as it is written there.
  std::vector<FileEntry> files;
};

struct ShareFolder {
  std::filesystem::path path;
  ShareRecord record;
  std::vector<ShareLayer> layers;  // All of record.layers, in order.
  /// All members of manifest.json in their order, as they are written there. That of the layers is empty.
  std::vector<std::pair<std::string, std::string>> members;

  /// A member's text, or nothing.
  std::string member(const std::string& name) const;
};

/// Reads manifest.json, no other file. Throws Error{kFileUnreadable, kFileSyntax} unless it is that of a whole share.
ShareFolder read_share_folder(const std::filesystem::path& path);

}  // namespace ccslice::cli
