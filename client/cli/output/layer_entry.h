// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What manifest.json and the journal say of a layer (LayerFiles::manifest_entry), read back.

#pragma once

#include <google/protobuf/struct.pb.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/client.h"

namespace ccslice::cli {

struct FileEntry {
  std::string name;  // Never with a folder, whatever was written.
  std::uint64_t bytes = 0;
  std::string sha256;
};

/// The layer's files: those of its planes, then that of its contours if there is one.
std::vector<FileEntry> files_of_entry(const google::protobuf::Struct& layer);

/// What the layer counts for in its job; the header is empty.
client::SliceOutcome counts_of_entry(const google::protobuf::Struct& layer);

/// The file's bytes; nothing unless it is there with the size and the digest that its entry says.
[[nodiscard]] std::optional<std::string> read_whole_file(const std::filesystem::path& folder, const FileEntry& entry);

}  // namespace ccslice::cli
