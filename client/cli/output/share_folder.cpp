// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output/share_folder.h"

#include <algorithm>
#include <cstdint>
#include <optional>

#include "client/cli/base/json_fields.h"
#include "client/cli/base/json_scanner.h"
#include "client/cli/output/job_journal.h"
#include "client/cli/output/layer_files.h"
#include "client/cli/output/manifest.h"
#include "core/base/echo.h"
#include "core/base/error.h"
#include "core/base/read_file.h"
#include "core/mesh_import/mesh_file.h"

namespace ccslice::cli {
namespace {

namespace fs = std::filesystem;
using google::protobuf::Struct;

[[noreturn]] void refuse_manifest(const fs::path& folder, const std::string& what) {
  throw Error(ErrorCode::kFileSyntax, (folder / kManifest).string() + " " + what);
}

/// Says what a folder without manifest.json is.
[[noreturn]] void refuse_incomplete(const fs::path& folder) {
  const std::string what =
      !fs::exists(folder) ? "isn't there: name the folders that slice --share wrote"
      : fs::exists(folder / JobJournal::kName)
          ? "isn't complete: wait until slice has ended there, or go on with it by the same command and --resume"
          : "holds no manifest.json: it isn't a share, or slice --share has to write it anew";
  throw Error(ErrorCode::kFileUnreadable, folder.string() + " " + what);
}

/// Takes the manifest apart without reading its values.
void take_apart(const std::string& manifest, ShareFolder& share) {
  JsonScanner scanner(manifest);
  scanner.require('{', "'{'");
  do {
    std::string name = scanner.string("the name of a member");
    scanner.require(':', "':'");
    std::string value;
    if (name == "layers") {
      for_each_item(scanner, [&] { share.layers.push_back({std::string(scanner.as_written("a layer")), {}}); });
    } else {
      value = scanner.as_written("a value");
    }
    share.members.emplace_back(std::move(name), std::move(value));
  } while (scanner.take(','));
  scanner.require('}', "',' or '}'");
  scanner.require_end();
}

/// Looks at each layer's number and at the names of its files.
void read_layer_entries(const Struct& manifest, ShareFolder& share) {
  const auto& entries = items(manifest, "layers");
  const LayerRange& range = share.record.layers;
  const auto expected = std::size_t{range.last} - range.first + 1;
  if (share.layers.size() != expected || static_cast<std::size_t>(entries.size()) != expected) {
    refuse_manifest(share.path, "doesn't have the layers of its share");
  }
  for (std::size_t i = 0; i < expected; ++i) {
    const Struct& entry = entries[static_cast<int>(i)].struct_value();
    if (number(entry, "layer") != static_cast<double>(range.first + i)) {
      refuse_manifest(share.path, "doesn't have the layers of its share in order");
    }
    share.layers[i].files = files_of_entry(entry);
    for (const FileEntry& file : share.layers[i].files) {
      if (!is_layer_file(file.name)) {
        refuse_manifest(share.path, "names " + echoed(file.name) + ", which isn't a layer's file");
      }
    }
  }
}

}  // namespace

std::string ShareFolder::member(const std::string& name) const {
  const auto found = std::ranges::find(members, name, &std::pair<std::string, std::string>::first);
  return found == members.end() ? std::string() : found->second;
}

ShareFolder read_share_folder(const fs::path& path) {
  constexpr std::uint64_t kMostManifestBytes = std::uint64_t{4} << 30;
  if (!fs::exists(path / kManifest)) refuse_incomplete(path);
  const std::string bytes = read_file_bytes((path / kManifest).string(), kMostManifestBytes);
  const std::optional<Struct> manifest = parse_object(bytes);
  if (!manifest) refuse_manifest(path, "isn't a manifest of layers: was it cut short? Slice the share anew");
  if (const std::string fault = fault_of_manifest(*manifest); !fault.empty()) refuse_manifest(path, fault);
  if (!manifest->fields().contains("share")) {
    refuse_manifest(path, "isn't that of a share: slice one with --share I/N");
  }
  for (const char* member : {"mesh_id", "engine_version", "grid"}) {
    if (!manifest->fields().contains(member)) refuse_manifest(path, std::string("lacks ") + member);
  }
  const std::optional<ShareRecord> record = share_record(field(*manifest, "share").struct_value());
  if (!record) refuse_manifest(path, "doesn't say which share it is");
  ShareFolder share{path, *record, {}, {}};
  try {
    take_apart(bytes, share);
  } catch (const Error& error) {
    refuse_manifest(path, std::string("isn't as it was written: ") + error.what());
  }
  read_layer_entries(*manifest, share);
  return share;
}

}  // namespace ccslice::cli
