// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/grabcad.h"

#include <algorithm>
#include <array>
#include <vector>

#include "client/cli/text_values.h"
#include "core/base/choice_text.h"
#include "core/base/echo.h"

namespace ccslice::cli {
namespace {

struct Resin {
  std::string name;
  std::uint32_t rgba;
};

/// Colours tell resins apart in pictures; they aren't what a print looks like. Those of the first four, and the grey of
/// clear resins, are what public writers and viewers of .gcvf have. Black is the background's.
const std::array<Resin, 11>& resins() {
  static const std::array<Resin, 11> all = {{{"VeroCY-V", 0x00ffffff},
                                             {"VeroMGT-V", 0xff00ffff},
                                             {"VeroYL-V", 0xffff00ff},
                                             {"VUltraWhite", 0xffffffff},
                                             {"VeroUltraClear", 0x898989ff},
                                             {"VeroClear", 0x9a9a9aff},
                                             {"VeroPureWht", 0xf0f0f0ff},
                                             {"VeroBlack", 0x1e1e1eff},
                                             {"Agilus30Clr", 0xc8d2dcff},
                                             {"Agilus30Wht", 0xe6e6dcff},
                                             {"Agilus30Blk", 0x3c3c3cff}}};
  return all;
}

void refuse(const std::string& option, const std::string& instead) {
  throw UsageError("--for grabcad writes one picture of materials for each layer; leave out " + option + instead);
}

}  // namespace

std::optional<std::uint32_t> resin_colour(std::string_view name) {
  const auto found = std::ranges::find(resins(), name, &Resin::name);
  if (found == resins().end()) return std::nullopt;
  return found->rgba;
}

std::string resin_names() { return choice_text(resins()); }

void fit_to_grabcad(LayoutOptions& layout, PlaneOptions& planes) {
  if (planes.occupancy) refuse("--occupancy", "");
  if (!planes.channels.empty()) refuse("--channel", ", or slice them into another folder");
  if (planes.all_channels) refuse("--all-channels", ", or slice them into another folder");
  if (planes.cell_regions) refuse("--cell-regions", "; --map region:... prints them");
  if (planes.masks) refuse("--masks", "");
  if (planes.encoding == "auto") planes.encoding = "png-rgba";
  if (planes.encoding != "png-rgba") refuse("--encoding " + planes.encoding, ": it takes RGBA pictures only");
  if (layout.row_order.empty()) layout.row_order = "descending";
}

void require_grabcad_materials(const v1::Printing* printing) {
  if (printing == nullptr) {
    throw UsageError(
        "--for grabcad prints materials: name them with --material NAME=#RRGGBB, or with --material NAME "
        "for one of " +
        resin_names());
  }
  if (static_cast<std::size_t>(printing->materials_size()) > kMostGrabcadMaterials) {
    throw UsageError("GrabCAD takes at most " + std::to_string(kMostGrabcadMaterials) +
                     " materials, and --material "
                     "names " +
                     std::to_string(printing->materials_size()));
  }
  for (const v1::PrintMaterial& material : printing->materials()) {
    if ((material.rgba() & 0xff) == 0xff) continue;
    throw UsageError("GrabCAD takes opaque colours only; write --material " + echoed(material.name()) +
                     "=#RRGGBB, without a fourth byte, or with ff there");
  }
  if (printing->has_background_rgba() && (printing->background_rgba() & 0xff) != 0xff) {
    throw UsageError("GrabCAD takes opaque colours only; write --background #RRGGBB, or leave it out for black");
  }
}

std::string unknown_resins(const v1::Printing& printing) {
  std::vector<std::string> names;
  for (const v1::PrintMaterial& material : printing.materials()) {
    if (!resin_colour(material.name())) names.push_back("'" + echoed(material.name()) + "'");
  }
  if (names.empty()) return {};
  return "no resins of GrabCAD's are known by the names " + echoed_list(names, names.size()) +
         "; it will ask which ones to print (known: " + resin_names() + ")";
}

LayerNames grabcad_names(std::uint32_t first_layer) { return {.plain = true, .number_0 = first_layer}; }

}  // namespace ccslice::cli
