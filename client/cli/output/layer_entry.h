// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What manifest.json and the journal say of a layer (LayerFiles::manifest_entry), read back.

#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/base/messages.h"
#include "client/client.h"

namespace ccslice::cli {

/// The layer's files: those of its planes, then that of its contours if there is one. Their names never have a folder,
/// whatever was written.
std::vector<v1::StoredFile> files_of_entry(const v1::LayerEntry& layer);

/// What the layer counts for in its job; the header is empty.
client::SliceOutcome counts_of_entry(const v1::LayerEntry& layer);

/// The file's bytes; nothing unless it is there with the size and the digest that its entry says.
[[nodiscard]] std::optional<std::string> read_whole_file(const std::filesystem::path& folder,
                                                         const v1::StoredFile& entry);

}  // namespace ccslice::cli
