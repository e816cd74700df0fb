// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output/layer_files.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "client/cli/base/json.h"
#include "client/cli/base/message_json.h"
#include "client/mesh_bytes.h"
#include "client/plane_encodings.h"

namespace ccslice::cli {
namespace {

constexpr std::string_view kPrefix = "layer_", kPlainPrefix = "slice_";
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

std::string extension_of(const v1::PlaneSpec& plane) {
  const client::PlaneEncoding* encoding = client::find_encoding(plane.encoding());
  return std::string(encoding ? encoding->extension : kUnknownExtension);
}

/// REQUIRES: one plane, if names are plain.
std::vector<std::string> suffixes_of(const std::vector<v1::PlaneSpec>& planes, const LayerNames& names) {
  if (names.plain) return {extension_of(planes.front())};
  std::vector<std::string> suffixes;
  std::set<std::string> used = {"contours"};
  for (std::size_t i = 0; i < planes.size(); ++i) {
    std::string name = file_name_of(planes[i]);
    if (!used.insert(name).second) name += "_" + std::to_string(i);
    used.insert(name);
    suffixes.push_back("_" + name + extension_of(planes[i]));
  }
  return suffixes;
}

std::set<std::string> extensions_of_ours() {
  std::set<std::string> extensions = {".json", ".csv", ".svg"};
  for (const client::PlaneEncoding& encoding : client::plane_encodings()) extensions.emplace(encoding.extension);
  return extensions;
}

std::string contours_as_json(const client::Layer& layer, const ContourFiles& files) {
  v1::LayerOutlines outlines;
  outlines.set_layer(layer.index);
  outlines.set_z_mm(layer.z_mm);
  for (const client::ContourLoop& loop : layer.contours) {
    v1::OutlineLoop& outline = *outlines.add_loops();
    *outline.mutable_points_mm() = {loop.points_mm.begin(), loop.points_mm.end()};
    *outline.mutable_faces() = {loop.faces.begin(), loop.faces.end()};
    *outline.mutable_parameters() = {loop.parameters.begin(), loop.parameters.end()};
    if (files.by_region) outline.set_cell_region(loop.cell_region);
    if (files.by_part) outline.set_placed_part(loop.placed_part);
  }
  return json_of(outlines) + "\n";
}

std::string contours_as_csv(const client::Layer& layer, const ContourFiles& files) {
  std::string text = "loop,x_mm,y_mm";
  text += std::string(files.by_region ? ",cell_region" : "") + (files.by_part ? ",placed_part" : "") + "\n";
  for (std::size_t loop = 0; loop < layer.contours.size(); ++loop) {
    const client::ContourLoop& of = layer.contours[loop];
    const std::vector<double>& points = of.points_mm;
    const std::string end = (files.by_region ? "," + std::to_string(of.cell_region) : "") +
                            (files.by_part ? "," + std::to_string(of.placed_part) : "") + "\n";
    for (std::size_t i = 0; i + 1 < points.size(); i += 2) {
      text += std::to_string(loop) + "," + shortest(points[i]) + "," + shortest(points[i + 1]) + end;
    }
  }
  return text;
}

/// One path of all loops of a part, where even and odd crossings tell inside from outside, or one for each of its cell
/// regions. SVG has y downwards, so it is turned about.
std::string contours_as_svg(const client::Layer& layer, const ContourFiles& files) {
  const auto& [left, bottom, width, height] = files.box_mm;
  std::string text = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + shortest(width) + "mm\" height=\"" +
                     shortest(height) + "mm\" viewBox=\"" + shortest(left) + " " + shortest(-bottom - height) + " " +
                     shortest(width) + " " + shortest(height) + "\">\n<title>layer " + std::to_string(layer.index) +
                     ", z = " + shortest(layer.z_mm) + " mm</title>\n";
  // By placed part and cell region; these are 0 where regions aren't asked for.
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::string> paths;
  for (const client::ContourLoop& loop : layer.contours) {
    std::string& path = paths[{loop.placed_part, loop.cell_region}];
    for (std::size_t i = 0; i + 1 < loop.points_mm.size(); i += 2) {
      path += (i == 0 ? "M" : "L") + shortest(loop.points_mm[i]) + "," + shortest(0 - loop.points_mm[i + 1]);
    }
    path += "Z\n";
  }
  for (const auto& [number, path] : paths) {
    const auto& [part, region] = number;
    const std::string of_part = part == 0 ? "" : "-part-" + std::to_string(part + 1);  // Ids are there once.
    text += files.by_region ? "<path id=\"cell-region-" + std::to_string(region) + of_part + "\"" : "<path";
    text += " fill-rule=\"evenodd\" d=\"" + path + "\"/>\n";
  }
  return text + "</svg>\n";
}

LayerFile contour_file(const std::string& prefix, const client::Layer& layer, const ContourFiles& files) {
  switch (files.format) {
    case ContourFormat::kCsv: return {prefix + "_contours.csv", contours_as_csv(layer, files)};
    case ContourFormat::kSvg: return {prefix + "_contours.svg", contours_as_svg(layer, files)};
    default: return {prefix + "_contours.json", contours_as_json(layer, files)};
  }
}

v1::StoredFile stored(const LayerFile& file) {
  v1::StoredFile entry;
  entry.set_file(file.name);
  entry.set_file_bytes(file.bytes.size());
  entry.set_sha256(client::sha256_of(file.bytes));
  return entry;
}

/// Adds what each part has, and which parts overlap.
void add_parts(const v1::LayerStatistics& statistics, v1::LayerEntry& entry) {
  for (int p = 0; p < statistics.parts_size(); ++p) {
    const auto& of_materials = statistics.parts(p).material_voxels();
    const bool has_any = std::ranges::any_of(of_materials, [](std::uint64_t voxels) { return voxels > 0; });
    if (statistics.parts(p).voxel_count() == 0 && !has_any) continue;
    v1::LayerPart& part = *entry.add_parts();
    part.set_part(static_cast<std::uint32_t>(p));
    part.set_voxel_count(statistics.parts(p).voxel_count());
    *part.mutable_material_voxels() = statistics.parts(p).material_voxels();
  }
  for (const v1::PartOverlap& overlap : statistics.overlaps()) {
    v1::LayerOverlap& added = *entry.add_overlaps();
    added.set_owner(overlap.owner());
    added.set_covered(overlap.covered());
    added.set_voxel_count(overlap.voxel_count());
    for (const double mm : {overlap.place_mm().x(), overlap.place_mm().y(), overlap.place_mm().z()}) {
      added.add_place_mm(mm);
    }
  }
}

}  // namespace

bool is_layer_file(const std::string& name) {
  static const std::set<std::string> kExtensions = extensions_of_ours();
  const std::size_t digits = name.find('_') + 1;
  const std::size_t digits_end = name.find_first_not_of("0123456789", digits);
  if (digits_end == std::string::npos || digits_end == digits) return false;
  const std::string_view prefix = std::string_view(name).substr(0, digits),
                         rest = std::string_view(name).substr(digits_end);
  return (prefix == kPrefix && rest.starts_with('_') &&
          kExtensions.contains(std::filesystem::path(name).extension().string())) ||
         (prefix == kPlainPrefix && rest == ".png");
}

LayerFiles::LayerFiles(const std::vector<v1::PlaneSpec>& planes, ContourFiles contours, std::uint32_t grid_layers,
                       LayerNames names)
    : contours_(contours),
      names_(names),
      suffixes_(suffixes_of(planes, names_)),
      digits_(names_.plain ? 0 : std::max(kFewestDigits, std::to_string(std::max(grid_layers, 1u) - 1).size())) {}

std::string LayerFiles::prefix_of(std::uint32_t layer) const {
  const std::string number = std::to_string(layer - names_.number_0);
  return std::string(names_.plain ? kPlainPrefix : kPrefix) +
         std::string(digits_ - std::min(digits_, number.size()), '0') + number;
}

std::vector<LayerFile> LayerFiles::of(const client::Layer& layer) const {
  const std::string prefix = prefix_of(layer.index);
  std::vector<LayerFile> files;
  for (std::size_t i = 0; i < layer.planes.size(); ++i) {
    files.push_back({prefix + suffixes_[i], layer.planes[i].encoded});
  }
  if (contours_.format != ContourFormat::kNone) files.push_back(contour_file(prefix, layer, contours_));
  return files;
}

v1::LayerEntry LayerFiles::manifest_entry(const client::Layer& layer, const std::vector<LayerFile>& files) const {
  v1::LayerEntry entry;
  const v1::LayerStatistics& statistics = layer.end.statistics();
  entry.set_layer(layer.index);
  entry.set_z_mm(layer.z_mm);
  entry.set_voxel_count(layer.end.voxel_count());
  entry.set_empty(layer.end.empty());
  entry.set_voxels_covered(statistics.voxels_covered());
  if (statistics.voxels_cut() > 0) entry.set_voxels_cut(statistics.voxels_cut());
  entry.set_voxels_coherent(statistics.voxels_coherent());
  entry.set_voxels_full(statistics.voxels_full());
  entry.set_voxels_interpolated(statistics.voxels_interpolated());
  entry.set_voxels_unresolved(statistics.voxels_unresolved());
  entry.set_voxels_repainted(statistics.voxels_repainted());
  entry.set_max_residual_mm(statistics.max_residual_mm());
  entry.set_contour_loops(statistics.contour_loops());
  entry.set_contour_points(statistics.contour_points());
  entry.set_contour_leaves_unresolved(statistics.contour_leaves_unresolved());
  if (statistics.material_voxels_size() > 0) {
    *entry.mutable_material_voxels() = statistics.material_voxels();
    entry.set_voxels_off_map(statistics.voxels_off_map());
    entry.set_voxels_scaled_up(statistics.voxels_scaled_up());
    entry.set_least_fraction_sum(statistics.least_fraction_sum());
  }
  add_parts(statistics, entry);
  for (std::size_t i = 0; i < layer.planes.size(); ++i) {
    v1::StoredFile& plane = *entry.add_planes() = stored(files[i]);
    plane.set_raw_bytes(layer.planes[i].result.raw_bytes());
    plane.set_crc32(layer.planes[i].result.crc32());
  }
  if (contours_.format != ContourFormat::kNone) *entry.mutable_contours() = stored(files.back());
  return entry;
}

}  // namespace ccslice::cli
