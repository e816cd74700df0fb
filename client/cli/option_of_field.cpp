// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/option_of_field.h"

#include <algorithm>
#include <array>

namespace ccslice::cli {
namespace {

struct FieldOption {
  std::string_view field;  // It and all that is in it.
  std::string_view option;
};

/// The first row that fits counts.
constexpr std::array<FieldOption, 41> kOptions = {{
    {"printer", "--profile"},
    {"grid.pitch", "--pitch"},
    {"grid.extent", "--extent"},
    {"grid.origin_mm", "--origin"},
    {"grid", "--pitch"},
    {"region.voxels", "--region-voxels"},
    {"region", "--region"},
    {"placement", "--rotate, --scale, --translate"},
    {"layout", "--row-order, --flip"},
    {"planes[].channel", "--channel"},
    {"planes[].channels", "--all-channels"},
    {"planes[].value_range", "--channel"},
    {"planes[].outside_sample", "--outside"},
    {"planes[].sample_type", "--channel"},
    {"planes[].materials", "--material"},
    {"planes[].material_mask", "--masks"},
    {"planes[].cell_regions", "--cell-regions"},
    {"planes[].encoding", "--encoding"},
    {"planes", "--channel"},
    {"printing.materials", "--material"},
    {"printing.map", "--map"},
    {"printing.cell_region_maps", "--map region:..."},
    {"printing.halftone.seed", "--seed"},
    {"printing.halftone", "--halftone"},
    {"printing.background_rgba", "--background"},
    {"printing", "--material"},
    {"contour_tolerance_mm", "--tolerance"},
    {"material_tolerance", "--material-tolerance"},
    {"smallest_feature_mm", "--smallest-feature"},
    {"chord_tolerance_mm", "--chord-tolerance"},
    {"first_layer", "--layers"},
    {"layer_count", "--layers"},
    {"plane.free", "--plane"},
    {"plane.layer.layer", "--layer"},
    {"plane.layer", "--pitch"},
    {"content.channel.range", "--range"},
    {"content.channel", "--channel"},
    {"content.lines", "--lines"},
    {"content", "--show"},
    {"width", "--pixels"},
    {"height", "--pixels"},
}};

/// "planes[2].channel" becomes "planes[].channel".
std::string without_indices(std::string_view field) {
  std::string plain;
  bool inside = false;
  for (const char c : field) {
    if (c == ']') inside = false;
    if (!inside) plain += c;
    if (c == '[') inside = true;
  }
  return plain;
}

bool is_within(std::string_view field, std::string_view outer) {
  return field.starts_with(outer) &&
         (field.size() == outer.size() || field[outer.size()] == '.' || field[outer.size()] == '[');
}

}  // namespace

std::string_view option_of_field(std::string_view field) {
  const std::string plain = without_indices(field);
  const auto found =
      std::ranges::find_if(kOptions, [&](const FieldOption& row) { return is_within(plain, row.field); });
  return found == kOptions.end() ? std::string_view() : found->option;
}

std::string in_terms_of_options(const std::string& message) {
  const std::size_t colon = message.find(": ");
  if (colon == std::string::npos) return message;
  const std::string_view option = option_of_field(std::string_view(message).substr(0, colon));
  return option.empty() ? message : std::string(option) + message.substr(colon);
}

}  // namespace ccslice::cli
