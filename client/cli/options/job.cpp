// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/options/job.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string_view>
#include <utility>

#include "client/cli/base/option_group.h"
#include "client/cli/base/text_values.h"
#include "client/job.h"
#include "client/plane_encodings.h"
#include "core/base/choice_text.h"

namespace ccslice::cli {
namespace {

constexpr double kMmPerInch = 25.4;
constexpr std::string_view kAuto = "auto";

std::optional<v1::SampleType> sample_type_of(const std::string& text) {
  if (text == "u8") return v1::SAMPLE_TYPE_UINT8;
  if (text == "u16") return v1::SAMPLE_TYPE_UINT16;
  if (text == "f32") return v1::SAMPLE_TYPE_FLOAT32;
  return std::nullopt;
}

std::string option_name(const client::PlaneEncoding& encoding) {
  std::string name(encoding.name);
  std::ranges::replace(name, '_', '-');
  return name;
}

bool has_alpha(const client::PlaneEncoding& encoding) {
  return encoding.without_alpha != v1::PLANE_ENCODING_UNSPECIFIED;
}

/// What --encoding takes.
std::vector<std::string> encoding_options() {
  std::vector<std::string> names = {std::string(kAuto)};
  for (const client::PlaneEncoding& encoding : client::plane_encodings()) {
    if (!has_alpha(encoding)) names.push_back(option_name(encoding));
  }
  return names;
}

std::string encoding_help() {
  struct Choice {
    std::string name;
  };
  std::vector<Choice> choices;
  for (const client::PlaneEncoding& encoding : client::plane_encodings()) {
    if (has_alpha(encoding)) continue;
    const std::string note(encoding.note);
    choices.push_back({option_name(encoding) + (note.empty() ? "" : " (" + note + ")")});
  }
  return choice_text(choices) + "; auto is png, zstd for f32, and exr for --all-channels";
}

/// The plane shows numbers: those of materials or of cell regions.
bool shows_numbers(const v1::PlaneSpec& plane) { return plane.has_materials() || plane.has_cell_regions(); }

v1::PlaneEncoding encoding_of(const std::string& name, const v1::PlaneSpec& plane) {
  for (const client::PlaneEncoding& encoding : client::plane_encodings()) {
    if (name != option_name(encoding) || (encoding.only_materials && !shows_numbers(plane))) continue;
    const std::string_view objection = encoding.objection ? encoding.objection(plane) : "";
    if (!objection.empty()) throw UsageError(std::string(objection));
    return encoding.value;
  }
  if (plane.has_channels()) return v1::PLANE_ENCODING_EXR;
  return plane.sample_type() == v1::SAMPLE_TYPE_FLOAT32 ? v1::PLANE_ENCODING_RAW_ZSTD : v1::PLANE_ENCODING_PNG;
}

bool shows_channels(const v1::PlaneSpec& plane) { return plane.has_channel() || plane.has_channels(); }

v1::PlaneEncoding encoding_with_alpha(const v1::PlaneSpec& plane) {
  const auto found =
      std::ranges::find(client::plane_encodings(), plane.encoding(), &client::PlaneEncoding::without_alpha);
  if (found != client::plane_encodings().end()) return found->value;
  throw UsageError(
      "--outside alpha is for PNG and TIFF pictures of one channel; take --encoding png or tiff, or give "
      "--outside a number");
}

/// A sample of the plane.
double parse_outside(const std::string& text, const v1::PlaneSpec& plane) {
  const bool floats = plane.sample_type() == v1::SAMPLE_TYPE_FLOAT32;
  if (floats && text == "nan") return std::numeric_limits<double>::quiet_NaN();
  const double sample = parse_number("--outside", text);
  if (floats) return sample;
  const bool bytes = plane.sample_type() == v1::SAMPLE_TYPE_UINT8;
  if (sample >= 0 && sample <= (bytes ? 255 : 65535) && sample == std::floor(sample)) return sample;
  throw UsageError(std::string("--outside takes a whole number from 0 to ") + (bytes ? "255 for u8" : "65535 for u16") +
                   ", or alpha, not '" + text + "'");
}

void set_outside(const std::string& text, std::vector<v1::PlaneSpec>& planes) {
  if (text.empty()) return;
  if (std::ranges::none_of(planes, shows_channels)) {
    throw UsageError("--outside is for pictures of channels; name one with --channel");
  }
  for (v1::PlaneSpec& plane : planes) {
    if (!shows_channels(plane)) continue;
    if (text == "alpha") {
      plane.set_encoding(encoding_with_alpha(plane));
    } else {
      plane.set_outside_sample(parse_outside(text, plane));
    }
  }
}

void set_value_range(const std::string& text, v1::PlaneSpec& plane) {
  const std::size_t dots = text.find("..");
  if (dots == std::string::npos) throw UsageError("--channel values go from MIN..MAX, as in 0..1, not '" + text + "'");
  plane.mutable_value_range()->set_min(parse_number("--channel", text.substr(0, dots)));
  plane.mutable_value_range()->set_max(parse_number("--channel", text.substr(dots + 2)));
  if (plane.value_range().min() >= plane.value_range().max()) {
    throw UsageError("--channel values go from a smaller to a larger number, not '" + text + "'");
  }
}

/// NAME[:TYPE[:MIN..MAX]]. Names may hold colons themselves, so the type is looked for from the end.
v1::PlaneSpec parse_channel(const std::string& text) {
  const std::vector<std::string> parts = split(text, ':');
  v1::PlaneSpec plane;
  plane.set_sample_type(v1::SAMPLE_TYPE_UINT8);
  std::size_t name_parts = parts.size();
  for (std::size_t i = parts.size(); i-- > 1 && i + 2 >= parts.size();) {
    const std::optional<v1::SampleType> type = sample_type_of(parts[i]);
    if (!type) continue;
    plane.set_sample_type(*type);
    name_parts = i;
    if (i + 1 < parts.size()) set_value_range(parts[i + 1], plane);
    break;
  }
  std::string name;
  for (std::size_t i = 0; i < name_parts; ++i) name += (i ? ":" : "") + parts[i];
  if (name.empty()) throw UsageError("--channel takes a channel's name, as in stiffness:u16, not '" + text + "'");
  plane.mutable_channel()->set_name(name);
  return plane;
}

v1::VoxelPitch parse_pitch(const GridOptions& options) {
  if (!options.pitch.empty()) {
    const std::vector<double> values = parse_numbers("--pitch", options.pitch, 1, 3);
    if (values.size() == 2) throw UsageError("--pitch takes one number or three, not '" + options.pitch + "'");
    return client::pitch_of(values[0], values[values.size() == 3 ? 1 : 0], values[values.size() == 3 ? 2 : 0]);
  }
  if (options.dpi.empty() || options.layer_height_mm == 0) {
    throw UsageError("give a pitch: --printer NAME, --pitch X,Y,Z in mm, or --dpi X,Y with --layer-height in mm");
  }
  const std::vector<double> dpi = parse_numbers("--dpi", options.dpi, 1, 2);
  for (const double value : dpi) {
    if (value <= 0) throw UsageError("--dpi takes positive numbers, not '" + options.dpi + "'");
  }
  return client::pitch_of(kMmPerInch / dpi.front(), kMmPerInch / dpi.back(), options.layer_height_mm);
}

}  // namespace

void add_grid_options(CLI::App& command, GridOptions& options) {
  const OptionGroup group(command, "Grid");
  command.add_option("--printer", options.printer,
                     "Take the pitch of this printer, unless another one is given, and warn of what the printer can't "
                     "take. `ccslice printers` lists them");
  CLI::Option* pitch = command.add_option("--pitch", options.pitch, "Voxel pitch in mm: X,Y,Z or one number for all");
  command.add_option("--dpi", options.dpi, "Voxels an inch: X,Y or one number for both")->excludes(pitch);
  command.add_option("--layer-height", options.layer_height_mm, "Pitch in z in mm, with --dpi")->excludes(pitch);
  command.add_option("--origin", options.origin, "Lower corner of the grid, X,Y,Z in mm (default: the part's)");
  command.add_option("--extent", options.extent,
                     "Size of the grid: COLUMNS,ROWS,LAYERS (default: as many as the part needs)");
  CLI::Option* region =
      command.add_option("--box", options.region,
                         "Slice only this box of the grid: X0,Y0,Z0,X1,Y1,Z1, its lower and upper "
                         "corner in mm of the printer's frame. Its voxels are those whose centres are "
                         "in it, with the same values as in the whole job. Layers keep their numbers");
  command
      .add_option(
          "--box-voxels", options.region_voxels,
          "The same in voxels: COLUMN,ROW,LAYER of the box's first voxel, counted from 0, and its COLUMNS,ROWS,LAYERS")
      ->excludes(region);
}

void add_layout_options(CLI::App& command, LayoutOptions& options) {
  const OptionGroup group(command, "Pictures");
  command
      .add_option("--row-order", options.row_order,
                  "Which row of a picture is on top: ascending puts the lowest y there; descending puts the highest, "
                  "as the layer is seen from above (default: ascending, and descending with --format grabcad)")
      ->check(CLI::IsMember({"ascending", "descending"}));
  command
      .add_option("--flip", options.flip,
                  "Mirror the pictures along x, y or xy, for machines that need it. The part, its outlines and the "
                  "numbers of voxels stay as they are; --scale mirrors the part")
      ->check(CLI::IsMember({"x", "y", "xy"}));
}

void add_plane_options(CLI::App& command, PlaneOptions& options) {
  const OptionGroup group(command, "Pictures");
  command.add_flag("--occupancy", options.occupancy,
                   "Write a picture of which voxels are inside (the default if no channel is named)");
  command
      .add_option("--channel", options.channels,
                  "Write a picture of a material channel: NAME[:u8|u16|f32[:MIN..MAX]]. Default: u8, and the channel's "
                  "own range. May be repeated")
      ->allow_extra_args(false);
  command.add_flag(
      "--all-channels", options.all_channels,
      "Write one picture of all channels, as floats: a multi-channel EXR unless --encoding is zstd or raw");
  command.add_flag(
      "--cell-regions", options.cell_regions,
      "Write a picture of which cell region each voxel is in: 1 for the first, 0 outside; PNG files are in "
      "colour (--regions-from makes regions)");
  command.add_flag("--masks", options.masks, "Write a picture for each material, of which voxels hold it");
  command.add_option(
      "--outside", options.outside,
      "What pictures of channels hold outside the part, as manifest.json says: a sample (0 to 255 for u8, 0 "
      "to 65535 for u16, any number or nan for f32), or alpha for PNG and TIFF files with an alpha channel "
      "that is 0 outside (default: 0, as the lowest value inside)");
  command.add_option("--encoding", options.encoding, encoding_help())
      ->check(CLI::IsMember(encoding_options()))
      ->capture_default_str();
  command.add_option("--contour-tolerance", options.tolerance_mm,
                     "Largest distance from contour to surface in mm (default 0.001)");
  command.add_option(
      "--channel-tolerance", options.channel_tolerance,
      "How far a voxel's value may be from exact inversion, as a share of the picture's value range, 0 to 1; "
      "0 inverts every voxel (default 1/1024 for u8 and for materials, 1/65536 for u16 and f32)");
  command.add_flag("--prove-channels", options.prove_channels,
                   "Interpolate only where polynomials' errors are proved to be within --channel-tolerance, not where "
                   "samples say so, and invert all other voxels; materials take 1 to 6 times as long");
}

v1::GridSpec parse_grid(const GridOptions& options) {
  v1::GridSpec grid;
  const bool from_printer =
      !options.printer.empty() && options.pitch.empty() && options.dpi.empty() && options.layer_height_mm == 0;
  if (!from_printer) *grid.mutable_pitch() = parse_pitch(options);
  if (!options.origin.empty()) {
    const std::vector<double> origin = parse_numbers("--origin", options.origin, 3, 3);
    *grid.mutable_origin_mm() = client::vector_of(origin[0], origin[1], origin[2]);
  }
  if (!options.extent.empty()) {
    const std::vector<std::uint32_t> extent = parse_counts("--extent", options.extent, "columns,rows,layers");
    *grid.mutable_extent() = client::extent_of(extent[0], extent[1], extent[2]);
  }
  return grid;
}

std::optional<v1::Region> parse_region(const GridOptions& options) {
  v1::Region region;
  if (!options.region.empty()) {
    const std::vector<double> box = parse_numbers("--box", options.region, 6, 6);
    *region.mutable_box_mm()->mutable_min_mm() = client::vector_of(box[0], box[1], box[2]);
    *region.mutable_box_mm()->mutable_max_mm() = client::vector_of(box[3], box[4], box[5]);
    return region;
  }
  if (options.region_voxels.empty()) return std::nullopt;
  const std::vector<std::uint32_t> voxels =
      parse_counts("--box-voxels", options.region_voxels, "column,row,layer,columns,rows,layers");
  region.mutable_voxels()->set_first_column(voxels[0]);
  region.mutable_voxels()->set_first_row(voxels[1]);
  region.mutable_voxels()->set_first_layer(voxels[2]);
  *region.mutable_voxels()->mutable_extent() = client::extent_of(voxels[3], voxels[4], voxels[5]);
  return region;
}

v1::SliceJob parse_job(const GridOptions& grid, const PlacementOptions& placement, const PrintingOptions& printing) {
  v1::SliceJob job = client::job_of("", parse_placement(placement));
  *job.mutable_grid() = parse_grid(grid);
  if (!grid.printer.empty()) job.mutable_printer()->set_name(grid.printer);
  if (const std::optional<v1::Region> region = parse_region(grid)) *job.mutable_region() = *region;
  if (const std::optional<v1::Printing> printed = parse_printing(printing)) *job.mutable_printing() = *printed;
  return job;
}

v1::PictureLayout parse_layout(const LayoutOptions& options) {
  v1::PictureLayout layout;
  const bool descending = options.row_order == "descending";
  layout.set_row_order(descending ? v1::ROW_ORDER_DESCENDING_Y : v1::ROW_ORDER_ASCENDING_Y);
  layout.set_flip_x(options.flip.find('x') != std::string::npos);
  layout.set_flip_y(options.flip.find('y') != std::string::npos);
  return layout;
}

std::vector<v1::PlaneSpec> parse_planes(const PlaneOptions& options, bool contours_only, const v1::Printing* printing) {
  std::vector<v1::PlaneSpec> planes;
  const bool named = !options.channels.empty() || options.all_channels || options.cell_regions || printing != nullptr;
  if (options.occupancy || (!named && !contours_only)) {
    planes.emplace_back().mutable_occupancy();
    planes.back().set_sample_type(v1::SAMPLE_TYPE_BIT);
  }
  for (const std::string& channel : options.channels) planes.push_back(parse_channel(channel));
  if (options.all_channels) {
    planes.emplace_back().mutable_channels();
    planes.back().set_sample_type(v1::SAMPLE_TYPE_FLOAT32);
  }
  if (options.cell_regions) planes.emplace_back().mutable_cell_regions();
  if (printing != nullptr) planes.emplace_back().mutable_materials();
  if (options.masks && printing == nullptr) throw UsageError("--masks shows materials; name them with --material");
  if (options.masks) {
    for (const v1::PrintMaterial& material : printing->materials()) {
      planes.emplace_back().mutable_material_mask()->set_material(material.name());
    }
  }
  for (v1::PlaneSpec& plane : planes) plane.set_encoding(encoding_of(options.encoding, plane));
  set_outside(options.outside, planes);
  return planes;
}

}  // namespace ccslice::cli
