// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The folder of a share (job_share.h), read back to make the job of it and of others.

#pragma once

#include <filesystem>
#include <vector>

#include "client/cli/base/messages.h"
#include "client/cli/options/job_share.h"

namespace ccslice::cli {

struct ShareFolder {
  std::filesystem::path path;
  ShareRecord record;
  std::vector<v1::LayerEntry> layers;  // All of record.layers, in order.
  v1::Manifest manifest;               // Without them.
};

/// Reads manifest.json, no other file. Throws Error{kFileUnreadable, kFileSyntax} unless it is that of a whole share.
ShareFolder read_share_folder(const std::filesystem::path& path);

}  // namespace ccslice::cli
