// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output/share_folder.h"

#include <cstdint>
#include <iterator>
#include <optional>

#include "client/cli/output/job_journal.h"
#include "client/cli/output/layer_entry.h"
#include "client/cli/output/layer_files.h"
#include "client/cli/output/manifest.h"
#include "core/base/echo.h"
#include "core/base/error.h"
#include "core/base/read_file.h"

namespace ccslice::cli {
namespace {

namespace fs = std::filesystem;

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

/// Looks at each layer's number and at the names of its files.
void check_layers(const ShareFolder& share) {
  const LayerRange& range = share.record.layers;
  const auto expected = std::size_t{range.last} - range.first + 1;
  if (share.layers.size() != expected) refuse_manifest(share.path, "doesn't have the layers of its share");
  std::uint32_t number = range.first;
  for (const v1::LayerEntry& layer : share.layers) {
    if (layer.layer() != number++) refuse_manifest(share.path, "doesn't have the layers of its share in order");
    if (layer.planes_size() != share.manifest.planes_size() ||
        layer.has_contours() != share.layers.front().has_contours()) {
      refuse_manifest(share.path, "lacks files of layer " + std::to_string(layer.layer()));
    }
    for (const v1::StoredFile& file : files_of_entry(layer)) {
      if (is_layer_file(file.file())) continue;
      refuse_manifest(share.path, "names " + echoed(file.file()) + ", which isn't a layer's file");
    }
  }
}

}  // namespace

ShareFolder read_share_folder(const fs::path& path) {
  constexpr std::uint64_t kMostManifestBytes = std::uint64_t{4} << 30;
  if (!fs::exists(path / kManifest)) refuse_incomplete(path);
  ShareFolder share{path, {}, {}, {}};
  v1::Manifest& manifest = share.manifest;
  const std::string fault = read_manifest(read_file_bytes((path / kManifest).string(), kMostManifestBytes), manifest);
  if (!fault.empty()) refuse_manifest(path, fault);
  if (!manifest.has_share()) refuse_manifest(path, "isn't that of a share: slice one with --share I/N");
  if (manifest.engine_version().empty()) refuse_manifest(path, "lacks engine_version");
  if (!manifest.has_grid()) refuse_manifest(path, "lacks grid");
  const std::optional<ShareRecord> record = share_record(manifest.share());
  if (!record) refuse_manifest(path, "doesn't say which share it is");
  share.record = *record;
  google::protobuf::RepeatedPtrField<v1::LayerEntry> layers;
  layers.Swap(manifest.mutable_layers());
  share.layers.assign(std::make_move_iterator(layers.begin()), std::make_move_iterator(layers.end()));
  check_layers(share);
  return share;
}

}  // namespace ccslice::cli
