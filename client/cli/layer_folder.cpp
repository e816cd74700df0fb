// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/layer_folder.h"

#include <algorithm>
#include <set>
#include <system_error>
#include <utility>

#include "client/cli/manifest.h"
#include "client/cli/output_file.h"
#include "client/mesh_bytes.h"
#include "client/plane_encodings.h"
#include "core/base/error.h"

namespace ccslice::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kManifest = "manifest.json";
constexpr const char* kContactSheet = "contact_sheet.png";
constexpr std::string_view kLayerPrefix = "layer_";
constexpr std::size_t kFewestDigits = 4;
constexpr std::string_view kUnknownExtension = ".zst";  // Such planes don't get as far as a file.

/// A channel's name as part of a file name: letters, digits, '-' and '.' stay, all else becomes '_'.
std::string file_name_of(const v1::PlaneSpec& plane) {
  if (plane.has_channels()) return "channels";
  if (plane.has_materials()) return "materials";
  if (plane.has_occupancy()) return "occupancy";
  if (plane.has_cell_regions()) return "cell_regions";
  std::string name = plane.has_material_mask() ? "mask_" + plane.material_mask().material() : plane.channel().name();
  name = name.substr(0, 64);
  for (char& c : name) {
    const bool plain =
        (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '.';
    if (!plain) c = '_';
  }
  return name;
}

std::vector<std::string> suffixes_of(const std::vector<v1::PlaneSpec>& planes) {
  std::vector<std::string> suffixes;
  std::set<std::string> used = {"contours"};
  for (std::size_t i = 0; i < planes.size(); ++i) {
    std::string name = file_name_of(planes[i]);
    if (!used.insert(name).second) name += "_" + std::to_string(i);
    used.insert(name);
    const client::PlaneEncoding* encoding = client::find_encoding(planes[i].encoding());
    suffixes.push_back("_" + name + std::string(encoding ? encoding->extension : kUnknownExtension));
  }
  return suffixes;
}

std::set<std::string> extensions_of_ours() {
  std::set<std::string> extensions = {".json", ".csv"};
  for (const client::PlaneEncoding& encoding : client::plane_encodings()) extensions.emplace(encoding.extension);
  return extensions;
}

/// Files of ours from an earlier run.
bool is_ours(const fs::path& path) {
  const std::string name = path.filename().string();
  if (name == kManifest || name == kContactSheet || name == JobJournal::kName) return true;
  static const std::set<std::string> kExtensions = extensions_of_ours();
  const std::size_t digits_end = name.find_first_not_of("0123456789", kLayerPrefix.size());
  return name.starts_with(kLayerPrefix) && digits_end != std::string::npos && digits_end > kLayerPrefix.size() &&
         name[digits_end] == '_' && kExtensions.contains(path.extension().string());
}

/// Nothing if there is no such folder.
std::vector<fs::path> files_of_ours(const fs::path& path) {
  std::vector<fs::path> files;
  std::error_code status;
  if (!fs::exists(path, status)) return files;
  for (const fs::directory_entry& entry : fs::directory_iterator(path, status)) {
    if (is_ours(entry.path())) files.push_back(entry.path());
  }
  if (status)
    throw Error(ErrorCode::kFileUnwritable, "cannot read the folder " + path.string() + ": " + status.message());
  return files;
}

/// Makes the folder and says what of the job is there already; all else of ours goes.
FinishedLayers prepare_folder(const fs::path& path, Existing existing, const JobKey& job) {
  refuse_used_folder(path, existing);
  std::error_code status;
  fs::create_directories(path, status);
  if (status) {
    throw Error(ErrorCode::kFileUnwritable, "cannot make the folder " + path.string() + ": " + status.message());
  }
  if (existing == Existing::kResume) return read_journal(path, job);
  for (const fs::path& file : files_of_ours(path)) fs::remove(file, status);
  return {};
}

std::string contours_as_json(const client::Layer& layer) {
  JsonWriter json;
  json.begin_object().member("layer", layer.index).member("z_mm", layer.z_mm).key("loops").begin_array();
  for (const client::ContourLoop& loop : layer.contours) {
    json.begin_array();
    for (std::size_t i = 0; i + 1 < loop.points_mm.size(); i += 2) {
      json.begin_array().value(loop.points_mm[i]).value(loop.points_mm[i + 1]).end_array();
    }
    json.end_array();
  }
  json.end_array().end_object();
  return json.text() + "\n";
}

std::string contours_as_csv(const client::Layer& layer) {
  std::string text = "loop,x_mm,y_mm\n";
  for (std::size_t loop = 0; loop < layer.contours.size(); ++loop) {
    const std::vector<double>& points = layer.contours[loop].points_mm;
    for (std::size_t i = 0; i + 1 < points.size(); i += 2) {
      text += std::to_string(loop) + "," + shortest(points[i]) + "," + shortest(points[i + 1]) + "\n";
    }
  }
  return text;
}

const char* contour_suffix(ContourFormat format) {
  return format == ContourFormat::kCsv ? "_contours.csv" : "_contours.json";
}

}  // namespace

