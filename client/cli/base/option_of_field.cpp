// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/base/option_of_field.h"

#include <algorithm>
#include <array>

namespace ccslice::cli {
namespace {

struct FieldOption {
  std::string_view field;  // It and all that is in it.
  std::string_view option;
};

/// The first row that fits counts.
constexpr std::array<FieldOption, 51> kOptions = {{
    {"printer", "--printer"},
    {"grid.pitch", "--pitch"},
    {"grid.extent", "--extent"},
    {"grid.origin_mm", "--origin"},
    {"grid", "--pitch"},
    {"region.voxels", "--box-voxels"},
    {"region", "--box"},
    {"parts[].placements", "--at, --rotate, --scale, --translate"},
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
    {"fields[].volume", "--volume"},
    {"fields", "--field, --volume, --cut-where, --shell or --keep-out"},
    {"cut", "--cut-where"},
    {"overlaps", "--overlaps"},
    {"printing.materials", "--material"},
    {"printing.map.overrides", "--where, --shell or --keep-out"},
    {"printing.map", "--map"},
    {"printing.cell_region_maps[].map.overrides", "--where, --shell or --keep-out"},
    {"printing.cell_region_maps[].cell_region", "region:... of --map, --where, --shell or --keep-out"},
    {"printing.cell_region_maps", "--map region:..."},
    {"printing.halftone.seed", "--seed"},
    {"printing.halftone", "--halftone"},
    {"printing.background_rgba", "--background"},
    {"printing", "--material"},
    {"contours.by_cell_region", "--contours-by-cell-region"},
    {"tolerances.contour_mm", "--contour-tolerance"},
    {"tolerances.channel", "--channel-tolerance"},
    {"contour_tolerance_mm", "--contour-tolerance"},
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

/// What fields are written of: "planes[2].channel".
bool is_field_character(char c) {
  return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '.' || c == '[' || c == ']';
}

/// Fields of fields, as in "grid.pitch", become options. Words without a dot may be words only, and what stands in
/// quotation marks is a user's.
std::string with_options_for_fields(std::string_view text) {
  std::string out;
  bool quoted = false;
  for (std::size_t at = 0; at < text.size();) {
    if (text[at] == '"') quoted = !quoted;
    std::size_t end = at;
    while (!quoted && end < text.size() && is_field_character(text[end])) ++end;
    std::string_view word = text.substr(at, end - at);
    while (word.ends_with('.')) word.remove_suffix(1);  // A sentence ends here.
    const std::string_view option = word.find('.') == std::string_view::npos ? "" : option_of_field(word);
    const std::size_t taken = std::max<std::size_t>(word.size(), 1);
    out += option.empty() ? text.substr(at, taken) : option;
    at += taken;
  }
  return out;
}

}  // namespace

std::string_view option_of_field(std::string_view field) {
  constexpr std::string_view kJob = "job.";  // Of a request, or of a layer to be shown.
  std::string plain = without_indices(field);
  if (const std::size_t job = plain.find(kJob); job != std::string::npos && (job == 0 || plain[job - 1] == '.')) {
    plain.erase(0, job + kJob.size());
  }
  const auto found =
      std::ranges::find_if(kOptions, [&](const FieldOption& row) { return is_within(plain, row.field); });
  return found == kOptions.end() ? std::string_view() : found->option;
}

std::string in_terms_of_options(const std::string& message) {
  const std::size_t colon = message.find(": ");
  if (colon == std::string::npos) return message;
  const std::string_view option = option_of_field(std::string_view(message).substr(0, colon));
  return option.empty() ? message
                        : std::string(option) + with_options_for_fields(std::string_view(message).substr(colon));
}

}  // namespace ccslice::cli