void refuse_used_folder(const fs::path& path, Existing existing) {
  const std::size_t files = files_of_ours(path).size();
  if (files == 0 || existing == Existing::kReplace) return;
  std::string remedy = "take another folder, or --force to replace them";
  if (fs::exists(path / JobJournal::kName)) {
    if (existing == Existing::kResume) return;
    remedy = "--resume to go on with that job, " + remedy;
  } else if (existing == Existing::kResume) {
    remedy = "no job was interrupted here; " + remedy;
  }
  throw Error(ErrorCode::kFileUnwritable,
              path.string() + " holds " + std::to_string(files) + " files of an earlier run; " + remedy);
}

LayerFolder::LayerFolder(fs::path path, const std::vector<v1::PlaneSpec>& planes, ContourFormat contours,
                         std::uint32_t grid_layers, Existing existing, const JobKey& job)
    : path_(std::move(path)),
      contours_(contours),
      finished_(prepare_folder(path_, existing, job)),
      suffixes_(suffixes_of(planes)),
      digits_(std::max(kFewestDigits, std::to_string(std::max(grid_layers, 1u) - 1).size())) {
  journal_.emplace(path_, job, finished_);
  layers_.begin_array();
  for (const std::string& entry : finished_.manifest_entries) layers_.raw(entry);
}

std::string LayerFolder::layer_prefix(std::uint32_t layer) const {
  const std::string number = std::to_string(layer);
  return std::string(kLayerPrefix) + std::string(digits_ - std::min(digits_, number.size()), '0') + number;
}

void LayerFolder::write_file_in_folder(const std::string& name, const std::string& bytes) {
  write_file(path_ / name, bytes);
  written_bytes_ += bytes.size();
}

void LayerFolder::write(const client::Layer& layer) {
  const std::string prefix = layer_prefix(layer.index);
  for (std::size_t i = 0; i < layer.planes.size(); ++i) {
    write_file_in_folder(prefix + suffixes_[i], layer.planes[i].encoded);
  }
  std::string contours;
  if (contours_ != ContourFormat::kNone) {
    contours = contours_ == ContourFormat::kCsv ? contours_as_csv(layer) : contours_as_json(layer);
    write_file_in_folder(prefix + contour_suffix(contours_), contours);
  }
  const std::string entry = manifest_entry(layer, contours);
  journal_->add(entry);
  layers_.raw(entry);
}

fs::path LayerFolder::write_contact_sheet(const std::string& png) {
  write_file_in_folder(kContactSheet, png);
  return path_ / kContactSheet;
}

std::string LayerFolder::manifest_entry(const client::Layer& layer, const std::string& contours) const {
  JsonWriter json;
  const std::string prefix = layer_prefix(layer.index);
  const v1::LayerStatistics& statistics = layer.end.statistics();
  json.begin_object()
      .member("layer", layer.index)
      .member("z_mm", layer.z_mm)
      .member("voxel_count", layer.end.voxel_count())
      .member("empty", layer.end.empty())
      .member("voxels_coherent", statistics.voxels_coherent())
      .member("voxels_full", statistics.voxels_full())
      .member("voxels_interpolated", statistics.voxels_interpolated())
      .member("voxels_unresolved", statistics.voxels_unresolved())
      .member("max_residual_mm", statistics.max_residual_mm())
      .member("contour_loops", statistics.contour_loops())
      .member("contour_points", statistics.contour_points())
      .member("contour_leaves_unresolved", statistics.contour_leaves_unresolved());
  if (statistics.material_voxels_size() > 0) {
    json.key("material_voxels").begin_array();
    for (const std::uint64_t voxels : statistics.material_voxels()) json.value(voxels);
    json.end_array();
  }
  json.key("planes").begin_array();
  for (std::size_t i = 0; i < layer.planes.size(); ++i) {
    json.begin_object()
        .member("file", prefix + suffixes_[i])
        .member("file_bytes", layer.planes[i].encoded.size())
        .member("raw_bytes", layer.planes[i].result.raw_bytes())
        .member("crc32", layer.planes[i].result.crc32())
        .member("sha256", client::sha256_of(layer.planes[i].encoded))
        .end_object();
  }
  json.end_array();
  if (contours_ != ContourFormat::kNone) {
    json.key("contours").begin_object().member("file", prefix + contour_suffix(contours_));
    json.member("file_bytes", contours.size()).member("sha256", client::sha256_of(contours)).end_object();
  }
  return json.end_object().text();
}

void LayerFolder::finish(const client::SliceOutcome& outcome, const v1::Placement& placement) {
  layers_.end_array();
  const std::string text = manifest(outcome, placement, layers_.text());
  sync_folder(path_);
  write_file_on_disk(path_ / kManifest, text);
  written_bytes_ += text.size();
  journal_->remove();
}

}  // namespace ccslice::cli
